#include "loop/drive_options.h"

#include <fmt/format.h>

#include <cmath>
#include <stdexcept>

namespace mantle::loop {

std::int64_t Period_us(const DriveOptions& options) {
  const double period_ms = 1e3 * options.period_s;
  const double whole = std::round(period_ms);
  const double least_ms = 1e3 * drive_bounds::kPeriod_s[0],
               most_ms = 1e3 * drive_bounds::kPeriod_s[1];
  if (!(whole >= least_ms && whole <= most_ms) || std::abs(period_ms - whole) > 1e-6) {
    throw std::invalid_argument(
        fmt::format("drives.period is {:.6g} s, must be {} to {} whole milliseconds",
                    options.period_s, least_ms, most_ms));
  }
  return 1000 * static_cast<std::int64_t>(whole);
}

void CheckDriveOptions(const DriveOptions& options) {
  const auto check = [](const char* name, double value, const double(&bounds)[2]) {
    if (std::isfinite(value) && value >= bounds[0] && value <= bounds[1]) return;
    throw std::invalid_argument(fmt::format("drives.{} is {:.6g}, must be {:.3g} to {:.3g}", name,
                                            value, bounds[0], bounds[1]));
  };
  check("cable_stiffness [N/m]", options.cable_stiffness_n_m, drive_bounds::kCableStiffness_n_m);
  check("cable_damping [N s/m]", options.cable_damping_n_s_m, drive_bounds::kCableDamping_n_s_m);
  check("pretension [N]", options.pretension_n, drive_bounds::kPretension_n);
}

}  // namespace mantle::loop
