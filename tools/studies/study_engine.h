#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "tools/studies/study_point.h"
#include "tools/studies/study_store.h"

/// Who runs a study's points: every point in a process of its own (`mantle study point FOLDER
/// KEY`), which leaves its row in the store. A point that fails is a row with its reason.

namespace mantle::tools {

/// What an engine tells while it works: points done, of how many. Returning false stops it.
using StudyProgress = std::function<bool(int done, int of)>;

/// How a point's process is bounded, and how many there are at once.
struct EngineOptions {
  int jobs{0};          ///< processes at once; 0: the cores of this process
  double limit_s{120};  ///< CPU time that one point may take
};

/// Seam: this machine's cores, or a cluster's scheduler.
class StudyEngine {
 public:
  virtual ~StudyEngine() = default;
  /// Brings about the rows of these keys in the store, where it can. Returns false where it was
  /// stopped. `reasons[i]` of those without a row.
  virtual bool Run(const std::vector<std::string>& keys, StudyStore* store,
                   const StudyProgress& progress, std::vector<std::string>* reasons) = 0;
};

/// Child processes, each pinned to a core of its own as long as there are no more than cores. All
/// of them end with this process.
std::unique_ptr<StudyEngine> MakeLocalEngine(const EngineOptions& options);

/// A study's points and their rows, in their order: rows that are there already are not made again.
/// Returns fewer rows than points where it was stopped: those it has, in order, `*stopped` true.
std::vector<Json> RunPoints(const std::vector<StudyPoint>& points, StudyEngine* engine,
                            StudyStore* store, const StudyProgress& progress, bool* stopped);

}  // namespace mantle::tools
