#pragma once

#include <vector>

#include "controller/trajectory.h"

namespace mantle::controller {

/// What a controller intends: tensions and predicted states over a horizon, with feedback gains for
/// its beginning. Plain values; it stays usable after the controller that made it has failed.
struct Plan {
  std::vector<double> time_s;          ///< of the nodes, absolute
  Eigen::MatrixXd tensions;            ///< motors x nodes [N]
  std::vector<ReducedState> states;    ///< predicted at the nodes
  std::vector<Eigen::MatrixXd> gains;  ///< K_k, motors x 2n [N per unit of (zeta, q, v)]

  bool empty() const { return time_s.empty(); }
  double start_s() const { return time_s.front(); }
  double end_s() const { return time_s.back(); }
};

/// Interval k with t_k <= t < t_{k+1}; the first or last one outside.
int IntervalAt(const Plan& plan, double t_s);

/// Linear between nodes; constant outside.
void TensionsAt(const Plan& plan, double t_s, Eigen::Ref<VectorX> tensions);

/// Cubic between nodes: coordinates and the root's displacement agree with value and rate at both
/// ends (Hermite in the chart of the interval's begin), rates are the cubic's. `state` is sized.
void StateAt(const Plan& plan, double t_s, ReducedState* state);

/// Tensions within bounds, and not further from `before` than the rate allows in dt.
void LimitTensions(const std::vector<MotorLimits>& limits, const Eigen::Ref<const VectorX>& before,
                   double dt_s, Eigen::Ref<VectorX> tensions);

}  // namespace mantle::controller
