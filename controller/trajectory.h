#pragma once

#include <vector>

#include "controller/horizon.h"
#include "reduced/water_frame.h"

namespace mantle::controller {

using model::VectorX;
using reduced::ReducedModel;
using reduced::ReducedState;

/// The reduced model rolled along a horizon, with the derivatives of every interval.
///
///   x_{k+1} = F(x_k, u + d, c, h) + h a,   u = (u_k + u_{k+1}) / 2,  h = t_{k+1} - t_k,
///   A_k = dF/dx in (zeta, dq, dv),  B_k = dF/du.
///
/// d and a are constant disturbances, c a uniform steady current, that an estimator finds where the
/// vehicle does otherwise than the model believes. States are the earth's: a step goes through the
/// frame that drifts with c by itself (reduced/water_frame.h).
struct Trajectory {
  Trajectory(const ReducedModel& model, const Horizon& horizon);

  std::vector<ReducedState> states;              ///< N + 1; [0] and its time are given
  Eigen::MatrixXd tensions;                      ///< motors x (N + 1) [N]
  std::vector<reduced::StepJacobian> jacobians;  ///< N
};

/// What the model misses: bias d of every motor's tension, acceleration a of a free root in its own
/// frame (added to its velocity, times the step), velocity c of the water in the world.
struct Disturbance {
  explicit Disturbance(int motors) : bias_n(VectorX::Zero(motors)) {}
  VectorX bias_n;
  model::Vector3 acceleration_m_s2{model::Vector3::Zero()};
  model::Vector3 current_m_s{model::Vector3::Zero()};
};

/// Steps of the reduced model under tensions held over a step; a step that fails is divided.
class Propagator {
 public:
  Propagator(const ReducedModel& model, const reduced::StepSettings& settings);

  /// `tensions`: one per motor. `jacobian` may be null; `by_current` too, else it is d(end)/dc,
  /// 2 velocity_count x 3, and needs the former. No allocation.
  reduced::StepOutcome Step(const ReducedState& from, double h,
                            const Eigen::Ref<const VectorX>& tensions, ReducedState* to,
                            reduced::StepJacobian* jacobian, Eigen::MatrixXd* by_current = nullptr);

  /// From states[0] on.
  reduced::StepOutcome Roll(const Horizon& horizon, bool with_jacobians, Trajectory* trajectory);

  const ReducedModel& model() const { return model_; }
  /// Acts in all steps from now on; none at first.
  void SetDisturbance(const Disturbance& disturbance) { disturbance_ = disturbance; }
  const Disturbance& disturbance() const { return disturbance_; }

 private:
  reduced::StepOutcome Divided(const ReducedState& from, double h, int depth, ReducedState* to,
                               reduced::StepJacobian* jacobian, Eigen::MatrixXd* by_current);
  reduced::StepOutcome Whole(const ReducedState& from, double h, ReducedState* to,
                             reduced::StepJacobian* jacobian, Eigen::MatrixXd* by_current);

  const ReducedModel& model_;
  reduced::StepSettings settings_;
  reduced::StepWork work_;
  reduced::CurrentStep in_current_;
  model::PlantInputs inputs_, last_;
  Disturbance disturbance_;
  VectorX mean_, disturbed_;
  std::vector<ReducedState> middle_;
  std::vector<reduced::StepJacobian> part_;
  Eigen::MatrixXd product_;
  std::vector<Eigen::MatrixXd> part_by_current_;
};

}  // namespace mantle::controller
