#pragma once

#include "controller/options.h"
#include "controller/trajectory.h"

namespace mantle::controller {

/// An extended Kalman filter of the reduced model (R. E. Kalman, J. Basic Eng. 82, 1960; errors on
/// the state's manifold as in J. Sola, arXiv:1711.02508), with what the model does not foresee as
/// constant disturbances that wander: a bias d of every motor's tension, an acceleration a of a
/// free root in its own frame and, where it is asked for, the velocity c of uniform water in the
/// world.
///
///   x_{k+1} = F(x_k, u + d, c, h) + h a,   d, a, c: random walks,   measured: x, whole, with noise
///   e = (zeta, dq, dv, dd, da, dc):  P <- A P A^T + Q h,  A = [dF/dx  dF/du  h E  dF/dc; 0 1]
///   S = P_xx + R,  K = P_.x S^-1,   e <- K (x measured - x),  P <- P - K P_x.
///
/// States are the earth's: a vehicle that drifts with the water moves, and the water is what moves
/// it.
///
/// The gate: with i the innovation x measured - x, i^T S^-1 i is chi-square distributed with as
/// many degrees of freedom as x has entries (Bar-Shalom, Li, Kirubarajan, Estimation with
/// Applications to Tracking and Navigation, 2001, 5.4). A measurement beyond the distribution's
/// quantile at `gate` standard deviations of a normal one is refused: the filter goes on as if it
/// had not come. The scenes' is generous: S takes for white what lasts in a model's errors, which
/// alone come to twenty. After kMostRefused in turn it is the filter that is wrong: it starts again
/// from the next one, disturbances kept.
///
/// R: the sensors' deviations (bias counted as noise), over a floor of what a reduced state can say
/// of the plant at all. The floor is what makes disturbances right over a pulse, and not from one
/// instant to the next: the filter follows its own mantle, and drifts tell.
class StateFilter {
 public:
  /// `model` must outlive it.
  StateFilter(const ReducedModel& model, const reduced::StepSettings& step,
              const EstimatorOptions& options, const SensorOptions& sensors,
              const std::vector<MotorLimits>& limits);

  void Start(const ReducedState& state);
  /// To time t_s > state().time_s with `tensions` held. A model that cannot be stepped stays where
  /// it is. No allocation.
  void Predict(double t_s, const Eigen::Ref<const VectorX>& tensions);
  /// With a finite measurement of now. False where the gate refuses it. No allocation.
  bool Correct(const ReducedState& measured);

  /// Share of a motor's largest tension that its bias may be.
  static constexpr double kMostBias = 0.5;
  /// Measurements refused in turn before the filter starts again.
  static constexpr int kMostRefused = 10;
  /// Of the last Correct: i^T S^-1 i over the gate's bound; above 1 it is refused.
  double surprise() const { return surprise_; }
  long refused() const { return refused_; }    ///< measurements since Start
  long restarts() const { return restarts_; }  ///< since Start

  const ReducedState& state() const { return state_; }
  /// At most half a motor's largest tension, 0.1 m/s^2 and 2 m/s of each axis; none where it is not
  /// estimated.
  const Disturbance& disturbance() const { return disturbance_; }
  /// Covariance of e. Units: rad, m, coordinates, their rates, N, m/s^2, and m/s where
  /// a current is estimated.
  const Eigen::MatrixXd& covariance() const { return p_; }

 private:
  void Restart(const ReducedState& measured);

  Propagator propagator_;
  int size_, motors_;  ///< of the state's part of e
  int extra_;          ///< of a and c: 3 or 6
  double bound_;       ///< of i^T S^-1 i
  double surprise_{0};
  int refused_in_turn_{0};
  long refused_{0}, restarts_{0};
  ReducedState state_, next_;
  reduced::StepJacobian jacobian_;
  Disturbance disturbance_;
  VectorX most_, error_, innovation_;
  VectorX process_, noise_, start_;  ///< Q per second, R, P at the start: diagonals
  Eigen::MatrixXd p_, f_, moved_, s_, gain_, by_current_;
};

}  // namespace mantle::controller
