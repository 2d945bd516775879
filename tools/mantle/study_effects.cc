#include <fmt/format.h>

#include "tools/mantle/commands.h"
#include "tools/mantle/standard_output.h"
#include "tools/mantle/study_run.h"
#include "tools/studies/effects_study.h"

namespace mantle::tools {
namespace {

constexpr const char* kHelp =
    "What each effect of a scene costs and what it changes (docs/price.md): the scene with and\n"
    "without it, and one that never mentions it; instructions by callgrind where it is installed,\n"
    "by `perf stat` where the system allows it, else CPU time; plant, reduced model, "
    "controller.\n\n"
    "  mantle study effects scenes/paper.toml --out results/effects\n\n"
    "Exit status 0: an effect that is off costs nothing. 3: one does, or the study was stopped.";

struct Options {
  std::string scene;
  StudyRunOptions run;
};

std::string Number(const Json& x, const char* format) {
  return x.is_number() ? fmt::format(fmt::runtime(format), x.get<double>()) : "-";
}

Json Percent(const Json& share) {
  return share.is_number() ? Json(100 * share.get<double>()) : Json();
}

void PrintEffects(const Json& study) {
  Print("work of {:g} s by {}\n", study["counted_s"].get<double>(),
        study["counter"].get<std::string>());
  Print("{:11} {:20} {:>7} {:>12} {:>12} {:>9} {:>12} {:>10}\n", "model", "effect", "state",
        "with it", "without", "costs", "off - never", "changes");
  for (const Json& e : study["effects"]) {
    Print("{:11} {:20} {:>7} {:>12} {:>12} {:>9} {:>12} {:>10}  {}\n",
          e["model"].get<std::string>(), e["effect"].get<std::string>(), e["state"].dump(),
          Number(e["work_on"], "{:.4g}"), Number(e["work_off"], "{:.4g}"),
          Number(Percent(e["costs"]), "{:.1f} %"),
          Number(Percent(e["off_against_never"]), "{:.3f} %"), Number(e["changes"], "{:.3g}"),
          e["reason"].get<std::string>());
  }
  Print("  changes: largest distance of root and tips over the whole run, in body lengths\n");
  for (const Json& failure : study["failures"]) Print("  {}\n", failure.get<std::string>());
}

int StudyEffects(const Options& options) {
  const EffectsScene scene = PrepareEffects(options.scene, options.run.overrides);
  StudyRun run(options.run);
  const std::vector<Json> references = run.Run(EffectsReferences(scene), "references");
  std::vector<Json> rows;
  if (!run.stopped()) rows = run.Run(EffectsPoints(scene, run.points_folder()), "points");
  const Json study = EffectsReport(scene, references, rows);
  const int status = run.Conclude(study, rows, [&] { PrintEffects(study); });
  if (status != 0) return status;
  for (const Json& failure : study["failures"])
    Complain("study effects: {}", failure.get<std::string>());
  return study["failures"].empty() ? 0 : kExitCannotContinue;
}

}  // namespace

void AddStudyEffectsCommand(CLI::App* study, int* exit_status) {
  CLI::App* command = study->add_subcommand("effects", kHelp);
  static Options options;
  command->add_option("SCENE", options.scene, "Scene file")->required()->check(CLI::ExistingFile);
  AddStudyRunOptions(command, &options.run);
  command->callback([exit_status] { *exit_status = StudyEffects(options); });
}

}  // namespace mantle::tools
