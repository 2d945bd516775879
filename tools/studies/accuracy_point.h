#pragma once

#include <filesystem>
#include <string>

#include "loop/scene/scene.h"
#include "tools/studies/study_path.h"
#include "tools/studies/study_point.h"

/// One run of an accuracy study: the plant or the reduced model of a scene, its path, what it cost.

namespace mantle::tools {

/// A run and its price.
struct MeasuredRun {
  bool ok{false};
  std::string reason;
  StudyPath path;
  double cpu_s{0};  ///< of the integration, without building the model
  double sim_time_s{0};
  model::StepCounters counters;
  int unknowns{0};  ///< velocities of the model
};

/// Runs the scene's plant, or its reduced model, in this process. Throws as the models'
/// constructors.
MeasuredRun RunMeasured(const scene::Scene& scene, bool reduced);

/// Where the reference of these points stands in the cache. A reference is a point of kind
/// "reference"; others name it in their options.
std::filesystem::path ReferenceFile(const StudyPoint& reference);

/// Errors as they stand in a row: root, tip, heading_rad, volume, energy, each with largest and
/// final; what the robot does not have is left out.
Json ErrorsJson(const PathErrors& errors, const StudyPath& reference);

}  // namespace mantle::tools
