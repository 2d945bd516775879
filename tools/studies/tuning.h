#pragma once

#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "loop/closed_loop.h"
#include "loop/scene/scene.h"
#include "tools/studies/search.h"

/// Tuning of a baseline: the parameters that make the closed loop's cost least, on the full plant
/// through the drives, in lock-step.

namespace mantle::tools {

/// One parameter that is searched, and between which bounds; logarithmic where it spans decades.
struct TunedParameter {
  std::string_view key;  ///< in [control.baselines.NAME]
  double controller::BaselineGains::*value;
  double low{0}, high{0};
  bool logarithmic{false};
};

inline constexpr std::string_view kBaselineNames[] = {"gait", "pursuit", "pid", "lqr"};

/// Those that matter for a goal. `kind` is a baseline.
std::vector<TunedParameter> TunedParameters(controller::ControllerKind kind,
                                            const controller::ControlGoal& goal);

/// Values from which a search can begin where nothing is known.
controller::BaselineGains SoundStart(const controller::ControlGoal& goal);

/// Cost of a run that could not go on: larger than that of any that could, less the longer it went.
double FailedCost(double share_of_duration);

/// The closed loop of the scene with this baseline and these parameters.
loop::LoopResult RunBaseline(const scene::Scene& scene, controller::ControllerKind kind,
                             const controller::BaselineGains& gains,
                             const std::function<bool()>& stop);

struct TuningSettings {
  SearchMethod method{SearchMethod::kSubplex};
  int evaluations{200};
};

struct Tuning {
  controller::ControllerKind kind{};
  controller::BaselineGains gains;
  double cost_before{0};  ///< with the scene's parameters
  double cost{0};
  int evaluations{0};
  bool ok{false};  ///< the best run went to its end
};

/// Begins at the scene's parameters or at the sound start, whichever costs less. `progress` gets
/// the number of evaluations and the least cost so far, and returns false to stop. Throws BadScene
/// where the scene has no closed loop.
Tuning Tune(const scene::Scene& scene, controller::ControllerKind kind,
            const TuningSettings& settings, const std::function<bool(int, double)>& progress);

/// [control.baselines.NAME] with what was tuned and what is not the default.
std::string TuningToml(const Tuning& tuning, const scene::Scene& scene);

}  // namespace mantle::tools
