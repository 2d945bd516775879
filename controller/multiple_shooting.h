#pragma once

#include "controller/condensed.h"

namespace mantle::controller {

/// The same optimal control problem as condensed.h, not condensed and not linearised: decisions are
/// w and every node's state, and the dynamics are constraints (multiple shooting; Bock & Plitt,
/// 1984). Large and sparse; the reference for the condensed form, and for offline plans.
///
///   x_k = xbar_k (+) xi_k,   0 = (F(x_k, u_k(w)) (-) xbar_{k+1}) - xi_{k+1},   k = 0 .. N-1, xi_0
///   = 0
///
/// with (+), (-) the chart of outputs.h about a base trajectory. The Hessian is Gauss-Newton's, the
/// other derivatives are exact. Costs on the mean velocity couple distant nodes and are not taken.
class MultipleShooting : public Program {
 public:
  /// `condensed` has been prepared at `base`: its linear rows bound tensions and rates. All must
  /// outlive it. Throws std::invalid_argument where the cost has a mean velocity.
  MultipleShooting(const Horizon& horizon, const Trajectory& base, Condensed* condensed,
                   StageCost* cost, Propagator* propagator);

  int decisions() const { return decisions_; }  ///< of them w, the first variables

  int variables() const override { return decisions_ + horizon_.steps() * size_; }
  int constraints() const override { return horizon_.steps() * size_ + condensed_.constraints(); }
  void Bounds(double* x_low, double* x_high, double* g_low, double* g_high) const override;
  void Start(double* x) const override { std::fill_n(x, variables(), 0.0); }
  const SparsePattern& JacobianPattern() const override { return jacobian_pattern_; }
  const SparsePattern& HessianPattern() const override { return hessian_pattern_; }
  bool quadratic() const override { return false; }
  bool Objective(const double* x, bool fresh, double* f) override;
  bool Gradient(const double* x, bool fresh, double* gradient) override;
  bool Constraints(const double* x, bool fresh, double* g) override;
  bool Jacobian(const double* x, bool fresh, double* values) override;
  bool Hessian(const double* x, bool fresh, double objective_factor, const double* lambda,
               double* values) override;

 private:
  /// States, their residuals and (on demand) the steps and derivatives at x.
  bool Move(const double* x, bool fresh);
  bool RollNodes();
  int StateAt(int k) const { return decisions_ + (k - 1) * size_; }  ///< of xi_k, k >= 1
  /// Decisions that move the tensions of interval k.
  std::vector<int> MovedBy(int k) const;

  const Horizon& horizon_;
  const Trajectory& base_;
  Condensed& condensed_;
  StageCost& cost_;
  Propagator& propagator_;
  int decisions_, size_, motors_;
  SparsePattern jacobian_pattern_, hessian_pattern_;
  Eigen::MatrixXd input_hessian_;
  VectorX input_gradient_;
  Trajectory now_;                     ///< nodes' states, tensions; Jacobians of their steps
  std::vector<ReducedState> stepped_;  ///< F(x_k, u_k)
  std::vector<VectorX> residuals_;
  std::vector<Eigen::MatrixXd> rows_;  ///< d residual / d xi_k
  VectorX x_, difference_, mean_, weights_;
  bool moved_{false}, rolled_{false};
};

}  // namespace mantle::controller
