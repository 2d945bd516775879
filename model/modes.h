#pragma once

#include <vector>

#include "model/plant.h"

/// @file
/// Vibration modes about a state of rest: (K - omega^2 M) x = 0 with the plant's own tangent and
/// mass, by inverse iteration on a block with Rayleigh-Ritz, in O(N) per sweep. Viscosity and loads
/// that depend on velocity do not enter; constant loads (pressure, weight, tensions at t = 0) do.

namespace mantle::model {

/// One vibration x cos(omega t) about the state of rest, or the growth that takes its place where
/// the stiffness is negative.
struct Mode {
  double angular_frequency_rad_s;  ///< 0 where the state is unstable in this mode
  VectorX shape;                   ///< laid out as v, mass-normalised; sign: largest entry positive
  double growth_rate_1_s{0};       ///< of an unstable one: x grows as exp(growth t)
};

/// The `count` lowest modes, ascending; rigid modes of a free root come first, with frequency zero
/// to round-off. `state` must be an equilibrium: elsewhere the tangent is not symmetric, and only
/// its symmetric part enters. Throws BadRobot if the mesh has fewer or the iteration does not
/// converge.
std::vector<Mode> VibrationModes(const Plant& plant, const PlantState& state, int count);
/// The same under given inputs.
std::vector<Mode> VibrationModes(const Plant& plant, const PlantState& state,
                                 const PlantInputs& inputs, int count);

}  // namespace mantle::model
