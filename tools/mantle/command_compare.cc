#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cstdio>

#include "tools/mantle/build_run.h"
#include "tools/mantle/interrupt.h"
#include "tools/mantle/output_folder.h"
#include "tools/mantle/progress.h"
#include "tools/mantle/reduced_run.h"
#include "tools/mantle/run_log.h"
#include "tools/mantle/standard_output.h"
#include "tools/mantle/trajectory.h"
#include "tools/report/page_file.h"

namespace mantle::tools {
namespace {

constexpr const char* kHelp =
    "Run a scene with the full and the reduced model and compare them (docs/reduced.md).\n\n"
    "  mantle compare scenes/paper.toml --out results\n"
    "  mantle compare scenes/paper.toml --set reduced.segments=3 --set reduced.strains=six\n\n"
    "Writes summary.json (fields reduced_error_*, lengths relative to the body length), full.csv "
    "and\nreduced.csv, full.lcmlog and reduced.lcmlog. Exit status 0: done. 2: bad input. 3: one "
    "of the runs could not go on; what "
    "was\n"
    "reached is in the folder DIR.partial.";

using Clock = std::chrono::steady_clock;
double Since(Clock::time_point begin) {
  return std::chrono::duration<double>(Clock::now() - begin).count();
}

struct Recorded {
  std::vector<model::Sample> samples;
  model::RunResult result;
  double wall_s{0};
};

/// `add` hears of every sample.
template <typename Simulation, typename Add>
Recorded Record(Simulation* simulation, double duration_s, Add add) {
  Recorded out;
  Progress progress(0.0, duration_s, "s", true);
  const auto begin = Clock::now();
  out.result = simulation->Run([&](const model::Sample& sample) {
    progress.Update(sample.time_s);
    out.samples.push_back(sample);
    add(sample);
    return !Interrupted();
  });
  out.wall_s = Since(begin);
  progress.Finish();
  return out;
}

int Compare(const SceneOptions& options) {
  scene::Scene scene = options.Load();
  DemandTime(options, scene, "mantle compare");
  // An output interval shorter than the plant's step would sample each at its own steps.
  scene.run.step_s = std::min(scene.run.step_s, 0.5 * scene.run.output_interval_s);
  const auto small = BuildReduced(options, scene);
  reduced::ReducedSimulation fast = BuildSimulation(options, scene, *small);
  const auto plant = BuildFullRun(options, scene, small->plant);
  DemandReportPage(options.report);
  RunLog fast_log(small->plant, 1, "reduced.lcmlog"), full_log(small->plant, 1, "full.lcmlog");
  CatchInterrupts();
  ResultFolder folder(options.OutputFolder(scene), kSceneResults);
  fast_log.Start(folder.partial());
  full_log.Start(folder.partial());
  const Recorded quick = Record(&fast, scene.run.duration_s, [&](const model::Sample& sample) {
    fast_log.Add(sample, fast.lifted(), nullptr, false);
  });
  const Recorded full = Record(plant.get(), scene.run.duration_s, [&](const model::Sample& sample) {
    full_log.Add(sample, plant->state(), &plant->energy(), false);
  });
  fast_log.Close();
  full_log.Close();

  const bool complete = full.result.ok && quick.result.ok && !Interrupted();
  const std::string reason = complete         ? ""
                             : Interrupted()  ? "interrupted"
                             : full.result.ok ? "reduced model: " + quick.result.reason
                                              : "full model: " + full.result.reason;
  std::vector<std::string> warnings;
  for (const auto& [name, run] : {std::pair{"full model", &full}, {"reduced model", &quick}}) {
    for (const std::string& w : run->result.warnings) {
      warnings.push_back(fmt::format("{}: {}", name, w));
    }
  }
  for (const auto& [name, run] : {std::pair{"full.csv", &full}, std::pair{"reduced.csv", &quick}}) {
    OutputFile file(folder.partial(), name, TrajectoryTitles(small->plant));
    for (const model::Sample& s : run->samples) file.Write(TrajectoryRow(small->plant, s));
    file.Close();
  }
  Json summary;
  summary["scene"] = scene.name;
  summary["complete"] = complete;
  summary["reason"] = reason;
  summary["sim_time_s"] = std::min(full.result.sim_time_s, quick.result.sim_time_s);
  summary["body_length_m"] = small->plant.body_length_m;
  summary.update(ReducedErrors(small->plant, full.samples, quick.samples));
  summary["warnings"] = warnings;
  summary["full"] = {{"wall_time_s", full.wall_s},
                     {"steps", full.result.counters.steps},
                     {"ok", full.result.ok},
                     {"reason", full.result.reason}};
  summary["reduced"] = ReductionSummary(scene, *small);
  summary["reduced"]["wall_time_s"] = quick.wall_s;
  summary["reduced"]["steps"] = quick.result.counters.steps;
  summary["reduced"]["rejected_steps"] = quick.result.counters.rejected;
  summary["reduced"]["ok"] = quick.result.ok;
  summary["reduced"]["reason"] = quick.result.reason;
  WriteWhole(folder.partial(), "summary.json", Dump(summary));
  if (complete) {
    folder.Publish();
  } else {
    Complain("{}: {}; partial results in {}", scene.name, reason, folder.partial().string());
  }
  if (options.json) {
    PrintText(Dump(summary), complete ? 0 : kExitCannotContinue);
  } else if (complete) {
    Print("{}: reduced model with {} states against the full one with {}\n", scene.name,
          2 * small->velocity_count(), 2 * small->plant.velocity_size());
    for (const auto& [key, value] : summary.items()) {
      if (key.rfind("reduced_error_", 0) == 0) Print("  {:40} {:.3e}\n", key, value.get<double>());
    }
    const Json& scales = summary["relative_to"];
    Print(
        "  relative to the body length {:.3g} m, the largest speed {:.3g} m/s, the largest "
        "energy {:.3g} J",
        scales["length_m"].get<double>(), scales["speed_m_s"].get<double>(),
        scales["energy_j"].get<double>());
    if (scales.contains("volume_m3")) {
      Print(", the largest change of volume {:.3g} mL", 1e6 * scales["volume_m3"].get<double>());
    }
    Print("\n");
    Print("  results in {}\n", folder.folder().string());
  }
  ReportBeside(options.report, complete ? folder.folder() : folder.partial(),
               options.json || !complete);
  ComplainOfWarnings(scene.name, warnings);
  return complete ? 0 : kExitCannotContinue;
}

}  // namespace

void AddCompareCommand(CLI::App& app, int& exit_status) {
  CLI::App* command = app.add_subcommand("compare", kHelp);
  static SceneOptions options;
  AddSceneOptions(command, &options);
  AddOutOption(command, &options);
  AddReportOption(command, &options.report);
  command->callback([&exit_status] { exit_status = Compare(options); });
}

}  // namespace mantle::tools
