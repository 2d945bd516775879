#pragma once

#include "controller/options.h"
#include "controller/trajectory.h"

namespace mantle::controller {

/// An extended Kalman filter of the reduced model (R. E. Kalman, J. Basic Eng. 82, 1960; errors on
/// the state's manifold as in J. Sola, arXiv:1711.02508), with what the model does not foresee as
/// constant disturbances that wander: a bias d of every motor's tension, and an acceleration a of a
/// free root in its own frame.
///
///   x_{k+1} = F(x_k, u + d, h) + h a,     d, a: random walks,     measured: x, whole, with noise
///   e = (zeta, dq, dv, dd, da):   P <- A P A^T + Q h,   A = [dF/dx  dF/du  h E; 0 1]
///   S = P_xx + R,  K = P_.x S^-1,   e <- K (x measured - x),  P <- P - K P_x.
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
  /// With a finite measurement of now. No allocation.
  void Correct(const ReducedState& measured);

  const ReducedState& state() const { return state_; }
  /// At most half a motor's largest tension and 0.1 m/s^2; none where it is not estimated.
  const Disturbance& disturbance() const { return disturbance_; }
  /// Covariance of e. Units: rad, m, coordinates, their rates, N, m/s^2.
  const Eigen::MatrixXd& covariance() const { return p_; }

 private:
  Propagator propagator_;
  int size_, motors_;  ///< of the state's part of e
  ReducedState state_, next_;
  reduced::StepJacobian jacobian_;
  Disturbance disturbance_;
  VectorX most_, error_, innovation_;
  VectorX process_, noise_, start_;  ///< Q per second, R, P at the start: diagonals
  Eigen::MatrixXd p_, f_, moved_, s_, gain_;
};

}  // namespace mantle::controller
