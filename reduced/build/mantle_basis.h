#pragma once

#include <optional>

#include "model/plant.h"
#include "reduced/mantle.h"

/// @file
/// Shapes of the reduced mantle ([physics.md] 8): profile = reference + Phi s, with Phi the lowest
/// vibration modes of the clamped mantle and static shapes of its actuated strip minus the
/// reference, from the plant's own tangent and equilibria, orthonormal in the plant's mass:
/// Phi^T M Phi = I, so that s has the unit kg^(1/2) m.

namespace mantle::reduced {

/// Throws model::BadRobot (more coordinates than the mesh has, no strip, dependent shapes, no
/// equilibrium at a pressure).
MantleShapes MakeMantleShapes(const model::Plant& plant, const MantleReduction& reduction);

/// Pressure [Pa] at which the static path of the plant's mantle has its first limit point, alone
/// and clamped, loaded on the strip of its actuator (the lowest of several) or, without one, on the
/// whole wall; none where there is no such point up to kCollapseSought times its lobed-buckling
/// pressure.
std::optional<double> CollapsePressure(const model::Plant& plant);

}  // namespace mantle::reduced
