#pragma once

#include <CLI/CLI.hpp>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "tools/mantle/output_folder.h"
#include "tools/studies/study_engine.h"

/// What `mantle study accuracy`, `stability`, `effects` and `control` share: the engine and its
/// options, the folder of results, progress, resuming.

namespace mantle::tools {

/// What a study leaves in its folder; study.json is the seal.
inline constexpr const char* kStudyResults[] = {"study.json", "study.csv", "study.png", "study.svg",
                                                "report.html"};

/// Options that every study has.
struct StudyRunOptions {
  std::string out{"results/study"};
  std::vector<std::string> overrides;
  EngineOptions engine;
  std::string engine_name{"local"};
  bool json{false}, report{false};
};

/// --out, --set, --jobs, --limit, --engine, --json, --report.
void AddStudyRunOptions(CLI::App* command, StudyRunOptions* options);

/// One study on its way: stages of points, then its results. What it has is kept in DIR.points, and
/// found again by the next study into DIR, as long as scene, options and program are the same.
class StudyRun {
 public:
  /// Locks the folder. Throws BadInput where it cannot be written or an engine is not there.
  explicit StudyRun(const StudyRunOptions& options);

  /// Rows of these points, in their order; fewer where the study was stopped.
  std::vector<Json> Run(const std::vector<StudyPoint>& points, const std::string& what);
  bool stopped() const { return stopped_; }

  /// Writes study.json and study.csv (of `rows`), and the results appear in the folder; where the
  /// study was stopped they stay in DIR.partial, and what has been run in DIR.points. Prints what
  /// `print` prints, or the JSON. Returns the exit status.
  int Conclude(const Json& study, const std::vector<Json>& rows,
               const std::function<void()>& print);

  /// For a study's own files (scenes that it writes).
  std::filesystem::path points_folder() const { return store_.folder(); }

 private:
  StudyRunOptions options_;
  ResultFolder folder_;
  StudyStore store_;
  std::unique_ptr<StudyEngine> engine_;
  bool stopped_{false};
};

/// `mantle study point FOLDER KEY`: what engines call.
void AddStudyPointCommand(CLI::App* study, int* exit_status);

/// Subcommands of `mantle study`.
void AddStudyAccuracyCommand(CLI::App* study, int* exit_status);
void AddStudyStabilityCommand(CLI::App* study, int* exit_status);
void AddStudyEffectsCommand(CLI::App* study, int* exit_status);

}  // namespace mantle::tools
