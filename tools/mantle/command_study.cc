#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <limits>

#include "tools/mantle/build_run.h"
#include "tools/mantle/scene_options.h"
#include "tools/mantle/standard_output.h"
#include "tools/mantle/study_run.h"

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
    "The last column is the cost over that of the best baseline of the scene. Runs side by side "
    "share\nthe machine: take --jobs 1 where the solver's times matter.";

const std::vector<std::string> kControllers = {"mpc", "converged", "gait", "pursuit", "pid", "lqr"};

struct StudyOptions {
  std::vector<std::string> scenes;
  std::vector<std::string> controllers = {"mpc", "gait", "pursuit", "pid", "lqr"};
  StudyRunOptions run;
};

bool IsBaseline(const std::string& controller) {
  return controller != "mpc" && controller != "converged";
}

StudyPoint PointOf(const std::string& file, const std::string& controller,
                   const StudyOptions& options) {
  StudyPoint p;
  p.kind = "control";
  p.family = std::filesystem::path(file).stem().string();
  p.name = p.family + ", " + controller;
  p.scene = std::filesystem::absolute(file).lexically_normal().string();
  p.overrides = options.run.overrides;
  p.options = {{"controller", controller}};
  p.shown = {{"scene", p.family}, {"controller", controller}};
  return p;
}

// Refuses a scene before anything is run or written.
void CheckScene(const std::string& file, const StudyOptions& options) {
  SceneOptions scene_options;
  scene_options.scene_file = file;
  scene_options.overrides = options.run.overrides;
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
    const auto number = [&](const char* key, int digits) {
      return text(run.value(key, Json()), digits);
    };
    const auto error = [&](const char* key) {
      return text(run.value("error", Json::object()).value(key, Json()), 4);
    };
    const bool solver = run.contains("solver") && !run["solver"].is_null();
    Print("{:20} {:10} {:>10} {:>9} {:>9} {:>9} {:>9} {:>7} {:>8} {:>8} {:>9} {:>7} {:>7}{}\n",
          run["scene"].get<std::string>(), run["controller"].get<std::string>(), number("cost", 4),
          error("mean"), error("max"), error("final"), number("effort_n2_s", 3),
          number("energetic_index", 3), Milliseconds(run, "median"), Milliseconds(run, "p99"),
          solver ? run["solver"]["fallbacks"].dump() : "-",
          run.value("limit_touches", Json()).dump(), number("cost_over_best_baseline", 2),
          run["ok"].get<bool>() ? "" : "  stopped: " + run["reason"].get<std::string>());
  }
}

int StudyControl(const StudyOptions& options) {
  for (const std::string& scene : options.scenes) CheckScene(scene, options);
  StudyRun run(options.run);
  std::vector<StudyPoint> points;
  for (const std::string& scene : options.scenes) {
    for (const std::string& controller : options.controllers) {
      points.push_back(PointOf(scene, controller, options));
    }
  }
  const std::vector<Json> rows = run.Run(points, "runs");
  Json runs = rows;
  bool ok = true;
  for (Json& row : runs) {
    const double best = BestBaseline(runs, row["scene"].get<std::string>());
    row["cost_over_best_baseline"] = row.contains("cost") && std::isfinite(best) && best > 0
                                         ? Json(row["cost"].get<double>() / best)
                                         : Json();
    ok = ok && row["ok"].get<bool>();
  }
  const Json study = {{"study", "control"},
                      {"set", options.run.overrides},
                      {"versions", StudyVersions()},
                      {"runs", runs}};
  const int status = run.Conclude(study, runs.get<std::vector<Json>>(), [&] { PrintTable(runs); });
  if (status != 0 || ok) return status;
  Complain("study: a run could not go on; its row says why");
  return kExitCannotContinue;
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
  AddStudyRunOptions(command, &options.run);
  command->callback([&exit_status] { exit_status = StudyControl(options); });
}

}  // namespace mantle::tools
