#include <fmt/format.h>

#include "tools/mantle/commands.h"
#include "tools/mantle/standard_output.h"
#include "tools/mantle/study_run.h"
#include "tools/studies/stability_study.h"

namespace mantle::tools {
namespace {

constexpr const char* kHelp =
    "Hard cases stay stable (docs/price.md): every integrator at steps from 0.1 to 50 ms on the\n"
    "scenes of a folder, or on one. A run holds (finite, no energy without work, momentum kept,\n"
    "bounded), or is refused with a reason that names the cause; what does neither is a "
    "failure.\n\n"
    "  mantle study stability scenes/hard --out results/hard\n"
    "  mantle study stability scenes/paper.toml --set time.duration=0.5\n\n"
    "Exit status 0: no run gives a silent wrong answer. 3: one does, or the study was stopped.";

struct Options {
  std::string scenes{"scenes/hard"};
  bool small{false};
  StudyRunOptions run;
};

std::string Step(const Json& step_s) {
  return step_s.is_number() ? fmt::format("{:.4g} ms", 1e3 * step_s.get<double>()) : "none";
}

void PrintStability(const Json& study) {
  Print("{:26} {:15} {:>14}  {}\n", "case", "integrator", "holds up to", "the next one");
  std::string name;
  for (const Json& row : study["points"]) {
    if (row["case"] != name) {
      name = row["case"];
      Print("{}: {}\n", name, row.value("hard", std::string()));
    }
    if (!row.contains("runs")) {
      Print("{:26} {:15} {}\n", "", row["integrator"].get<std::string>(),
            row["reason"].get<std::string>());
      continue;
    }
    Print("{:26} {:15} {:>14}  {}\n", "", row["integrator"].get<std::string>(),
          Step(row["largest_step_s"]),
          row["next_fails"].is_null() ? "" : row["next_fails"].get<std::string>());
  }
  Print("\n{:16} {:>8} {:>8} {:>8} {:>8} {:>8}\n", "integrator", "holds", "told", "refused", "slow",
        "violates");
  for (const Json& i : study["integrators"]) {
    Print("{:16} {:>8} {:>8} {:>8} {:>8} {:>8}\n", i["integrator"].get<std::string>(),
          i["holds"].get<int>(), i["told"].get<int>(), i["refused"].get<int>(),
          i["slow"].get<int>(), i["violates"].get<int>());
  }
  Print(
      "  {} cases, {} runs, {:.1f} % refused; the default settings are within {:g} body lengths in "
      "{:.1f} %\n",
      study["cases"].get<int>(), study["runs"].get<int>(),
      100 * study["refused_share"].get<double>(), kAsReference,
      100 * study["default_share"].get<double>());
  for (const Json& c : study["not_reached"]) {
    Print("  {}: no integrator and step is within {:g} body lengths of the reference\n",
          c.get<std::string>(), kAsReference);
  }
  for (const Json& v : study["violations"]) {
    Print("  {}, {}: {}\n", v["case"].get<std::string>(), v["integrator"].get<std::string>(),
          v["reason"].get<std::string>());
  }
}

int StudyStability(const Options& options) {
  const std::vector<std::string> scenes = HardScenes(options.scenes);
  StudyRun run(options.run);
  const std::vector<Json> references =
      run.Run(StabilityReferences(scenes, options.run.overrides), "references");
  std::vector<Json> rows;
  if (!run.stopped()) {
    rows = run.Run(StabilityPoints(scenes, options.run.overrides, StabilitySteps(options.small)),
                   "points");
  }
  const Json study = StabilityReport(options.run.overrides, references, rows);
  const int status = run.Conclude(study, StabilityRuns(rows), [&] { PrintStability(study); });
  if (status != 0) return status;
  if (study["violations"].empty()) return 0;
  Complain("study stability: {} of {} points give a silent wrong answer",
           study["violations"].size(), rows.size());
  return kExitCannotContinue;
}

}  // namespace

void AddStudyStabilityCommand(CLI::App* study, int* exit_status) {
  CLI::App* command = study->add_subcommand("stability", kHelp);
  static Options options;
  command->add_option("SCENES", options.scenes, "A scene, or a folder of scenes")
      ->capture_default_str();
  command->add_flag("--small", options.small, "Steps of 1, 10 and 50 ms alone");
  AddStudyRunOptions(command, &options.run);
  command->callback([exit_status] { *exit_status = StudyStability(options); });
}

}  // namespace mantle::tools
