#include "controller/parting.h"

#include <limits>

#include "reduced/outputs.h"

namespace mantle::controller {
namespace {

constexpr double kAngle_rad = 0.5, kPlaceLength = 0.25;
constexpr double kBend_rad = 3.0, kStretch = 0.3, kMantle = 20.0;
constexpr double kTime_s = 0.05;  // in which a rate makes as much

}  // namespace

Parting::Parting(const ReducedModel& model)
    : inverse_(2 * model.velocity_count()), difference_(2 * model.velocity_count()) {
  const int n = model.velocity_count();
  auto size = inverse_.head(n);
  size.head<3>().setConstant(kAngle_rad);
  size.segment<3>(3).setConstant(kPlaceLength * model.body_length_m);
  for (int a = 0; a < static_cast<int>(model.arms.size()); ++a) {
    const std::vector<bool> bends = reduced::BendingCoordinates(model.arms[a]);
    for (std::size_t i = 0; i < bends.size(); ++i) {
      size(6 + model.arm_first(a) + static_cast<int>(i)) =
          bends[i] ? kBend_rad / model.robot.arms[a].length_m : kStretch;
    }
  }
  if (model.mantle) {
    size.segment(6 + model.mantle_first(), model.mantle->size) =
        kMantle * model.mantle->basis.scale;
  }
  inverse_.head(n) = size.cwiseInverse().eval();
  inverse_.tail(n) = kTime_s * inverse_.head(n);
}

double Parting::Share(const ReducedState& from, const ReducedState& to) {
  if (!IsFinite(from) || !IsFinite(to)) return std::numeric_limits<double>::infinity();
  StateDifference(from, to, difference_);
  return difference_.cwiseProduct(inverse_).cwiseAbs().maxCoeff();
}

}  // namespace mantle::controller
