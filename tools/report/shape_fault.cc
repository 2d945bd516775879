#include "tools/report/shape_fault.h"

#include <algorithm>
#include <numeric>

namespace mantle::tools {

const char* ShapeFault(const ShapeTelemetry& m) {
  const auto sum = [](const std::vector<std::int32_t>& counts) {
    return std::accumulate(counts.begin(), counts.end(), std::int64_t{0});
  };
  const auto few = [](const std::vector<std::int32_t>& counts) {
    return std::any_of(counts.begin(), counts.end(), [](std::int32_t n) { return n < 1; });
  };
  const bool fits =
      !few(m.arm_nodes) && !few(m.cable_points) && sum(m.arm_nodes) == std::ssize(m.position) &&
      sum(m.cable_points) == std::ssize(m.cable_position) &&
      m.strain.size() + m.arm_nodes.size() == m.position.size() &&
      m.mantle_strain.size() + (m.mantle_profile.empty() ? 0 : 1) == m.mantle_profile.size();
  return fits ? nullptr : "its lists do not fit together";
}

bool SameBodies(const ShapeTelemetry& a, const ShapeTelemetry& b) {
  return a.arm_name == b.arm_name && a.arm_nodes == b.arm_nodes &&
         a.mantle_profile.size() == b.mantle_profile.size() && a.cable_name == b.cable_name &&
         a.cable_points == b.cable_points;
}

}  // namespace mantle::tools
