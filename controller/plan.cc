#include "controller/plan.h"

#include <algorithm>

namespace mantle::controller {

using model::Vector6;

int IntervalAt(const Plan& plan, double t_s) {
  const auto after = std::upper_bound(plan.time_s.begin(), plan.time_s.end(), t_s);
  const int k = static_cast<int>(after - plan.time_s.begin()) - 1;
  return std::clamp(k, 0, static_cast<int>(plan.time_s.size()) - 2);
}

void TensionsAt(const Plan& plan, double t_s, Eigen::Ref<VectorX> tensions) {
  const int k = IntervalAt(plan, t_s);
  const double h = plan.time_s[k + 1] - plan.time_s[k];
  const double s = std::clamp((t_s - plan.time_s[k]) / h, 0.0, 1.0);
  tensions = (1 - s) * plan.tensions.col(k) + s * plan.tensions.col(k + 1);
}

void StateAt(const Plan& plan, double t_s, ReducedState* state) {
  const int k = IntervalAt(plan, t_s);
  const ReducedState &a = plan.states[k], &b = plan.states[k + 1];
  const double h = plan.time_s[k + 1] - plan.time_s[k];
  const double s = std::clamp((t_s - plan.time_s[k]) / h, 0.0, 1.0);
  const double s2 = s * s, s3 = s2 * s;
  const double h01 = 3 * s2 - 2 * s3, h10 = s3 - 2 * s2 + s, h11 = s3 - s2;
  const double d01 = (6 * s - 6 * s2) / h, d10 = 3 * s2 - 4 * s + 1, d11 = 3 * s2 - 2 * s;
  const auto n = a.v.size();
  const Vector6 whole = model::LogSE3(model::Inverse(a.root) * b.root);
  state->time_s = t_s;
  state->root =
      a.root * model::ExpSE3(h01 * whole + h * (h10 * a.v.head<6>() + h11 * b.v.head<6>()));
  state->v.head<6>() = d01 * whole + d10 * a.v.head<6>() + d11 * b.v.head<6>();
  state->q = a.q + h01 * (b.q - a.q) + h * (h10 * a.v.tail(n - 6) + h11 * b.v.tail(n - 6));
  state->v.tail(n - 6) = d01 * (b.q - a.q) + d10 * a.v.tail(n - 6) + d11 * b.v.tail(n - 6);
}

void LimitTensions(const std::vector<MotorLimits>& limits, const Eigen::Ref<const VectorX>& before,
                   double dt_s, Eigen::Ref<VectorX> tensions) {
  for (std::size_t i = 0; i < limits.size(); ++i) {
    const auto at = static_cast<Eigen::Index>(i);
    const double most = limits[i].max_rate_n_s * dt_s;
    const double slewed = std::clamp(tensions(at), before(at) - most, before(at) + most);
    tensions(at) = std::clamp(slewed, limits[i].min_tension_n, limits[i].max_tension_n);
  }
}

}  // namespace mantle::controller
