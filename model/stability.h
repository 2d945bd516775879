#pragma once

#include <string>
#include <vector>

#include "model/plant.h"

/// @file
/// Stability of an equilibrium. Where every load has a potential the tangent is symmetric, and the
/// unstable directions are its negative eigenvalues, counted by the inertia of the block
/// factorisation. Where loads follow the body, or depend on its attitude as drag in a current does,
/// the tangent is not symmetric and that count says nothing (a follower load flutters without any
/// singular tangent): there the growing motions are counted among the eigenvalues of the linearised
/// motion (V. V. Bolotin, Nonconservative Problems of the Theory of Elastic Stability, 1963).

namespace mantle::model {

class StaticNewton;
class StaticProblem;

enum class StabilityTest { kInertia, kLinearisedMotion };
const char* ToString(StabilityTest test);  ///< "inertia", "linearised motion"

/// Whether an equilibrium is stable, and by which test.
struct Stability {
  StabilityTest test{StabilityTest::kInertia};
  /// Directions in which the potential falls, or growing motions (a flutter counts twice); -1 where
  /// it could not be told.
  int unstable_directions{0};
  double growth_rate_1_s{0};  ///< linearised motion: largest real part, where positive
  double frequency_hz{0};     ///< and that motion's frequency: 0 divergence, > 0 flutter
};

/// Names, with the reason, of loads at these inputs that have no potential; empty: conservative.
std::vector<std::string> LoadsWithoutPotential(const Plant& plant, const PlantInputs& inputs);

/// Of the equilibrium where `newton` stands.
Stability JudgeStability(const StaticProblem& problem, bool conservative, StaticNewton* newton);

/// Leaves an unstable equilibrium of conservative loads: along its fastest growing mode, then
/// downhill as a robot in a very viscous fluid would go (implicit steps of M zeta' = rate f), until
/// Newton finds the stable equilibrium there. On success `newton` stands on it; otherwise it stays.
bool LeaveUnstableBranch(const StaticProblem& problem, StaticNewton* newton);

}  // namespace mantle::model
