#include <fmt/format.h>

#include <chrono>
#include <cstdio>

#include "tools/mantle/build_run.h"
#include "tools/mantle/lcm_bridge.h"
#include "tools/mantle/output_folder.h"
#include "tools/mantle/progress.h"
#include "tools/mantle/scene_options.h"
#include "tools/mantle/shape_telemetry.h"
#include "tools/mantle/standard_output.h"
#include "tools/mantle/static_output.h"
#include "tools/report/page_file.h"

namespace mantle::tools {
namespace {

constexpr const char* kHelp =
    "Equilibrium of a scene whose root is held, under its loads at [statics] time, by load steps "
    "or "
    "arc\nlength, and whether it is stable.\n"
    "Writes summary.json, path.csv, shape.csv and telemetry.lcmlog (docs/outputs.md).\n\n"
    "  mantle static scenes/arm_static.toml --out results/arm\n"
    "  mantle static scenes/mantle_static.toml        # arc length over the fold\n"
    "  mantle static scenes/elastica.toml --set 'arms.rod.points.tip.schedule=2'\n\n"
    "Exit status 0: found. 2: bad input, nothing changed. 3: no equilibrium; what was reached is "
    "in\n"
    "the folder DIR.partial, and DIR is as it was.";

void PrintSummary(const Json& j, const std::filesystem::path& folder) {
  Print("{}: equilibrium at load factor {:.6g}, {} points, {} iterations, residual {:.2e} N\n",
        j["scene"].get<std::string>(), j["load_factor"].get<double>(), j["points"].get<int>(),
        j["iterations"].get<int>(), j["residual_n"].get<double>());
  if (j["unstable_directions"].get<int>() == 0) {
    Print("  stable, by {}\n", j["stability_test"] == "inertia"
                                   ? "the inertia of the stiffness"
                                   : "the eigenvalues of the linearised motion");
  }
  for (const auto& warning : j["warnings"]) {
    Print("  warning: {}\n", warning.get<std::string>());
  }
  for (const auto& [name, tip] : j["tips"].items()) {
    const auto t = tip["position_m"].get<std::vector<double>>();
    Print("  tip of {} at ({:.7g}, {:.7g}, {:.7g}) m\n", name, t[0], t[1], t[2]);
  }
  for (const auto& [name, cable] : j["cables"].items()) {
    Print("  cable {}: {:.6g} m, {:.6g} N\n", name, cable["length_m"].get<double>(),
          cable["tension_n"].get<double>());
  }
  if (!j["volume_m3"].is_null()) {
    const double before = j["volume_m3"]["initial"].get<double>();
    const double after = j["volume_m3"]["final"].get<double>();
    Print("  volume {:.3f} mL, at rest {:.3f} mL\n", 1e6 * after, 1e6 * before);
  }
  if (!j["limit_load_factor"].is_null()) {
    Print("  limit point at load factor {:.6g}\n", j["limit_load_factor"].get<double>());
    for (const auto& [name, load] : j["loads"].items()) {
      Print("    {} = {:.6g} {}\n", name, load["at_limit"].get<double>(),
            load["unit"].get<std::string>());
    }
  }
  Print("  results in {}\n", folder.string());
}

// Held in the earth: a current does not carry it away.
const ShapeTelemetry& EquilibriumShape(const model::StaticsResult& result, ShapeMessages* shapes) {
  model::PlantState state = result.state;
  state.time_s = 0;
  return shapes->Of(state, result.cable_tension_n);
}

int SolveScene(const SceneOptions& options) {
  const scene::Scene scene = options.Load();
  const model::Plant plant = BuildPlant(options, scene);
  DemandHeldRoot(options, scene);
  DemandReportPage(options.report);
  ShapeMessages shapes(plant);
  const std::unique_ptr<LcmLink> log = OpenLcm({});
  ResultFolder folder(options.OutputFolder(scene), kSceneResults);
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
  WriteWhole(folder.partial(), "path.csv", StaticPathCsv(plant, result));
  WriteWhole(folder.partial(), "shape.csv", ShapeCsv(plant, result.state));
  log->StartLog(folder.partial());
  log->Write(EquilibriumShape(result, &shapes));
  log->FinishLog();
  WriteWhole(folder.partial(), "summary.json", Dump(summary));
  if (result.ok) {
    folder.Publish();
  } else {
    Complain("{}: {} at load factor {:.6g}; partial results in {}", scene.name, result.reason,
             result.load_factor, folder.partial().string());
  }
  if (options.json) {
    PrintText(Dump(summary), result.ok ? 0 : kExitCannotContinue);
  } else if (result.ok) {
    PrintSummary(summary, folder.folder());
  }
  ReportBeside(options.report, result.ok ? folder.folder() : folder.partial(),
               options.json || !result.ok);
  return result.ok ? 0 : kExitCannotContinue;
}

}  // namespace

void AddStaticCommand(CLI::App& app, int& exit_status) {
  CLI::App* command = app.add_subcommand("static", kHelp);
  static SceneOptions options;  // lives as long as the parser that points to it
  AddSceneOptions(command, &options);
  AddOutOption(command, &options);
  AddReportOption(command, &options.report);
  command->callback([&exit_status] { exit_status = SolveScene(options); });
}

}  // namespace mantle::tools
