#include "tools/mantle/scene_options.h"

namespace mantle::tools {

scene::Scene SceneOptions::Load() const { return scene::LoadScene(scene_file, overrides); }

std::filesystem::path SceneOptions::OutputFolder(const scene::Scene& scene) const {
  return out.empty() ? std::filesystem::path("results") / scene.name : std::filesystem::path(out);
}

void AddSceneOptions(CLI::App* command, SceneOptions* options) {
  command->add_option("SCENE", options->scene_file, "Scene file (docs/scene.md lists its keys)")
      ->required();
  command
      ->add_option(
          "--set", options->overrides,
          "Override a key, as in --set time.step=0.002 or --set 'arms.arm.length=\"40 cm\"'; "
          "may be repeated")
      ->type_name("KEY=VALUE")
      ->expected(1)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
  command->add_flag("--json", options->json,
                    "Machine output: one JSON document on standard output");
}

void AddOutOption(CLI::App* command, SceneOptions* options) {
  command->add_option("--out", options->out, "Folder for the results (default: results/SCENE)")
      ->type_name("DIR");
}

void AddReportOption(CLI::App* command, bool* report) {
  command->add_flag("--report", *report,
                    "Make report.html of the results beside them (mantle report --help)");
}

model::Plant BuildPlant(const SceneOptions& options, const scene::Scene& scene) {
  return InScene(options, [&] { return model::Plant(scene.robot); });
}

}  // namespace mantle::tools
