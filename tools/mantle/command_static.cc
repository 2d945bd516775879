#include <fmt/format.h>

#include <chrono>
#include <cstdio>

#include "tools/mantle/output_folder.h"
#include "tools/mantle/progress.h"
#include "tools/mantle/scene_options.h"
#include "tools/mantle/static_output.h"

namespace mantle::tools {
namespace {

constexpr const char* kHelp =
    "Equilibrium of a scene whose root is held, under its loads at [statics] time, by load steps "
    "or "
    "arc\nlength, and whether it is stable.\n"
    "Writes summary.json, path.csv and shape.csv (docs/outputs.md).\n\n"
    "  mantle static scenes/arm_static.toml --out results/arm\n"
    "  mantle static scenes/mantle_static.toml        # arc length over the fold\n"
    "  mantle static scenes/elastica.toml --set 'arms.rod.points.tip.schedule=2'\n\n"
    "Exit status 0: found. 2: bad input, nothing written. 3: no equilibrium; what was reached is "
    "kept\n"
    "as *.partial.";

void PrintSummary(const Json& j, const std::filesystem::path& folder) {
  fmt::print("{}: equilibrium at load factor {:.6g}, {} points, {} iterations, residual {:.2e} N\n",
             j["scene"].get<std::string>(), j["load_factor"].get<double>(), j["points"].get<int>(),
             j["iterations"].get<int>(), j["residual_n"].get<double>());
  if (j["unstable_directions"].get<int>() == 0) {
    fmt::print("  stable, by {}\n", j["stability_test"] == "inertia"
                                        ? "the inertia of the stiffness"
                                        : "the eigenvalues of the linearised motion");
  }
  for (const auto& warning : j["warnings"]) {
    fmt::print("  warning: {}\n", warning.get<std::string>());
  }
  for (const auto& [name, tip] : j["tips"].items()) {
    const auto t = tip["position_m"].get<std::vector<double>>();
    fmt::print("  tip of {} at ({:.7g}, {:.7g}, {:.7g}) m\n", name, t[0], t[1], t[2]);
  }
  for (const auto& [name, cable] : j["cables"].items()) {
    fmt::print("  cable {}: {:.6g} m, {:.6g} N\n", name, cable["length_m"].get<double>(),
               cable["tension_n"].get<double>());
  }
  if (!j["volume_m3"].is_null()) {
    const double before = j["volume_m3"]["initial"].get<double>();
    const double after = j["volume_m3"]["final"].get<double>();
    fmt::print("  volume {:.3f} mL, at rest {:.3f} mL\n", 1e6 * after, 1e6 * before);
  }
  if (!j["limit_load_factor"].is_null()) {
    fmt::print("  limit point at load factor {:.6g}\n", j["limit_load_factor"].get<double>());
    for (const auto& [name, load] : j["loads"].items()) {
      fmt::print("    {} = {:.6g} {}\n", name, load["at_limit"].get<double>(),
                 load["unit"].get<std::string>());
    }
  }
  fmt::print("  results in {}\n", folder.string());
}

int SolveScene(const SceneOptions& options) {
  const model::Scene scene = options.Load();
  const model::Plant plant = BuildPlant(options, scene);
  if (std::holds_alternative<model::FreeRoot>(scene.robot.root)) {
    throw model::BadScene(options.scene_file +
                          ": robot.root: must be \"clamped\" or a prescribed motion for `mantle "
                          "static`");
  }
  const std::filesystem::path folder = options.OutputFolder(scene);
  PrepareFolder(folder);
  RemoveOldResults(folder, {"summary.json", "path.csv", "shape.csv"});
  Progress progress(0.0, scene.statics.max_load_factor, "of the load", false);
  const auto begin = std::chrono::steady_clock::now();
  const model::StaticsResult result = InScene(options, [&] {
    return model::SolveStatics(plant, scene.statics, [&](const model::StaticsPoint& p) {
      progress.Update(p.load_factor);
    });
  });
  const double wall_s =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  progress.Finish();
  const Json summary = StaticSummary(scene, plant, result, wall_s, options.overrides);
  OutputFile path(folder, "path.csv", StaticPathCsv(plant, result));
  OutputFile shape(folder, "shape.csv", ShapeCsv(plant, result.state));
  OutputFile file(folder, "summary.json", summary.dump(2) + "\n");
  for (OutputFile* out : {&path, &shape, &file}) {
    if (result.ok) {
      out->Publish();
    } else {
      out->Flush();
    }
  }
  if (options.json) {
    fmt::print("{}\n", summary.dump(2));
  } else if (result.ok) {
    PrintSummary(summary, folder);
  }
  std::fflush(stdout);
  if (result.ok) return 0;
  fmt::print(stderr, "mantle: {}: {}; partial results in {}\n", scene.name, result.reason,
             folder.string());
  return kExitCannotContinue;
}

}  // namespace

void AddStaticCommand(CLI::App& app, int& exit_status) {
  CLI::App* command = app.add_subcommand("static", kHelp);
  static SceneOptions options;  // lives as long as the parser that points to it
  AddSceneOptions(command, &options);
  AddOutOption(command, &options);
  command->callback([&exit_status] { exit_status = SolveScene(options); });
}

}  // namespace mantle::tools
