#pragma once

#include "model/plant.h"

/// Quantities of the whole vehicle in the earth's frame, computed from a state on demand.

namespace mantle::model {

struct SolidMotion {
  double mass_kg{0};
  Vector3 centre_m{Vector3::Zero()};
  Vector3 momentum_kg_m_s{Vector3::Zero()};  ///< of the solid
};
SolidMotion EvaluateSolidMotion(const Plant& plant, const PlantState& state, const PlantWork& work);

/// Momentum of solid and added mass as an (angular about the earth's origin, linear) vector; `work`
/// from EvaluateForces. The added mass counts with its velocity through the water: its impulse, the
/// part of the water's momentum that the vehicle has given it. Exact coupling.
Vector6 EvaluateMomentum(const Plant& plant, const PlantState& state, const PlantWork& work);

/// W_o = eta_r^T M_r eta_r_dot with M_r the locked inertia with added mass ([physics.md] 5), of the
/// motion through the water: `root_acceleration` is the rate of that twist.
double LockedPower(const Plant& plant, const PlantState& state, const PlantWork& work,
                   const Vector6& root_acceleration);

}  // namespace mantle::model
