#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "controller/controller.h"
#include "controller/estimator.h"
#include "controller/sensors.h"
#include "controller/tension_loop.h"
#include "loop/loop_account.h"
#include "loop/scene/scene.h"
#include "loop/vehicle.h"
#include "reduced/build/projection.h"

/// The closed loop of a scene with a table [control]:
///
///   plant -> projection -> sensors -> estimator -> controller -> limits -> torque -> CANopen
///   drives
///     ^                                                                                  |
///     +------------------------------------ cables ---------------------------------------+
///
/// stepped by SYNC periods. In lock-step the solver's budget is its iterations, time is simulated,
/// and the same scene gives the same bits; in real time the solver also has a deadline.

namespace mantle::loop {

/// The plant of a scene: its robot with the mismatch that the controller does not know.
model::Robot PlantRobot(const scene::Scene& scene);

struct ClosedLoopOptions {
  bool real_time{false};
  std::optional<controller::ControllerKind> controller;  ///< instead of the scene's
  std::optional<std::string> bus;
  firmware_sim::CandumpWriter* record{nullptr};
};

/// What happens at a SYNC, for telemetry; references are valid during the call. At the end of a run
/// there is no command any more: the last ones stand.
struct LoopStep {
  double time_s;
  bool planned;  ///< the controller made a new plan at this instant
  const reduced::ReducedState& truth;
  const reduced::ReducedState& estimate;
  const model::VectorX& command_n;  ///< tensions asked for
  std::span<const MotorCommand> torques;
  const model::VectorX& tension_n;  ///< tensions that the drums pull with
  const controller::Disturbance& disturbance;
  const Vehicle& vehicle;
  const controller::Mpc* mpc;  ///< null for baselines
  double cost;                 ///< integral of the stage cost so far
  double error;                ///< LoopResult::error_name
};

class ClosedLoop {
 public:
  /// Throws BadScene where the scene has no [control] or [time]; as Vehicle and ReducedModel do.
  ClosedLoop(const scene::Scene& scene, const ClosedLoopOptions& options = {});

  /// Brings the drives up, runs to the scene's duration, takes them down. `observer` sees every
  /// SYNC and the end; returning false ends the run there (not an error).
  LoopResult Run(const std::function<bool(const LoopStep&)>& observer = {});

  const model::Plant& plant() const { return plant_; }
  const reduced::ReducedPlant& reduced() const { return model_; }
  const controller::Reference& reference() const { return reference_; }
  Vehicle& vehicle() { return vehicle_; }

 private:
  /// The vehicle's state at t, as it truly is.
  model::StepStatus Read(double t_s);
  void Turn(long cycle, LoopResult* result);
  /// Between two SYNCs.
  model::StepStatus Advance(LoopResult* result);
  LoopStep StepNow(bool planned, double error, const LoopResult& result) const;
  void Conclude(LoopResult* result);
  void Command(double t_s, const reduced::ReducedState* estimate, LoopResult* result);
  void AskForTorques();

  scene::Scene scene_;
  controller::ControlOptions control_;
  ClosedLoopOptions options_;
  model::Plant plant_;
  reduced::ReducedPlant model_;
  reduced::StepSettings step_;
  controller::Reference reference_;
  std::unique_ptr<controller::Controller> controller_;
  reduced::Projection projection_;
  controller::Sensors sensors_;
  controller::Estimator estimator_;
  Vehicle vehicle_;
  LoopAccount account_;
  reduced::ReducedState truth_;
  model::VectorX command_, asked_, before_, tension_, held_;
  std::vector<MotorCommand> torques_;
  std::vector<controller::TensionLoop> tension_loops_;
  std::vector<double> work_before_j_;
  long control_every_;
};

}  // namespace mantle::loop
