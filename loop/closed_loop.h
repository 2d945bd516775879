#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "loop/control_side/control_side.h"
#include "loop/lock_step.h"
#include "loop/loop_account.h"
#include "loop/plant_side/plant_vehicle.h"
#include "loop/real_time_run.h"
#include "loop/scene/scene.h"
#include "loop/sensor_channel.h"
#include "loop/wire.h"
#include "reduced/build/reduced_plant.h"

namespace mantle::loop {

/// The plant of a scene: its robot with the mismatch that the controller does not know.
model::Robot PlantRobot(const scene::Scene& scene);

/// The robot that the controller believes in: of the scene's own, without a mismatch and in water
/// at rest. A current it has to find out.
model::Robot BelievedRobot(const scene::Scene& scene);

/// How a closed loop is run, and what of its scene is replaced.
struct ClosedLoopOptions {
  bool real_time{false};                         ///< on the wall clock; else in lock-step
  std::optional<std::string> controller;         ///< instead of the scene's, as control.controller
  std::optional<std::string> bus;                ///< instead of the scene's, as drives.bus
  firmware_sim::CandumpWriter* record{nullptr};  ///< as Wire takes it
};

/// The full plant at an instant, for telemetry; valid during the call that hands it out.
struct PlantView {
  const model::Sample& sample;
  const model::PlantState& state;
  const model::EnergyAccount& energy;
};

/// What happens at a SYNC, for telemetry; references are valid during the call. All places and
/// velocities are the earth's. At the end of a run
/// there is no command any more: the last ones stand. In real time all of it are copies.
struct LoopStep {
  double time_s;                       ///< of the SYNC, from t = 0
  bool planned;                        ///< the controller made a new plan at this instant
  const reduced::ReducedState& truth;  ///< or what is known of it, see VehicleSide
  const reduced::ReducedState& estimate;
  const model::VectorX& command_n;        ///< tensions commanded
  std::span<const MotorCommand> torques;  ///< one per motor
  const model::VectorX& tension_n;        ///< actual tensions, that the drums pull with
  const controller::Disturbance& disturbance;
  const PlantSide* plant;  ///< what of it stays; null where the vehicle is of a user's own
  std::span<const firmware_sim::DriveReport> reports;  ///< one per motor
  std::span<const double> reeled_m;                    ///< MotorMaster::ReportedReel_m
  // Null for baselines; in real time also at a SYNC whose plan is none.
  const controller::Plan* plan;
  const controller::MpcStatus* solver;
  const controller::MpcCounters* solver_counters;
  const model::VectorX& variance;     ///< diagonal of Estimator::covariance; empty without
  const FastLoopCounters* fast_loop;  ///< so far; null in lock-step
  double cost;                        ///< integral of the stage cost so far
  double error;                       ///< LoopResult::error_name
  /// The plant as of now; in real time at output instants alone (scene::Scene::run), else null, and
  /// null where the vehicle is of a user's own.
  const std::function<std::optional<PlantView>()>& look;
};

/// The closed loop of a scene with a table [control], both sides in one process:
///
///   plant side                                        control side
///   plant -> instruments == Sensors (channel) ==> estimator -> controller -> limits
///     ^ cables                                                                 | torques
///   drives <================== CAN (wire) ======================= master <-----+
///
/// (or, on the left, a vehicle of a user's own: vehicle_side.h)
///
/// stepped by SYNC periods. In lock-step the solver's budget is its iterations, time is simulated,
/// and the same scene gives the same bits; in real time either side and the planner have threads of
/// their own, and the wall clock (real_time_run.h).
class ClosedLoop {
 public:
  /// Throws BadScene where the scene has no [control] or [time]; as the two sides and ReducedModel
  /// do.
  ClosedLoop(const scene::Scene& scene, const ClosedLoopOptions& options = {});

  /// Brings the drives up, runs to the scene's duration, takes them down. `observer` sees every
  /// SYNC and the end; returning false ends the run there (not an error).
  LoopResult Run(const std::function<bool(const LoopStep&)>& observer = {});

  const model::Plant& plant() const { return plant_; }
  const reduced::ReducedPlant& reduced() const { return model_; }
  const controller::Reference& reference() const { return control_side_.reference(); }
  /// Plant and drives. Throws std::logic_error where the vehicle is of a user's own.
  PlantSide& plant_side();
  const VehicleSide& vehicle() const { return *vehicle_; }
  const ControlSide& control_side() const { return control_side_; }

 private:
  std::unique_ptr<VehicleSide> MakeVehicle();
  /// Between two SYNCs.
  Status Advance(LoopResult* result);
  /// The message of now, from instruments to control.
  void PassSensors();
  LoopStep StepNow(bool planned, double error, const LoopResult& result);
  LoopResult RunInLockStep(const std::function<bool(const LoopStep&)>& observer);
  LoopResult RunInRealTime(const std::function<bool(const LoopStep&)>& observer);
  bool OnRealTimeStep(const RealTimeRun::Step& step, LoopResult* result,
                      const std::function<bool(const LoopStep&)>& observer);
  void AddCableWork(std::span<const double> work_j, LoopResult* result);
  void TakeReports();
  void Conclude(LoopResult* result);
  std::string Ending(const LoopResult& result) const;

  scene::Scene scene_;
  bool real_time_;
  model::Plant plant_;
  reduced::ReducedPlant model_;
  Wire wire_;
  std::optional<GatedBus> gate_;  ///< in real time
  std::unique_ptr<VehicleSide> vehicle_;
  PlantVehicle* plant_vehicle_;  ///< the same, or null where it is of a user's own
  SensorChannel channel_;
  ControlSide control_side_;
  LockStep lock_step_;
  LoopAccount account_;
  Sensors measured_, received_;
  std::vector<double> work_before_j_, work_j_;
  // Of a step.
  std::vector<firmware_sim::DriveReport> reports_;
  std::vector<double> reeled_m_;
  model::VectorX variance_;
  std::optional<model::Sample> sample_;
  std::function<std::optional<PlantView>()> look_;
  // Of the newest plan in real time.
  controller::MpcStatus solver_;
  controller::MpcCounters solver_counters_;
};

}  // namespace mantle::loop
