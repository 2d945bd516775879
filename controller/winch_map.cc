#include "controller/winch_map.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace mantle::controller {
namespace {

void Check(const char* name, double value, double low, double high) {
  if (std::isfinite(value) && value >= low && value <= high) return;
  throw std::invalid_argument(
      fmt::format("winch map: {} is {:.6g}, must be {:.3g} to {:.3g}", name, value, low, high));
}

constexpr double kSmallest = 1e-12;

}  // namespace

void CheckWinchMap(const WinchMap& map) {
  Check("metres per rad", map.metres_per_rad, kSmallest, 1.0);
  Check("metres per count", map.metres_per_count, kSmallest, 1.0);
  Check("gear efficiency", map.gear_efficiency, 0.1, 1.0);
  Check("friction torque [N m]", map.friction_torque_nm, 0.0, 1e3);
  Check("stiction ratio", map.stiction_ratio, 1.0, 10.0);
  Check("inertia [kg m^2]", map.inertia_kgm2, 0.0, 1e3);
  Check("torque of 1/1000 [N m]", map.permille_nm, kSmallest, 1e3);
  Check("largest torque [1/1000]", map.max_permille, 0.0, 32767.0);
}

double FrictionForce(const WinchMap& map, double tension_n) {
  return map.friction_torque_nm / map.metres_per_rad +
         map.load_friction() * std::max(tension_n, 0.0);
}

double TensionToTorque(const WinchMap& map, double tension_n, double sigma,
                       double acceleration_m_s2) {
  const double force_n = map.mean_load() * tension_n + sigma * FrictionForce(map, tension_n) +
                         map.mass_kg() * acceleration_m_s2;
  return map.metres_per_rad * force_n / map.permille_nm;
}

double TorqueToTension(const WinchMap& map, double torque_permille, double sigma,
                       double acceleration_m_s2) {
  const double force_n = torque_permille * map.permille_nm / map.metres_per_rad -
                         map.mass_kg() * acceleration_m_s2 -
                         sigma * map.friction_torque_nm / map.metres_per_rad;
  return std::max(0.0, force_n / (map.mean_load() + sigma * map.load_friction()));
}

}  // namespace mantle::controller
