#pragma once

#include "controller/position_history.h"
#include "controller/program.h"
#include "controller/stage_cost.h"
#include "controller/trajectory.h"

namespace mantle::controller {

/// The optimal control problem about a trajectory, condensed onto the decisions w.
///
///   delta x_{k+1} = A_k delta x_k + B_k (E_k + E_{k+1}) / 2 w
///   delta x_k = Phi_k delta x_0 + G_k w
///   J ~ sum_k h_k |r_k + C_k delta x_k|^2_D + effort + rate + levenberg sum_j L_j w_j^2
///     = w^T H w / 2 + (g + F delta x_0)^T w + const,     L_j: integral of the hat of w_j
///
/// (Gauss-Newton; Bock & Plitt, 1984; Diehl et al., real-time iteration, 2002), subject to bounds
/// of every node's tension and of every interval's slope. Within a block between knots the change
/// is linear in time, so one row per decision bounds all its slopes. Rows that the bounds of
/// w leave no room to break by more than kSlack_n are left out, as the plan is clipped to its
/// limits anyway; this halves the program.
///
/// Gains: for the problem that begins at node k, with what is decided before it fixed,
/// K_k = d u_{k+1} / d x_k from its KKT system with the constraints that are active. The rows of
/// its gradient obey M_{k-1} = (M_k + Y_k) A_{k-1}, Y_k = sum of S^T D C of the residuals at node k
/// with S = C G.
class Condensed : public Program {
 public:
  Condensed(const ReducedModel& model, const Horizon& horizon, StageCost* cost,
            const ControlOptions& options);

  /// Linearises and condenses about `trajectory`, whose Jacobians are filled. `levenberg` as in
  /// ControlOptions. No allocation.
  void Prepare(const Trajectory& trajectory, const PositionHistory& history, double levenberg);
  /// The problem for an initial state moved by delta x_0: the gradient. No allocation.
  void SetInitialDeviation(const Eigen::Ref<const VectorX>& deviation);

  /// Cost of a trajectory (rolled, not linearised), as the problem sees it.
  double Cost(const Trajectory& trajectory, const PositionHistory& history);

  /// Adds the cost of tensions and their rates as a function of w: exact, a quadratic.
  void AddInputCost(const Trajectory& trajectory, Eigen::MatrixXd* hessian,
                    VectorX* gradient) const;
  /// Weight of node k's stage cost in the sum over the horizon [s].
  double StageWeight(int k) const;

  /// Quadratic model's value at w, relative to w = 0.
  double Model(const Eigen::Ref<const VectorX>& w) const {
    return 0.5 * w.dot(hessian_ * w) + gradient_.dot(w);
  }
  /// Largest amount by which w breaks a bound or a rate [N].
  double Violation(const Eigen::Ref<const VectorX>& w) const;

  /// K_0 ... K_{count-1} into `gains` (motors x 2n each) at the solution w. Allocates nothing
  /// after the first call.
  void Gains(const Eigen::Ref<const VectorX>& w, int count, std::vector<Eigen::MatrixXd>* gains);

  const Eigen::MatrixXd& hessian() const { return hessian_; }
  const VectorX& gradient() const { return gradient_; }
  const VectorX& residual(int k) const { return residuals_[k]; }
  const Eigen::MatrixXd& jacobian(int k) const { return jacobians_[k]; }
  const VectorX& low() const { return low_; }
  const VectorX& high() const { return high_; }

  // Program: the quadratic program in w.
  int variables() const override { return static_cast<int>(gradient_.size()); }
  int constraints() const override { return static_cast<int>(used_.size()); }
  void Bounds(double* x_low, double* x_high, double* g_low, double* g_high) const override;
  void Start(double* x) const override;
  const SparsePattern& JacobianPattern() const override { return jacobian_pattern_; }
  const SparsePattern& HessianPattern() const override { return hessian_pattern_; }
  bool quadratic() const override { return true; }
  bool Objective(const double* x, bool fresh, double* f) override;
  bool Gradient(const double* x, bool fresh, double* gradient) override;
  bool Constraints(const double* x, bool fresh, double* g) override;
  bool Jacobian(const double* x, bool fresh, double* values) override;
  bool Hessian(const double* x, bool fresh, double objective_factor, const double* lambda,
               double* values) override;

 private:
  static constexpr int kMostGains = 6;
  /// One linear row of the program: a node between two knots, or the slope from one to the next.
  struct Row {
    int count{0};
    std::array<int, 2> at{};
    std::array<double, 2> by{};
    double low{-kInfinity}, high{kInfinity};

    double Value(const Eigen::Ref<const VectorX>& w) const {
      double value = 0;
      for (int i = 0; i < count; ++i) value += by[i] * w(at[i]);
      return value;
    }
    void Add(int decision, double factor);
  };
  /// What node k of a motor moves by: row += factor (its hats).
  void AddNode(int k, int motor, double factor, Row* row) const;
  void MakeRows();
  void ChooseRows();
  void BoundRows(const Trajectory& trajectory);
  void AddMeanVelocity(const Trajectory& trajectory, const PositionHistory& history);
  /// Node and share before t_k - T: p(t_k - T) = (1 - share) p_node + share p_{node + 1}, or -1.
  int AveragingNode(int k, double* share) const;

  const ReducedModel& model_;
  const Horizon& horizon_;
  StageCost& cost_;
  const ControlOptions& options_;
  int motors_, columns_;
  Eigen::MatrixXd hessian_, sensitivity_;  ///< H, F (decisions x 2n)
  VectorX gradient_, base_gradient_, low_, high_;
  std::vector<Row> rows_;
  std::vector<int> used_;          ///< of rows_, in the program
  std::vector<int> free_, place_;  ///< of Gains
  SparsePattern jacobian_pattern_, hessian_pattern_;
  std::vector<VectorX> residuals_;
  std::vector<Eigen::MatrixXd> jacobians_, projected_, positions_, adjoint_, tail_;
  Eigen::MatrixXd g_, next_, weighted_, moved_;
  Eigen::MatrixXd kkt_, kkt_rhs_;
};

}  // namespace mantle::controller
