#pragma once

#include <string>
#include <vector>

#include "loop/scene/scene.h"
#include "reduced/reduced_model.h"

namespace mantle::tools {

/// What a closed loop's scene asks for that cannot be meant, each with its figures: weights that
/// are all zero, weights that the goal does not look at, a path with a cusp or tighter than the
/// vehicle turns, a reference that starts far from the vehicle, a horizon shorter than a pulse.
///
/// How tightly it turns is measured: the reduced model swims the scene's gait with one steering
/// motor after the other at its upper limit, for kTurnTime_s; its radius is the way over the turn
/// of its heading in the second half. About half a second of computing. `scene` has a table
/// [control].
std::vector<std::string> ControlWarnings(const scene::Scene& scene,
                                         const reduced::ReducedModel& model);

/// See ControlWarnings; infinite where no motor steers, the root is held, or the model cannot go
/// on.
double TightestTurn(const scene::Scene& scene, const reduced::ReducedModel& model);

}  // namespace mantle::tools
