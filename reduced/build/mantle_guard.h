#pragma once

#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "model/stepper.h"
#include "reduced/build/reduced_plant.h"

/// @file
/// What the reduced mantle cannot know of itself: its shapes are a few, and hold it open where the
/// plant's wall would not. Watches a run step by step.
///
/// Beyond shapes: a coordinate that has left the range of the equilibria (and snapshots) the shapes
/// were built from extrapolates them. Collapse: above the plant's first limit point p_c on the
/// static path (reduced/build/mantle_basis.h) no open shape is in equilibrium, so that a mantle
/// which keeps its volume for kHeldTime_s under more than p_c stands on its shapes alone. A pulse
/// that exceeds p_c for a moment does not. Run-away of the jet: as the plant's
/// (model::JudgeThrust).

namespace mantle::reduced {

/// Shares of the largest coordinate built from beyond which a run is warned of.
inline constexpr double kBeyondShapes = 1.25;
/// How long, and to what share of its volume, a mantle may stay as it is above p_c.
inline constexpr double kHeldTime_s = 0.1, kHeldVolume = 0.01;

/// Watches a reduced run for shapes beyond those that its mantle was built from, for collapse and
/// for the jet's run-away. Keeps what it has seen; one for each run.
class MantleGuard {
 public:
  /// `model` must outlive it.
  explicit MantleGuard(const ReducedPlant& model);

  /// Not ok, in words, after a step that ended in `state` under `inputs`.
  model::StepStatus Judge(const ReducedState& state, const model::PlantInputs& inputs);
  /// What to tell the user after the run, a line each.
  std::vector<std::string> Warnings() const;

 private:
  model::StepStatus JudgeCollapse(const ReducedState& state, const model::PlantInputs& inputs);

  const ReducedPlant& model_;
  ReducedWork work_;
  VectorX still_;
  std::vector<double> tensions_n_;     ///< as the inputs' cables
  std::optional<double> collapse_pa_;  ///< once it is needed; infinite where there is none
  double held_since_s_{std::numeric_limits<double>::infinity()}, held_m3_{0};
  double farthest_{0}, farthest_s_{0};
  int farthest_coordinate_{-1};
  double above_pa_{0}, above_s_{0};  ///< largest pressure above p_c
};

}  // namespace mantle::reduced
