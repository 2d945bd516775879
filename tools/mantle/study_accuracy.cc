#include <fmt/format.h>

#include "tools/mantle/commands.h"
#include "tools/mantle/standard_output.h"
#include "tools/mantle/study_run.h"
#include "tools/mantle/summary.h"
#include "tools/studies/accuracy_study.h"

namespace mantle::tools {
namespace {

constexpr const char* kHelp =
    "What accuracy costs on a scene (docs/price.md): integrators and steps, tolerances, elements,\n"
    "the reduced model's choices, each against a reference of its own kind and against the finest\n"
    "plant, error beside CPU time, with observed orders, the Pareto front and recommendations.\n\n"
    "  mantle study accuracy scenes/paper.toml --out results/price\n"
    "  mantle study accuracy scenes/octopus.toml --size small --set time.duration=1\n"
    "  tools/plot results/price\n\n"
    "References are kept in ~/.cache/mantle, by what they are of and by the build of the program.\n"
    "A study that was stopped goes on where it was, by the same command.";

struct Options {
  std::string scene;
  StudySize size{StudySize::kDefault};
  StudyRunOptions run;
};

std::string Cell(const Json& row, const char* key, const char* format) {
  if (!row.contains(key) || !row[key].is_number()) return "-";
  return fmt::format(fmt::runtime(format), row[key].get<double>());
}

void PrintAccuracy(const Json& study) {
  Print("{:58} {:>10} {:>10} {:>9} {:>8}\n", "point", "error", "in all", "cpu [s]", "x real");
  std::string family;
  for (const Json& row : study["points"]) {
    if (row["family"] != family) Print("{}\n", family = row["family"].get<std::string>());
    const std::string name = row["name"];
    if (!row["ok"].get<bool>()) {
      Print("  {:56} {}\n", name, row["reason"].get<std::string>());
      continue;
    }
    Print("{} {:56} {:>10} {:>10} {:>9} {:>8}\n", row["front"].get<bool>() ? "*" : " ", name,
          Cell(row, "error", "{:.3g}"), Cell(row, "error_in_all", "{:.3g}"),
          Cell(row, "cpu_s", "{:.4f}"), Cell(row, "times_real_time", "{:.1f}"));
  }
  Print(
      "  error: {}, against the reference of the family; in all: against the finest plant; *: on "
      "the "
      "Pareto front\n\norders\n",
      study["headline"].get<std::string>());
  for (const Json& order : study["orders"]) {
    if (order["order"].is_null()) {
      Print("  {:16} {}\n", order["of"].get<std::string>(), order["reason"].get<std::string>());
    } else {
      Print("  {:16} {:.2f}, theory {:g} ({} points)\n", order["of"].get<std::string>(),
            order["order"].get<double>(), order["theory"].get<double>(),
            order["points"].get<int>());
    }
  }
  Print("\nrecommendations\n");
  for (const Json& r : study["recommendations"]) Print("  {}\n", r["text"].get<std::string>());
}

int StudyAccuracy(const Options& options) {
  const AccuracyScene scene = PrepareAccuracy(options.scene, options.run.overrides, options.size);
  StudyRun run(options.run);
  const std::vector<Json> references = run.Run(AccuracyReferences(scene), "references");
  std::vector<Json> rows;
  if (!run.stopped()) rows = run.Run(AccuracyPoints(scene), "points");
  if (!run.stopped()) {
    for (Json& row : run.Run(ComposedPoints(scene, rows), "composed points"))
      rows.push_back(std::move(row));
  }
  const Json study = AccuracyReport(scene, references, rows);
  if (!run.stopped()) {  // for `mantle run --accuracy`
    const std::filesystem::path file = StudyFile(scene.scene);
    std::filesystem::create_directories(file.parent_path());
    WriteWhole(file.parent_path(), file.filename().string(), Dump(study));
  }
  return run.Conclude(study, study["points"].get<std::vector<Json>>(),
                      [&] { PrintAccuracy(study); });
}

}  // namespace

void AddStudyAccuracyCommand(CLI::App* study, int* exit_status) {
  CLI::App* command = study->add_subcommand("accuracy", kHelp);
  static Options options;
  command->add_option("SCENE", options.scene, "Scene file")->required()->check(CLI::ExistingFile);
  command->add_option("--size", options.size, "How many points: default or small")
      ->transform(CLI::CheckedTransformer(std::map<std::string, StudySize>{
          {"small", StudySize::kSmall}, {"default", StudySize::kDefault}}))
      ->type_name("SIZE");
  AddStudyRunOptions(command, &options.run);
  command->callback([exit_status] { *exit_status = StudyAccuracy(options); });
}

}  // namespace mantle::tools
