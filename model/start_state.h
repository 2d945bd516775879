#pragma once

#include "model/statics.h"

/// Where a run starts, for the plant and, projected, for the reduced model.
///
/// Shape: at rest (InitialState), the equilibrium under all loads at t = 0 (the root held), or what
/// the arms' initial strains say. Velocities: with the root as one rigid body, plus the arms'
/// initial twists and modes, each relative to the root.

namespace mantle::model {

/// `statics` are the settings of a start from an equilibrium, taken at t = 0 and the full load
/// whatever they say of both. Throws BadRobot, also where there is no equilibrium to start from.
PlantState StartState(const Plant& plant, const StaticsSettings& statics = {});

}  // namespace mantle::model
