#pragma once

#include <vector>

#include "controller/stage_cost.h"

namespace mantle::controller {

/// What a plan makes of an error that it cannot take back within its horizon. The stage cost is
/// quadratic: far from a reference its pull outgrows every weight on tensions and rates, and plans
/// chase what the model promises for a tension that alternates from node to node. So in plans the
/// square of an error e of position, tip or velocity becomes
///
///   rho(e) = 2 far^2 (sqrt(1 + |e|^2 / far^2) - 1),
///
/// |e|^2 near by and 2 far |e| far away: the reference pulls as if it were `far` ahead (P. Huber,
/// Ann. Math. Stat. 35, 1964, smooth). Gauss-Newton has it as the weight's factor
/// 1 / sqrt(1 + |e|^2 / far^2), with the exact gradient and a Hessian that bounds rho from above
/// (iteratively reweighted least squares). `far` is a fiftieth of the body's length for the root's
/// place, a tenth for a tip's, for velocities a twentieth per period of the gait. Costs that are
/// reported stay quadratic.
class FarError {
 public:
  /// `cost` must outlive it.
  FarError(const StageCost& cost, const ReducedModel& model);

  /// Weights of the rows at this residual, for Gauss-Newton.
  void Weigh(const VectorX& residual, VectorX* weights) const;
  /// What the stage cost's state part is in a plan.
  double Value(const VectorX& residual) const;
  /// Factor of the mean velocity's weight, and its square's substitute.
  double MeanVelocityFactor(double square) const { return Factor(square, far_m_s_); }
  double MeanVelocity(double square) const { return Rho(square, far_m_s_); }

 private:
  static double Factor(double square, double far);
  static double Rho(double square, double far);

  struct Rows {
    int first, count;
    double far;
  };
  const StageCost& cost_;
  double far_root_m_, far_m_s_;
  std::vector<Rows> rows_;
};

}  // namespace mantle::controller
