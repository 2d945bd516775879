#pragma once

#include "model/inputs.h"
#include "reduced/step.h"

/// @file
/// Between the earth's frame and the one that drifts with the water. The model is stepped in the
/// latter (reduced_model.h), where loads need no current; everything outside a step is the earth's:
/// sensors, estimates, references, costs, plans, telemetry. Both frames have the same axes. With c
/// the water's velocity, s its way since the frames coincided, R the root's attitude and b = R^T c,
///
///   x_earth = x_water + s,   v_earth = v_water + b   (the root's velocity in its own axes);
///
/// shape and its rates are the same in both.

namespace mantle::reduced {

/// A state that is given in the drifting frame, as the earth sees it.
void ToEarth(const model::WaterMotion& water, ReducedState* state);
/// The inverse of ToEarth.
void ToWater(const model::WaterMotion& water, ReducedState* state);

/// The motion of a root that is held, given in the earth's frame, as uniform steady water of
/// velocity c [m/s, world] sees it: its twist less b, and the rate of that. The pose stays: nothing
/// depends on the place.
void SupportToWater(const Vector3& c_m_s, model::PlantInputs* inputs);

/// TakeStep for states in the earth's frame and steady water of velocity c [m/s, world].
///
/// `first` and `last` give a held root's motion in the earth's frame. The derivatives are those of
/// the earth's states: with d(R^T c) = b^ zeta, (rows and columns of the root alone)
///
///   dv_water = dv_earth - b^ zeta  at the start,  dv_earth = dv_water + b^ zeta  at the end,
///
/// and by c, through the start's velocity (or a held root's twist) and the end's place and
/// velocity. For a held root that turns they take its attitude at the end of the step.
class CurrentStep {
 public:
  explicit CurrentStep(const ReducedModel& model);

  /// As TakeStep. `by_current` (2 velocity_count x 3, or null; needs `jacobian`): d(end state)/dc.
  /// No allocation.
  StepOutcome Take(const StepSettings& settings, double h, const ReducedState& from,
                   const model::PlantInputs& first, const model::PlantInputs& last,
                   const Vector3& c_m_s, StepWork* work, ReducedState* to, StepJacobian* jacobian,
                   Eigen::MatrixXd* by_current);

 private:
  void JacobianToEarth(double h, const ReducedState& from, const ReducedState& to,
                       const Vector3& c_m_s, StepJacobian* jacobian,
                       Eigen::MatrixXd* by_current) const;

  const ReducedModel& model_;
  ReducedState from_;
  model::PlantInputs first_, last_;
};

}  // namespace mantle::reduced
