#include <fmt/format.h>

#include <cmath>
#include <iterator>
#include <memory>

#include "tools/mantle/interrupt.h"
#include "tools/mantle/output_folder.h"
#include "tools/mantle/progress.h"
#include "tools/mantle/scene_options.h"
#include "tools/mantle/standard_output.h"
#include "tools/mantle/summary.h"
#include "tools/report/page_file.h"
#include "tools/studies/tuning.h"

namespace mantle::tools {
namespace {

constexpr const char* kHelp =
    "Tune the baselines that the predictive controller is compared with: find the parameters that\n"
    "make the scene's cost least, each by running the closed loop on the full plant through its\n"
    "drives. Every baseline gets the same number of runs; the same scene gives the same result.\n"
    "Prints tables [control.baselines.NAME] to paste into the scene and writes them to\n"
    "DIR/baselines.toml, and how the search went to DIR/tuning.json.\n\n"
    "  mantle tune scenes/steer.toml\n"
    "  mantle tune scenes/steer.toml --controller pursuit --evaluations 60\n"
    "  mantle tune scenes/steer.toml --report                    # and a page to look at\n"
    "  mantle tune scenes/steer.toml --set time.duration=15      # quicker, on the first part "
    "only\n"
    "\n"
    "gait     open loop: height and period of the scene's gait\n"
    "pursuit  gait and a pull towards the reference ahead, damped by the turn rate\n"
    "pid      the same with an integral\n"
    "lqr      gait and a linear-quadratic regulator on the reduced model\n\n"
    "Exit status 0: tuned. 2: bad input, nothing written. 3: interrupted, or no parameters were\n"
    "found with which the run goes to its end; nothing written.";

constexpr const char* kTuneResults[] = {"baselines.toml", "tuning.json", "report.html"};

struct TuneOptions {
  SceneOptions scene;
  std::string controller{"all"}, method{"subplex"};
  int evaluations{200};
};

std::vector<controller::ControllerKind> Chosen(const TuneOptions& options) {
  std::vector<controller::ControllerKind> kinds;
  for (std::size_t i = 0; i < std::size(kBaselineNames); ++i) {
    if (options.controller == "all" || options.controller == kBaselineNames[i]) {
      kinds.push_back(static_cast<controller::ControllerKind>(i + 1));
    }
  }
  return kinds;
}

TuningSettings SettingsOf(const TuneOptions& options) {
  TuningSettings settings;
  settings.evaluations = options.evaluations;
  for (std::size_t i = 0; i < std::size(kSearchMethods); ++i) {
    if (options.method == kSearchMethods[i]) settings.method = static_cast<SearchMethod>(i);
  }
  return settings;
}

// `trace`: runs and the least cost so far, where it fell.
Json TuningJson(const Tuning& t, const scene::Scene& scene, const Json& trace) {
  Json j{{"cost", t.cost}, {"cost_before", t.cost_before}, {"evaluations", t.evaluations}};
  for (const TunedParameter& p : TunedParameters(t.kind, scene.control->goal)) {
    j["parameters"][std::string(p.key)] = t.gains.*p.value;
  }
  j["trace"] = trace;
  return j;
}

int TuneScene(const TuneOptions& options) {
  const scene::Scene scene = options.scene.Load();
  const std::filesystem::path folder = options.scene.OutputFolder(scene);
  const auto kinds = Chosen(options);
  InScene(options.scene, [&] {  // refused before anything is run or written
    loop::ClosedLoopOptions run;
    run.controller = ToString(kinds.front());
    return std::make_unique<loop::ClosedLoop>(scene, run);
  });
  DemandReportPage(options.scene.report);
  CatchInterrupts();
  ResultFolder results(folder, kTuneResults);
  Progress progress(0.0,
                    static_cast<double>(options.evaluations) * static_cast<double>(kinds.size()),
                    "runs", false);
  std::string text = fmt::format("# Tuned on {}: `mantle tune`, {}, at most {} runs each.\n",
                                 scene.name, options.method, options.evaluations);
  Json json{{"scene", scene.name}, {"method", options.method}};
  for (std::size_t i = 0; i < kinds.size(); ++i) {
    const double before = static_cast<double>(i) * options.evaluations;
    Json trace = Json::array();
    const Tuning tuning = InScene(options.scene, [&] {
      return Tune(scene, kinds[i], SettingsOf(options), [&](int runs, double least_cost) {
        progress.Update(before + runs);
        const bool fell = trace.empty() || trace.back()[1] != least_cost;
        if (fell && std::isfinite(least_cost)) trace.push_back({runs, least_cost});
        return !Interrupted();
      });
    });
    progress.Finish();
    const std::string_view name = kBaselineNames[static_cast<std::size_t>(kinds[i]) - 1];
    if (Interrupted() || !tuning.ok) {
      Complain("{}: {}: {}; nothing is written", scene.name, name,
               Interrupted() ? "interrupted" : "no run went to its end");
      return kExitCannotContinue;
    }
    const std::string table = "\n" + TuningToml(tuning, scene);
    if (!options.scene.json) {
      PrintText(table);
      FlushOutput();
    }
    text += table;
    if (!trace.empty() && trace.back()[0] != tuning.evaluations) {
      trace.push_back({tuning.evaluations, tuning.cost});
    }
    json["controllers"][std::string(name)] = TuningJson(tuning, scene, trace);
  }
  WriteWhole(results.partial(), "baselines.toml", text);
  WriteWhole(results.partial(), "tuning.json", Dump(json));
  results.Publish();
  if (options.scene.json) {
    PrintText(Dump(json));
  } else {
    Print("\nwritten to {}\n", (folder / "baselines.toml").string());
  }
  ReportBeside(options.scene.report, results.folder(), options.scene.json);
  return 0;
}

}  // namespace

void AddTuneCommand(CLI::App& app, int& exit_status) {
  CLI::App* command = app.add_subcommand("tune", kHelp);
  static TuneOptions options;  // lives as long as the parser that points to it
  AddSceneOptions(command, &options.scene);
  AddOutOption(command, &options.scene);
  AddReportOption(command, &options.scene.report);
  command->add_option("--controller", options.controller, "Which baseline (default: all)")
      ->check(CLI::IsMember({"all", "gait", "pursuit", "pid", "lqr"}));
  command->add_option("--evaluations", options.evaluations, "Runs per baseline (default: 200)")
      ->check(CLI::Range(3, 100000));
  command
      ->add_option("--method", options.method,
                   "Search: subplex (default) or bobyqa, both local, or crs, global")
      ->check(CLI::IsMember({"subplex", "bobyqa", "crs"}));
  command->callback([&exit_status] { exit_status = TuneScene(options); });
}

}  // namespace mantle::tools
