#pragma once

#include "controller/far_error.h"
#include "controller/position_history.h"
#include "controller/program.h"
#include "controller/stage_cost.h"
#include "controller/trajectory.h"

namespace mantle::controller {

/// The optimal control problem about a trajectory, condensed onto the decisions w.
///
///   delta x_{k+1} = A_k delta x_k + B_k (E_k + E_{k+1}) / 2 w
///   delta x_k = Phi_k delta x_0 + G_k w
///   J ~ sum_k h_k |r_k + C_k delta x_k|^2_{D_k} + effort + rate + levenberg s sum_j L_j w_j^2
///     = w^T H w / 2 + (g + F_0 delta x_0)^T w + const,   L_j: integral of the hat of w_j,
///   s = trace(H) / (2 sum_j L_j) without damping
///
/// with weights D_k that fall where the error is far (controller/far_error.h); Gauss-Newton (Bock &
/// Plitt, 1984; Diehl et al., real-time iteration, 2002), subject to bounds of every node's tension
/// and of every interval's slope. Within a block between knots the change is linear in time, so one
/// row per decision bounds all its slopes. Rows that the bounds of w leave no room to break are
/// left out.
///
/// Gains: for the problem that begins at node k, with what is decided before it fixed,
/// K_k = d u_{k+1} / d x_k = -P_k F_k, P_k = E_{k+1} H^-1 with the constraints that are active held
/// and F_k the gradient's derivative in x_k: the sum over nodes i >= k of (D C_i G_i)^T C_i A_{i-1}
/// ... A_k. F is never formed (it has a row for every decision): delta x_0 goes forward through
/// A_i, the few rows of P_k backward, B_{i-1} = (B_i + P_k (D C_i G_i)^T C_i) A_{i-1}.
class Condensed : public Program {
 public:
  Condensed(const ReducedModel& model, const Horizon& horizon, StageCost* cost,
            const ControlOptions& options);

  /// Linearises and condenses about `trajectory`, whose Jacobians are filled. `levenberg` is a
  /// share of curvature(). The trajectory must outlive what follows. No allocation.
  void Prepare(const Trajectory& trajectory, const PositionHistory& history, double levenberg);
  /// Mean curvature of the cost along decisions, per time integral of their squares: trace(H) /
  /// (2 sum_j L_j) without damping [1/(N^2 s) times the cost's unit].
  double curvature() const { return curvature_; }
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

  /// K_0 ... K_{count-1} into `gains` (motors x 2n each) at the solution w, whose multipliers are
  /// those of `solution`: they tell what stays at its bound when the state moves. Allocates nothing
  /// after the first call.
  void Gains(const Eigen::Ref<const VectorX>& w, const SolveResult& solution, int count,
             std::vector<Eigen::MatrixXd>* gains);

  const Eigen::MatrixXd& hessian() const { return hessian_; }
  const VectorX& gradient() const { return gradient_; }
  const VectorX& residual(int k) const { return residuals_[k]; }
  const Eigen::MatrixXd& jacobian(int k) const { return jacobians_[k]; }
  /// Of the residuals at node k, and of its mean velocity: near the reference the scene's.
  const VectorX& weights(int k) const { return weights_[k]; }
  double mean_velocity_weight(int k) const { return mean_velocity_weights_[k]; }
  const FarError& far_error() const { return far_; }
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
  /// Whether a multiplier moves w by more than the distance from its bound [N]; give: w per
  /// multiplier.
  static bool Holds(double multiplier, double give, double distance_n) {
    return multiplier * give > std::abs(distance_n);
  }
  void AddMeanVelocity(const Trajectory& trajectory, const PositionHistory& history);
  /// Rows of P_k, of every motor, into gain_rows_: full width, zero where decided before.
  /// False where the cost leaves tensions open.
  bool GainRows(const Eigen::Ref<const VectorX>& w, const SolveResult& solution, int k);
  /// What the mean velocity adds to the first `rows` rows of B at node i, all nodes after it done.
  void AddMeanGain(int i, Eigen::Index rows);
  /// Node and share before t_k - T: p(t_k - T) = (1 - share) p_node + share p_{node + 1}, or -1.
  int AveragingNode(int k, double* share) const;

  const ReducedModel& model_;
  const Horizon& horizon_;
  StageCost& cost_;
  const ControlOptions& options_;
  int motors_, columns_;
  Eigen::MatrixXd hessian_;
  const Trajectory* trajectory_{nullptr};
  VectorX gradient_, base_gradient_, low_, high_;
  std::vector<Row> rows_;
  std::vector<int> used_;          ///< of rows_, in the program
  std::vector<int> free_, place_;  ///< of Gains
  SparsePattern jacobian_pattern_, hessian_pattern_;
  FarError far_;
  std::vector<VectorX> residuals_, weights_;
  std::vector<double> mean_velocity_weights_;
  /// C_k, 2 w_k D_k C_k G_k, and of the mean velocity: positions' and residual's derivatives in w.
  std::vector<Eigen::MatrixXd> jacobians_, weighted_, positions_, mean_rows_;
  Eigen::MatrixXd g_, next_, projected_;
  Eigen::MatrixXd kkt_, kkt_rhs_;
  VectorX moved_, moved_next_, seen_;                       ///< of SetInitialDeviation
  Eigen::Matrix3Xd displaced_;                              ///< of the root at the nodes
  Eigen::MatrixXd gain_rows_, back_, back_next_, through_;  ///< P_0, P_1, ... ; B alike
  std::vector<Eigen::MatrixXd> back_mean_;                  ///< of the mean velocity, at the nodes
  double curvature_{0};
};

}  // namespace mantle::controller
