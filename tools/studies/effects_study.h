#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "loop/scene/scene.h"
#include "tools/studies/study_point.h"

/// What each effect of a scene costs and what it changes: the scene as it is, without the effect
/// (`effects.NAME=false`, its parameters still there), and as one that never mentions it (neither
/// the key nor the parameters that it alone reads), for the plant, the reduced model and, where the
/// scene has a control loop, the controller's plans. Counted are instructions of the run itself,
/// without building the model: by callgrind where it is installed, else by `perf stat` where the
/// system allows it (of the whole process), else CPU time.

namespace mantle::tools {

/// How a run's work is counted.
enum class WorkCounter { kCallgrind, kPerf, kTime };
const char* ToString(WorkCounter counter);
/// The best that this machine has.
WorkCounter FindWorkCounter();

/// Instructions of an effect that is off against a scene that never mentions it may differ by this.
inline constexpr double kOffCosts = 0.01;

struct EffectsScene {
  std::string file;
  std::vector<std::string> overrides;
  scene::Scene scene;
  std::vector<std::string> effects;  ///< named and on, in the scene's order
  WorkCounter counter{WorkCounter::kTime};
  double count_s{0.3};  ///< simulated time whose work is counted
};

/// Throws BadScene; also where the scene has no [time] or names no effect.
EffectsScene PrepareEffects(const std::string& file, const std::vector<std::string>& overrides);

/// Runs that the changes are told against.
std::vector<StudyPoint> EffectsReferences(const EffectsScene& s);
/// The points; scenes that never mention an effect are written into `folder`.
std::vector<StudyPoint> EffectsPoints(const EffectsScene& s, const std::filesystem::path& folder);

/// The scene's text without the effect, and without the keys that it alone reads.
std::string WithoutEffect(const std::string& scene_text, const std::string& effect);

/// What is run under a counter: `state` (velocities of the model), `steps`.
Json RunWorkloadPoint(const StudyPoint& point);
/// A workload under a counter, and what its result differs by.
Json RunEffectsPoint(const StudyPoint& point);

/// study.json: one line per model and effect. `failures` says where an effect that is off costs
/// more than kOffCosts.
Json EffectsReport(const EffectsScene& s, const std::vector<Json>& references,
                   const std::vector<Json>& rows);

}  // namespace mantle::tools
