#pragma once

#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <string_view>

#include "tools/mantle/bad_input.h"
#include "tools/mantle/folder_lock.h"
#include "tools/mantle/output_file.h"

/// The folder DIR of a command's results appears whole or not at all (docs/outputs.md):
///
///   while it runs           results grow in the folder DIR.partial beside DIR; DIR is as it was
///   success                 DIR.partial has become DIR, by one rename
///   could not go on, killed DIR.partial holds what was reached; DIR is as it was
///   bad input               DIR and DIR.partial are as they were
///
/// One process at a time has the folder: the others are refused by a lock on the file .DIR.lock
/// beside it. What is not a command's own in DIR (notes, other results) stays: such a folder is not
/// replaced, but its files are, one by one, the seal (the first of the command's names) first taken
/// away and last put in place: a folder that has its seal is whole. So is a folder that cannot be
/// renamed: a mount point, the current folder. Where the parent of DIR is not writable, or DIR is a
/// mount point, `DIR.partial` and `.DIR.lock` are `DIR/run.partial` and `DIR/.run.lock`.

namespace mantle::tools {

/// Names of the files that a command may leave; the first one is the seal.
using ResultNames = std::span<const char* const>;

/// Of `mantle run`, `static`, `modes` and `compare`, and what tools/plot and `mantle report` make
/// of them: a folder holds the results of one of them.
inline constexpr const char* kSceneResults[] = {
    "summary.json", "trajectory.csv", "telemetry.lcmlog", "solver.csv",
    "checkpoint",   "path.csv",       "shape.csv",        "full.csv",
    "reduced.csv",  "shapes.csv",     "trajectory.png",   "control.png",
    "timing.png",   "full.lcmlog",    "reduced.lcmlog",   "report.html"};

class ResultFolder {
 public:
  /// What a resumed run goes on from: these names in `folder`, where that is DIR.partial.
  struct Kept {
    std::filesystem::path folder;
    ResultNames names;
  };

  /// Locks the folder and empties DIR.partial of earlier results of these names, but for `kept`.
  /// Makes parents where they are missing. Throws BadInput where the folder cannot be written or is
  /// another process's.
  ResultFolder(const std::filesystem::path& folder, ResultNames names, const Kept& kept = {});
  /// Leaves DIR.partial, unless it is empty.
  ~ResultFolder();
  ResultFolder(const ResultFolder&) = delete;
  ResultFolder& operator=(const ResultFolder&) = delete;

  /// Where the command writes: DIR.partial, beside the folder as it was given.
  const std::filesystem::path& partial() const { return shown_partial_; }
  /// DIR, as it was given.
  const std::filesystem::path& folder() const { return shown_; }

  /// The results are whole: they become DIR. Every OutputFile must be closed. Throws CannotGoOn,
  /// and leaves them in DIR.partial, where the system refuses.
  void Publish();

 private:
  bool HoldsResultsAlone() const;
  void ReplaceFiles();

  std::filesystem::path shown_, folder_, shown_partial_, partial_;
  ResultNames names_;
  std::unique_ptr<FolderLock> lock_;
  bool inside_{false};
};

/// Where a run into `folder` that was stopped leaves the file `name`.
std::filesystem::path PartialOf(const std::filesystem::path& folder, const std::string& name);

}  // namespace mantle::tools
