#pragma once

#include <vector>

#include "controller/horizon.h"
#include "reduced/step.h"

/// The reduced model rolled along a horizon, with the derivatives of every interval.
///
///   x_{k+1} = F(x_k, (u_k + u_{k+1}) / 2 + d, t_{k+1} - t_k),   d: bias of the tensions,
///   A_k = dF/dx in (zeta, dq, dv),  B_k = dF/du.
///
/// A constant acceleration of a free root [m/s^2, its own frame], which an estimator finds where
/// the water pushes otherwise than the model believes, is added to F's velocity, times the step.

namespace mantle::controller {

using model::VectorX;
using reduced::ReducedModel;
using reduced::ReducedState;

struct Trajectory {
  Trajectory(const ReducedModel& model, const Horizon& horizon);

  std::vector<ReducedState> states;              ///< N + 1; [0] and its time are given
  Eigen::MatrixXd tensions;                      ///< motors x (N + 1) [N]
  Eigen::MatrixXd shape;                         ///< of a change of decision, alike [1]
  std::vector<reduced::StepJacobian> jacobians;  ///< N
};

/// Steps of the reduced model under tensions held over a step; a step that fails is divided.
class Propagator {
 public:
  Propagator(const ReducedModel& model, const reduced::StepSettings& settings);

  /// `tensions`: one per motor. `jacobian` may be null. No allocation.
  reduced::StepOutcome Step(const ReducedState& from, double h,
                            const Eigen::Ref<const VectorX>& tensions, ReducedState* to,
                            reduced::StepJacobian* jacobian);

  /// From states[0] on, under `tensions` plus `bias` (one per motor).
  reduced::StepOutcome Roll(const Horizon& horizon, const Eigen::Ref<const VectorX>& bias,
                            bool with_jacobians, Trajectory* trajectory);

  const ReducedModel& model() const { return model_; }
  void SetRootAcceleration(const model::Vector3& a_m_s2) { root_acceleration_m_s2_ = a_m_s2; }
  const model::Vector3& root_acceleration_m_s2() const { return root_acceleration_m_s2_; }

 private:
  reduced::StepOutcome Divided(const ReducedState& from, double h, int depth, ReducedState* to,
                               reduced::StepJacobian* jacobian);

  const ReducedModel& model_;
  reduced::StepSettings settings_;
  reduced::StepWork work_;
  model::PlantInputs inputs_;
  model::Vector3 root_acceleration_m_s2_{model::Vector3::Zero()};
  VectorX mean_;
  std::vector<ReducedState> middle_;
  std::vector<reduced::StepJacobian> part_;
  Eigen::MatrixXd product_;
};

}  // namespace mantle::controller
