#include "tools/mantle/study_run.h"

#include <fmt/format.h>

#include "tools/mantle/commands.h"
#include "tools/mantle/interrupt.h"
#include "tools/mantle/progress.h"
#include "tools/mantle/scene_options.h"
#include "tools/mantle/standard_output.h"
#include "tools/mantle/summary.h"
#include "tools/report/page_file.h"
#include "tools/studies/study_kinds.h"
#include "tools/studies/study_table.h"

namespace mantle::tools {
namespace {

namespace fs = std::filesystem;

fs::path WithSuffix(const std::string& folder, const char* suffix) {
  fs::path path(folder);
  if (!path.has_filename()) path = path.parent_path();
  return path.string() + suffix;
}

std::unique_ptr<StudyEngine> MakeEngine(const StudyRunOptions& options) {
  return MakeLocalEngine(options.engine);
}

}  // namespace

void AddStudyRunOptions(CLI::App* command, StudyRunOptions* options) {
  command->add_option("--out", options->out, "Folder of study.json and study.csv")
      ->capture_default_str();
  command
      ->add_option("--set", options->overrides,
                   "Override of every point's scene, KEY=VALUE; repeatable")
      ->type_name("KEY=VALUE")
      ->expected(1)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
  command
      ->add_option("--jobs", options->engine.jobs,
                   "Points at once, each pinned to a core (default: the cores there are)")
      ->type_name("N")
      ->check(CLI::Range(1, 4096));
  command->add_option("--limit", options->engine.limit_s, "CPU time that one point may take")
      ->type_name("SECONDS")
      ->check(CLI::Range(1.0, 1e6))
      ->capture_default_str();
  command->add_flag("--json", options->json, "Print study.json instead of the table");
  AddReportOption(command, &options->report);
}

StudyRun::StudyRun(const StudyRunOptions& options)
    : options_(options),
      folder_(options.out, kStudyResults),
      store_(WithSuffix(options.out, ".points")),
      engine_(MakeEngine(options)) {
  DemandReportPage(options.report);
  CatchInterrupts();
}

std::vector<Json> StudyRun::Run(const std::vector<StudyPoint>& points, const std::string& what) {
  std::unique_ptr<Progress> progress;
  int begin = -1;
  std::vector<Json> rows = RunPoints(
      points, engine_.get(), &store_,
      [&](int done, int of) {
        if (begin < 0) {
          begin = done;
          progress = std::make_unique<Progress>(0.0, std::max(of, 1), what, false);
        }
        progress->Update(done);
        return !Interrupted();
      },
      &stopped_);
  if (progress) progress->Finish();
  return rows;
}

int StudyRun::Conclude(const Json& study, const std::vector<Json>& rows,
                       const std::function<void()>& print) {
  const bool whole = !stopped_;
  Json j = study;
  j["complete"] = whole;
  if (!whole) j["reason"] = "interrupted";
  WriteWhole(folder_.partial(), "study.csv", StudyCsv(rows, j["versions"]));
  WriteWhole(folder_.partial(), "study.json", Dump(j));
  const int status = whole ? 0 : kExitCannotContinue;
  if (whole) {
    folder_.Publish();
    store_.Remove();
  } else {
    Complain("study: interrupted; partial results in {}; the same command goes on from {}",
             folder_.partial().string(), store_.folder().string());
  }
  if (options_.json) {
    PrintText(Dump(j), status);
  } else if (whole) {
    print();
    Print("  results in {}\n", (folder_.folder() / "study.json").string());
  }
  ReportBeside(options_.report, whole ? folder_.folder() : folder_.partial(),
               options_.json || !whole);
  return status;
}

void AddStudyPointCommand(CLI::App* study, int* exit_status) {
  CLI::App* command = study->add_subcommand(
      "point",
      "One point of a study, as a study's engine calls it: reads FOLDER/KEY.point.json, "
      "leaves FOLDER/KEY.row.json.");
  static std::string folder, key;
  command->add_option("FOLDER", folder, "Of the study's points")->required();
  command->add_option("KEY", key, "Of the point")->required();
  command->callback([exit_status] {
    if (!fs::is_directory(folder)) throw BadInput(folder + ": is no folder of points");
    StudyStore store(folder);
    store.PutRow(key, RunPoint(store.Point(key)));
    *exit_status = 0;
  });
}

}  // namespace mantle::tools
