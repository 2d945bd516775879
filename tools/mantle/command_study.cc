#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <limits>

#include "tools/mantle/build_run.h"
#include "tools/mantle/control_summary.h"
#include "tools/mantle/interrupt.h"
#include "tools/mantle/output_folder.h"
#include "tools/mantle/progress.h"
#include "tools/mantle/scene_options.h"
#include "tools/mantle/standard_output.h"
#include "tools/mantle/study_run.h"
#include "tools/report/page_file.h"

namespace mantle::tools {
namespace {

constexpr const char* kHelp =
    "Studies: many runs side by side, as a table and as JSON.\n\n"
    "  mantle study accuracy scenes/paper.toml --out results/price\n"
    "  mantle study control scenes/steer.toml scenes/steer_mismatch.toml --out results/study\n"
    "  mantle study control scenes/reach.toml --controllers mpc,pursuit --set time.duration=6";
constexpr const char* kControlHelp =
    "Every controller on every scene, on the full plant through the drives: cost (the integral of\n"
    "the scene's stage cost over the true states), errors, effort, energetic index, times of the\n"
    "solver, misses, limits touched. `converged` is the MPC solved until its plan stands still.\n"
    "The last column is the cost over that of the best baseline of the scene.";

const std::vector<std::string> kControllers = {"mpc", "converged", "gait", "pursuit", "pid", "lqr"};

struct StudyOptions {
  std::vector<std::string> scenes, overrides;
  std::vector<std::string> controllers = {"mpc", "gait", "pursuit", "pid", "lqr"};
  std::string out{"results/study"};
  bool json{false}, report{false};
};

bool IsBaseline(const std::string& controller) {
  return controller != "mpc" && controller != "converged";
}

Json RunOne(const std::string& file, const std::string& controller, const StudyOptions& options) {
  SceneOptions scene_options;
  scene_options.scene_file = file;
  scene_options.overrides = options.overrides;
  scene::Scene scene = scene_options.Load();
  loop::ClosedLoopOptions run;
  run.controller = controller == "converged" ? "mpc" : controller;
  if (controller == "converged" && scene.control) {
    scene.control->mode = controller::MpcMode::kConverged;
  }
  auto loop = BuildLoop(scene_options, scene, run);
  Progress progress(0.0, scene.run.duration_s, "s of " + controller + " on " + scene.name, true);
  const loop::LoopResult result = loop->Run([&](const loop::LoopStep& step) {
    progress.Update(step.time_s);
    return !Interrupted();
  });
  progress.Finish();
  Json j = ControlSummary({&scene, loop.get(), &result, *run.controller, scene.drives.bus});
  j["controller"] = controller;
  j["scene"] = scene.name;
  j["ok"] = result.ok && !Interrupted();
  j["reason"] = result.reason;
  j["sim_time_s"] = result.time_s;
  j["wall_time_s"] = result.wall_s;
  return j;
}

// Refuses a scene before anything is run or written.
void CheckScene(const std::string& file, const StudyOptions& options) {
  SceneOptions scene_options;
  scene_options.scene_file = file;
  scene_options.overrides = options.overrides;
  const scene::Scene scene = scene_options.Load();
  loop::ClosedLoopOptions run;
  run.controller = ToString(controller::ControllerKind::kGait);
  InScene(scene_options, [&] { return std::make_unique<loop::ClosedLoop>(scene, run); });
}

// Lowest cost of a baseline that ran to its end; infinite where none did.
double BestBaseline(const Json& runs, const std::string& scene) {
  double best = std::numeric_limits<double>::infinity();
  for (const Json& run : runs) {
    if (run["scene"] == scene && run["ok"].get<bool>() &&
        IsBaseline(run["controller"].get<std::string>())) {
      best = std::min(best, run["cost"].get<double>());
    }
  }
  return best;
}

std::string Milliseconds(const Json& run, const char* quantile) {
  if (!run.contains("solver") || run["solver"].is_null()) return "-";
  return fmt::format("{:.2f}", run["solver"]["step_ms"][quantile].get<double>());
}

void PrintTable(const Json& runs) {
  Print("{:20} {:10} {:>10} {:>9} {:>9} {:>9} {:>9} {:>7} {:>8} {:>8} {:>9} {:>7} {:>7}\n", "scene",
        "controller", "cost", "mean err", "max err", "final", "effort", "index", "med ms", "p99 ms",
        "fallbacks", "limits", "ratio");
  for (const Json& run : runs) {
    const auto text = [](const Json& value, int digits) {
      return value.is_number() ? fmt::format("{:.{}f}", value.get<double>(), digits) : "-";
    };
    const auto number = [&](const char* key, int digits) { return text(run[key], digits); };
    const auto error = [&](const char* key) { return text(run["error"][key], 4); };
    const bool solver = run.contains("solver") && !run["solver"].is_null();
    Print("{:20} {:10} {:>10} {:>9} {:>9} {:>9} {:>9} {:>7} {:>8} {:>8} {:>9} {:>7} {:>7}{}\n",
          run["scene"].get<std::string>(), run["controller"].get<std::string>(), number("cost", 4),
          error("mean"), error("max"), error("final"), number("effort_n2_s", 3),
          number("energetic_index", 3), Milliseconds(run, "median"), Milliseconds(run, "p99"),
          solver ? run["solver"]["fallbacks"].dump() : "-", run["limit_touches"].dump(),
          number("cost_over_best_baseline", 2),
          run["ok"].get<bool>() ? "" : "  stopped: " + run["reason"].get<std::string>());
  }
}

int StudyControl(const StudyOptions& options) {
  for (const std::string& scene : options.scenes) CheckScene(scene, options);
  DemandReportPage(options.report);
  ResultFolder folder(options.out, kStudyResults);
  CatchInterrupts();
  Json runs = Json::array();
  for (const std::string& scene : options.scenes) {
    for (const std::string& controller : options.controllers) {
      if (Interrupted()) break;
      runs.push_back(RunOne(scene, controller, options));
    }
  }
  bool ok = !Interrupted();
  for (Json& run : runs) {
    const double best = BestBaseline(runs, run["scene"].get<std::string>());
    run["cost_over_best_baseline"] =
        std::isfinite(best) && best > 0 ? Json(run["cost"].get<double>() / best) : Json();
    ok = ok && run["ok"].get<bool>();
  }
  const Json study = {{"study", "control"}, {"set", options.overrides}, {"runs", runs}};
  WriteWhole(folder.partial(), "study.json", Dump(study));
  if (ok) {
    folder.Publish();
  } else {
    Complain("study: {}; partial results in {}",
             Interrupted() ? "interrupted" : "a run could not go on", folder.partial().string());
  }
  if (options.json) {
    PrintText(Dump(study), ok ? 0 : kExitCannotContinue);
  } else {
    PrintTable(runs);
    if (ok) Print("  results in {}\n", (folder.folder() / "study.json").string());
  }
  ReportBeside(options.report, ok ? folder.folder() : folder.partial(), options.json || !ok);
  return ok ? 0 : kExitCannotContinue;
}

}  // namespace

void AddStudyCommand(CLI::App& app, int& exit_status) {
  CLI::App* study = app.add_subcommand("study", kHelp);
  study->require_subcommand(1);
  AddStudyAccuracyCommand(study, &exit_status);
  AddStudyStabilityCommand(study, &exit_status);
  AddStudyEffectsCommand(study, &exit_status);
  AddStudyPointCommand(study, &exit_status);
  CLI::App* command = study->add_subcommand("control", kControlHelp);
  static StudyOptions options;
  command->add_option("SCENES", options.scenes, "Scenes with a table [control]")
      ->required()
      ->check(CLI::ExistingFile);
  command
      ->add_option("--controllers", options.controllers,
                   "Comma-separated: mpc, converged, gait, pursuit, pid, lqr")
      ->delimiter(',')
      ->check(CLI::IsMember(kControllers))
      ->capture_default_str();
  command->add_option("--set", options.overrides, "Override of every scene, PATH=VALUE; repeatable")
      ->type_name("PATH=VALUE");
  command->add_option("--out", options.out, "Folder of study.json")->capture_default_str();
  command->add_flag("--json", options.json, "Print study.json instead of the table");
  AddReportOption(command, &options.report);
  command->callback([&exit_status] { exit_status = StudyControl(options); });
}

}  // namespace mantle::tools
