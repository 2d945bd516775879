#pragma once

#include "model/plant.h"

/// Quantities of the whole vehicle, computed from a state on demand.

namespace mantle::model {

struct SolidMotion {
  double mass_kg{0};
  Vector3 centre_m{Vector3::Zero()};
  Vector3 momentum_kg_m_s{Vector3::Zero()};  ///< of the solid, world frame
};
SolidMotion EvaluateSolidMotion(const Plant& plant, const PlantState& state);

/// Momentum of solid and added mass as a world-frame (angular about the world origin, linear)
/// vector; `work` from EvaluateForces. Exact coupling.
Vector6 EvaluateMomentum(const Plant& plant, const PlantState& state, const PlantWork& work);

/// W_o = eta_r^T M_r eta_r_dot with M_r the locked inertia with added mass ([physics.md] 5).
double LockedPower(const Plant& plant, const PlantState& state, const PlantWork& work,
                   const Vector6& root_acceleration);

}  // namespace mantle::model
