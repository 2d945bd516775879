#include "tools/mantle/build_run.h"

#include <fmt/format.h>

#include "tools/mantle/reduced_run.h"

namespace mantle::tools {

void AddRunChoice(CLI::App* command, RunChoice* choice) {
  command
      ->add_option("--model", choice->model,
                   "full: the plant; reduced: the reduced model of the scene's table [reduced]")
      ->check(CLI::IsMember({"full", "reduced"}));
  command->add_flag("--open-loop", choice->open_loop,
                    "The plant alone, under the schedules of the scene, in spite of its [control]");
}

void DemandTime(const SceneOptions& options, const scene::Scene& scene, const char* command) {
  if (scene.has_time) return;
  throw scene::BadScene(
      fmt::format("{}: time: table is missing: `{}` needs [time] with `duration` > 0 s",
                  options.scene_file, command));
}

void DemandHeldRoot(const SceneOptions& options, const scene::Scene& scene) {
  if (!std::holds_alternative<model::FreeRoot>(scene.robot.root)) return;
  throw scene::BadScene(
      options.scene_file +
      ": robot.root: must be \"clamped\" or a prescribed motion for `mantle static`");
}

std::unique_ptr<model::Simulation> BuildFullRun(const SceneOptions& options,
                                                const scene::Scene& scene,
                                                const model::Plant& plant) {
  return InScene(options, [&] { return std::make_unique<model::Simulation>(plant, scene.run); });
}

std::unique_ptr<loop::ClosedLoop> BuildLoop(const SceneOptions& options, const scene::Scene& scene,
                                            const loop::ClosedLoopOptions& loop_options) {
  return InScene(options, [&] { return std::make_unique<loop::ClosedLoop>(scene, loop_options); });
}

void DemandRunnable(const SceneOptions& options, const scene::Scene& scene,
                    const RunChoice& choice) {
  const model::Plant plant = BuildPlant(options, scene);
  const bool clamped = std::holds_alternative<model::ClampedRoot>(scene.robot.root);
  if (!scene.has_time && (clamped || scene.has_statics)) {
    DemandHeldRoot(options, scene);
    return;
  }
  DemandTime(options, scene, "mantle run");
  if (choice.closed(scene)) {
    BuildLoop(options, scene);
  } else if (choice.reduced()) {
    const auto model = BuildReduced(options, scene);
    BuildSimulation(options, scene, *model);
  } else {
    BuildFullRun(options, scene, plant);
  }
}

}  // namespace mantle::tools
