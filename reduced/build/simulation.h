#pragma once

#include <functional>

#include "model/simulation.h"
#include "reduced/build/mantle_guard.h"
#include "reduced/build/projection.h"
#include "reduced/step.h"

namespace mantle::reduced {

/// How long a run of the reduced model is, and how it steps.
struct ReducedRunSettings {
  double duration_s{1};
  double step_s{0.05};      ///< longest
  double min_step_s{1e-6};  ///< retries stop there
  double output_interval_s{0.05};
  StepSettings step;
  model::StaticsSettings statics;  ///< of a run that starts from its equilibrium
};

/// What a scene's tables [time], [output] and [reduced] say.
ReducedRunSettings RunSettingsOf(const model::RunSettings& run, const Reduction& reduction);

/// A run of the reduced model: steps aligned with the schedules' break points and output times,
/// retried at half the step where they fail. Samples are those of the plant (model/simulation.h),
/// taken of the lifted state.
class ReducedSimulation {
 public:
  /// Starts where the plant does (model::StartState), projected; from an equilibrium, in the
  /// reduced model's own. Throws model::BadRobot.
  ReducedSimulation(const ReducedPlant& model, const ReducedRunSettings& settings);

  const ReducedState& state() const { return state_; }
  /// The plant's state that the last Observe lifted state() to.
  const model::PlantState& lifted() const { return lifted_; }
  ReducedState* mutable_state() {
    stepped_ = false;
    return &state_;
  }
  model::StepStatus AdvanceTo(double t_s);
  /// Of the lifted state, with the reduced model's own acceleration of the root.
  model::Sample Observe();
  /// As model::Simulation::Run; energies are reported, works and balances are not. A jet that has
  /// run away, a mantle that the plant would see collapse, and a shape that the plant cannot
  /// evaluate stop it (MantleGuard).
  model::RunResult Run(const std::function<bool(const model::Sample&)>& observer = {});

 private:
  void Settle();
  void CompareStart(const model::PlantState& start);

  const ReducedPlant& model_;
  ReducedRunSettings settings_;
  ReducedState state_, next_;
  StepWork work_;
  ReducedWork evaluation_;
  ReducedJacobians jacobians_;
  Projection projection_;
  model::PlantState lifted_;
  model::PlantWork plant_work_;
  model::PlantInputs first_, last_;
  VectorX acceleration_, plant_acceleration_;
  std::vector<model::PayloadDrop> drops_;
  model::StepCap step_cap_;
  bool stepped_{false};  // state_ is where work_'s step ended, and no break point
  model::StepCounters counters_;
  std::vector<std::string> start_warnings_;
  MantleGuard guard_;
  model::ValidityRecord validity_;
  model::EvaluationFailure lifted_failure_;
};

}  // namespace mantle::reduced
