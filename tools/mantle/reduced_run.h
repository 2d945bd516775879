#pragma once

#include <memory>
#include <vector>

#include "reduced/build/simulation.h"
#include "tools/mantle/scene_options.h"
#include "tools/mantle/summary.h"

/// Runs of the reduced model for `mantle run --model reduced` and `mantle compare`
/// (docs/reduced.md).

namespace mantle::tools {

/// Builds the reduced model of a scene; what it refuses is reported under the scene's name. Throws
/// scene::BadScene.
std::unique_ptr<reduced::ReducedPlant> BuildReduced(const SceneOptions& options,
                                                    const scene::Scene& scene);

/// At the scene's start, with its settings; refusals as above.
reduced::ReducedSimulation BuildSimulation(const SceneOptions& options, const scene::Scene& scene,
                                           const reduced::ReducedPlant& model);

/// Coordinates, bases, cubature and step: what decides the figures.
Json ReductionSummary(const scene::Scene& scene, const reduced::ReducedPlant& model);

/// `mantle run --model reduced`: summary.json and trajectory.csv as of the plant; what the reduced
/// model does not account (works, balances) is null. Shapes as of RunLog; `shape_every` 0: no log.
/// Returns the exit status.
int RunReducedScene(const SceneOptions& options, int shape_every);

/// Largest and last differences between two runs sampled at the same times. Lengths relative to the
/// body length, the volume relative to the largest change of the plant's, the energy relative to
/// the plant's peak; heading in rad.
Json ReducedErrors(const model::Plant& plant, const std::vector<model::Sample>& full,
                   const std::vector<model::Sample>& reduced);

}  // namespace mantle::tools
