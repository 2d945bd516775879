#include "loop/drive_options.h"

#include <fmt/format.h>

#include <cmath>
#include <stdexcept>

namespace mantle::loop {

std::int64_t Period_us(const DriveOptions& options) {
  const double period_ms = 1e3 * options.period_s;
  const double whole = std::round(period_ms);
  if (!(whole >= 1.0 && whole <= 100.0) || std::abs(period_ms - whole) > 1e-6) {
    throw std::invalid_argument(fmt::format(
        "drives.period is {:.6g} s, must be 1 to 100 whole milliseconds", options.period_s));
  }
  return 1000 * static_cast<std::int64_t>(whole);
}

void CheckDriveOptions(const DriveOptions& options) {
  const auto check = [](const char* name, double value, double low, double high) {
    if (std::isfinite(value) && value >= low && value <= high) return;
    throw std::invalid_argument(
        fmt::format("drives.{} is {:.6g}, must be {:.3g} to {:.3g}", name, value, low, high));
  };
  check("cable_stiffness [N/m]", options.cable_stiffness_n_m, 1.0, 1e5);
  check("cable_damping [N s/m]", options.cable_damping_n_s_m, 0.0, 1e3);
  check("pretension [N]", options.pretension_n, 0.0, 1.0);
}

}  // namespace mantle::loop
