#pragma once

#include <optional>
#include <string>
#include <vector>

#include "loop/scene/scene.h"
#include "model/simulation.h"
#include "tools/mantle/json.h"

/// summary.json of `mantle run` (docs/outputs.md). Names carry units; what has no meaning for a
/// scene is null. All but wall_time_s and realtime_factor are the same bits on every run of a
/// scene.

namespace mantle::tools {

/// Extremes over the samples of a run.
struct VolumeRange {
  double initial_m3{0}, min_m3{0}, max_m3{0};
  bool started{false};

  void Add(double volume_m3);
};

struct RunReport {
  const scene::Scene* scene;
  const model::Plant* plant;
  const model::RunResult* result;
  VolumeRange volume;
  std::vector<std::string> overrides;
  double wall_time_s{0};       ///< of this process
  double simulated_here_s{0};  ///< by this process: less than the run's time where it was resumed
  bool complete{false};
  std::string reason;  ///< why not
};

Json RunSummary(const RunReport& report);

/// Names of the effects, bodies' sizes, integrator and steps: what decides the figures.
Json SettingsSummary(const scene::Scene& scene, const model::Plant& plant);
std::vector<std::string> EffectNames(const model::Effects& effects);
const char* IntegratorName(model::Integrator integrator);

/// Indented text, with a line feed at its end. What is not UTF-8 (a name from the command line) is
/// shown as U+FFFD.
std::string Dump(const Json& j);

/// What the model's assumptions cannot show by themselves (model/validity.h); null where there is
/// nothing to say it of.
Json StrainJson(const model::LargestStrain& strain);
Json LobedBucklingJson(const std::optional<model::LobedBucklingMargin>& margin);

/// The warnings of a summary, one line each, to standard error.
void ComplainOfWarnings(const std::string& scene, const std::vector<std::string>& warnings);

Json PoseJson(const model::Pose& pose);
Json VectorJson(const model::Vector3& v);

}  // namespace mantle::tools
