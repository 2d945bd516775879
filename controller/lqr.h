#pragma once

#include <Eigen/Core>

#include "controller/steering.h"
#include "controller/trajectory.h"

/// @file
/// The linear-quadratic regulator of the steering, on the reduced model linearised about a straight
/// cruise (or about rest where the root is held).
///
/// Inputs are the two pulls c of the lateral plane (steering.h), which move the step as
/// B_c c = (1/2) sum_i B_i n_i^T c, and their rates w, so that the cost's weight on rates counts:
///
///   x+ = A x + B_c (c + h w / 2),   c+ = c + h w,
///   minimise  sum h [ x^T C^T D C x + f (effort c^T E c + rate w^T E w) ]
/// with C, D the stage cost's own residuals (Gauss-Newton; the mean velocity's weight acts on the
/// velocity), f the parameter lqr_effort, A and B one step of a control period. The gain follows
/// from the discrete-time Riccati equation.

namespace mantle::controller {

/// Gain of u = -K x and value of the cost x^T P x.
struct Riccati {
  Eigen::MatrixXd gain, value;
  double change{0};  ///< of the gain in the last doubling, relative
};

/// min sum of x^T Q x + u^T R u, x+ = A x + B u, over 2^doublings steps, by structure-preserving
/// doubling (Chu, Fan, Lin and Wang, 2004):
///
///   W = I + G H,  A' = A W^-1 A,  G' = G + A W^-1 G A^T,  H' = H + A^T H W^-1 A
/// from A, G = B R^-1 B^T, H = Q; H is the value after 1, 2, 4 ... steps. A finite count, since
/// modes that are neither controllable nor damped (roll, the way along the track) make the value
/// grow for ever; the gain settles all the same.
Riccati SolveRiccati(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b, const Eigen::MatrixXd& q,
                     const Eigen::MatrixXd& r, int doublings);

/// The linear model, its cost and what holds it away from straight. States are rows of
/// (zeta, dq, dv); those of a held root are left out.
struct SteeringModel {
  double period_s{0};
  int first{0};  ///< of every half (pose, velocity) that is kept: 0, or 6 where the root is held
  Eigen::MatrixXd a, b;  ///< of (x, c) and w
  Eigen::MatrixXd q, r;
  /// Steady state (x, c) per unit of what the reference asks for: the turn rate of e3 [rad/s], or
  /// the tip's way [m], lateral.
  Eigen::MatrixXd steady;

  int half(int velocity_count) const { return velocity_count - first; }
};

/// Throws model::BadRobot where the nominal step fails. `directions` as in PullDirections.
SteeringModel LineariseSteering(const ReducedModel& model, const reduced::StepSettings& step,
                                const ControlOptions& options, const Reference& reference,
                                const Eigen::Matrix2Xd& directions, double effort_factor);

/// The regulator at work: pulls for a state and a reference.
class SteeringRegulator {
 public:
  /// All must outlive it. Throws as LineariseSteering.
  SteeringRegulator(const ReducedModel& model, const reduced::StepSettings& step,
                    const ControlOptions& options, const Reference& reference,
                    const Eigen::Matrix2Xd& directions, const BaselineGains& gains);

  void Start();
  /// Pull [N] after another dt_s; the motors' bias is pulled against, and the root's velocity is
  /// the one through the water that drifts with the disturbance's current; `most_n` is the largest
  /// pull. No allocation.
  Vector2 Update(const ReducedState& state, double dt_s, const Disturbance& disturbance,
                 double most_n);

  const SteeringModel& linear() const { return linear_; }
  const Riccati& riccati() const { return riccati_; }

 private:
  /// The state that the reference asks for, ahead of the given one, and its steady pull.
  Vector2 Target(const ReducedState& state);
  Vector2 PathTarget(const ReducedState& state);
  Vector2 TipTarget(const ReducedState& state);
  void SetSteady(const Vector2& demand, const ReducedState& state);

  const ReducedModel& model_;
  const Reference& reference_;
  BaselineGains gains_;
  Eigen::Matrix2Xd directions_;
  Eigen::Matrix2d bias_to_pull_;
  Aim aim_;
  SteeringModel linear_;
  Riccati riccati_;
  ReducedState target_;
  VectorX difference_, kept_, steady_;
  Vector2 pull_{Vector2::Zero()}, held_{Vector2::Zero()};
  double most_offset_m_{0};
  bool fresh_{true};
};

}  // namespace mantle::controller
