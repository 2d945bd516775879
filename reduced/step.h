#pragma once

#include <array>

#include "reduced/dense.h"
#include "reduced/reduced_model.h"

/// @file
/// One step of the reduced model, and its exact derivatives.
///
/// Singly diagonally implicit Runge-Kutta in the chart g exp(theta^) of the step's start, as the
/// plant's stepper: with y = (theta, q - q_0), sigma = 1/(gamma h), each stage solves
///
///   R(g_0 exp(theta), q, v, a) = 0,   y_dot = sigma (y - y_known),   v = (Jr(theta) theta_dot,
///   q_dot), a = sigma (v - v_known)
/// for y by Newton's method. SDIRK2 (two stages, order 2) and backward Euler, both L-stable and
/// stiffly accurate. With K, D, M of reduced_model.h, H_g = diag(Jr, I) and H_v = dv/dy the matrix
/// is A = K H_g + (D + sigma M) H_v, and the implicit function theorem at the converged stages
/// gives the derivatives of the end state in the start state (root in body increments: 2 n
/// columns), in the inputs held over the step, and in h.

namespace mantle::reduced {

/// Which scheme a step takes, and how accurately its stages are solved.
struct StepSettings {
  StepScheme scheme{StepScheme::kSdirk2};
  /// Newton stops where the remaining error of an increment is below this: in rad and body lengths
  /// for the root, rad per length and strains times the length for arms, and shares of the
  /// coordinate's scale for the mantle.
  /// Derivatives are taken at that iterate, and their matrix improves the end state once more.
  double tolerance{1e-9};
  int max_iterations{25};  ///< of Newton's method, for one stage
};

/// Whether the step was taken, and if not, why.
struct StepOutcome : model::EvaluationFailure {
  bool ok{true};
  int iterations{0};
};

/// d(end state)/d(...), rows (zeta, q, v) of the end state: zeta in the body frame of its root.
struct StepJacobian {
  explicit StepJacobian(const ReducedModel& model);
  Eigen::MatrixXd state;  ///< 2n x 2n
  Eigen::MatrixXd input;  ///< 2n x inputs
  VectorX step;           ///< by h; inputs are held
  /// 2n x 6, of a held root alone: by a twist that its support has beside the given one all step
  /// long, in its own axes.
  Eigen::MatrixXd support;
};

/// Increments at which the stages of a step ended. Given back for the same step from a nearby state
/// (a plan linearised again), they start its Newton iterations.
struct StepStages {
  explicit StepStages(const ReducedModel& model);
  bool known{false};                 ///< they are those of a step that was solved
  std::array<VectorX, 2> increment;  ///< (theta, q - q_0) of each stage
};

/// Everything a step needs, allocated by the constructor; nothing in it is carried from one step to
/// the next.
class StepWork {
 public:
  explicit StepWork(const ReducedModel& model);

  /// Acceleration v_dot at the end of the last step that succeeded, to the step's tolerance.
  const VectorX& end_acceleration() const { return stages_[end_].acceleration; }

 private:
  friend class StepSolver;
  struct Stage {
    VectorX y, y_known, y_rate, v_known, acceleration;
    ReducedState state;
    Matrix6 jr, jr_rate;        ///< Jr(theta), d(Jr(theta) theta_dot)/d theta
    Panel y_by, rate_by, root;  ///< d(y, y_rate, v of the root)/d(zeta_0, q_0, v_0, u, h)
  };
  std::array<Stage, 2> stages_;
  int end_{0};  // the stage that ended the last step
  ReducedWork evaluation_;
  ReducedJacobians jacobians_;
  Eigen::MatrixXd matrix_, weighted_, left_;
  Panel right_, root_rows_;
  DenseLu lu_;
  VectorX scale_, increment_, last_, norms_;
  Eigen::MatrixXd steps_;  ///< of Broyden's method, scaled
};

/// Advances `from` by h seconds with the inputs at the stages (first stage at gamma h, or all at
/// the end), into `to`; fills `jacobian` where it is not null, for inputs that change equally at
/// both stages. `stages`, where it is not null, starts Newton's iterations if it is known (without
/// it, where that fails), and is overwritten. On failure `to` is not a state, and the stages are
/// not known. No allocation.
StepOutcome TakeStep(const ReducedModel& model, const StepSettings& settings, double h,
                     const ReducedState& from, const model::PlantInputs& first,
                     const model::PlantInputs& last, StepWork* work, ReducedState* to,
                     StepJacobian* jacobian, StepStages* stages = nullptr);

/// Fraction of the step at which the first stage's inputs are taken (the last stage's: 1).
double FirstStageTime(StepScheme scheme);

}  // namespace mantle::reduced
