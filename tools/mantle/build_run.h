#pragma once

#include <memory>
#include <string>

#include "loop/closed_loop.h"
#include "model/simulation.h"
#include "tools/mantle/scene_options.h"

/// What a run in time needs, built from a scene. `mantle run` and `mantle check` go through the
/// same functions, so that what one refuses the other refuses too. All throw scene::BadScene.

namespace mantle::tools {

/// Which run of a scene.
struct RunChoice {
  std::string model{"full"};  ///< "full" or "reduced"
  bool open_loop{false};      ///< the plant alone, in spite of the scene's [control]

  bool reduced() const { return model == "reduced"; }
  bool closed(const scene::Scene& scene) const {
    return !reduced() && !open_loop && scene.control.has_value();
  }
};

/// Options --model and --open-loop.
void AddRunChoice(CLI::App* command, RunChoice* choice);

/// Refuses a scene without [time]; `command` ("mantle run") stands in the message.
void DemandTime(const SceneOptions& options, const scene::Scene& scene, const char* command);

/// Refuses a root that is free.
void DemandHeldRoot(const SceneOptions& options, const scene::Scene& scene);

/// The plant at the scene's start.
std::unique_ptr<model::Simulation> BuildFullRun(const SceneOptions& options,
                                                const scene::Scene& scene,
                                                const model::Plant& plant);

/// The closed loop, its buses open.
std::unique_ptr<loop::ClosedLoop> BuildLoop(const SceneOptions& options, const scene::Scene& scene,
                                            const loop::ClosedLoopOptions& loop_options = {});

/// Builds what `mantle run` with `choice` (or `mantle static`, for a scene without [time]) would
/// begin with, and drops it.
void DemandRunnable(const SceneOptions& options, const scene::Scene& scene,
                    const RunChoice& choice);

}  // namespace mantle::tools
