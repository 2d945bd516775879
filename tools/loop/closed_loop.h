#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "controller/controller.h"
#include "controller/estimator.h"
#include "controller/sensors.h"
#include "controller/tension_loop.h"
#include "model/scene.h"
#include "reduced/projection.h"
#include "tools/loop/vehicle.h"

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
model::Robot PlantRobot(const model::Scene& scene);

struct ClosedLoopOptions {
  bool real_time{false};
  std::optional<model::ControllerKind> controller;  ///< instead of the scene's
  std::optional<std::string> bus;
  firmware_sim::CandumpWriter* record{nullptr};
};

/// What happened in one SYNC period, for telemetry; references are valid during the call.
struct LoopStep {
  double time_s;
  bool planned;  ///< the controller made a new plan at this instant
  const reduced::ReducedState& truth;
  const reduced::ReducedState& estimate;
  const model::VectorX& command_n;  ///< tensions asked for
  const model::VectorX& tension_n;  ///< tensions that the drums pull with
  const model::VectorX& bias_n;
  const Vehicle& vehicle;
  const controller::Mpc* mpc;  ///< null for baselines
  double cost;                 ///< integral of the stage cost so far
};

struct WaypointResult {
  double distance_m;  ///< least distance of the root
  double time_s;      ///< when
  bool passed;        ///< within the tolerance, after the one before
};

struct LoopResult {
  bool ok{false};
  std::string reason;
  double time_s{0}, wall_s{0};
  double cost{0};  ///< integral of the stage cost (model/control.h) over the true states
  /// Distance of the root from its reference, of the tip from its (after the approach), speed's
  /// error over a pulse [m, m, m/s]: mean and largest; and at the end.
  double mean_error{0}, max_error{0}, final_error{0};
  std::string error_name;  ///< "position_m", "tip_m", "mean_speed_m_s"
  std::vector<WaypointResult> waypoints;
  double effort_n2_s{0};      ///< integral of the sum of squares of the tensions asked for
  double cable_work_j{0};     ///< that drums did on cables, positive part of the powers
  double mean_speed_m_s{0};   ///< of the root along its path
  double energetic_index{0};  ///< mean of W_o over mean of W_i ([physics.md] 5)
  double tension_error_n{0};  ///< root mean square of pulled minus asked, over all motors
  long limit_touches{0};      ///< motor periods in which a bound or rate cut what was asked
  long cycles{0};
  std::vector<double> prepare_s, solve_s;  ///< of every plan
  controller::MpcCounters counters;
  long late_cycles{0};
  double bus_load{0};  ///< share of 1 Mbit/s, worst case of stuffing
  model::Sample last;
};

class ClosedLoop {
 public:
  /// Throws BadScene where the scene has no [control] or [time]; as Vehicle and ReducedModel do.
  ClosedLoop(const model::Scene& scene, const ClosedLoopOptions& options = {});

  /// Brings the drives up, runs to the scene's duration, takes them down. `observer` sees every
  /// SYNC period; returning false ends the run there (not an error).
  LoopResult Run(const std::function<bool(const LoopStep&)>& observer = {});

  const model::Plant& plant() const { return plant_; }
  const reduced::ReducedModel& reduced() const { return model_; }
  const controller::Reference& reference() const { return reference_; }
  Vehicle& vehicle() { return vehicle_; }

 private:
  model::StepStatus Turn(long cycle, LoopResult* result);
  void Account(LoopResult* result);
  void Command(double t_s, const reduced::ReducedState* estimate, LoopResult* result);
  void AskForTorques();

  model::Scene scene_;
  model::ControlOptions control_;
  ClosedLoopOptions options_;
  model::Plant plant_;
  reduced::ReducedModel model_;
  reduced::StepSettings step_;
  controller::Reference reference_;
  controller::StageCost cost_;
  std::unique_ptr<controller::Controller> controller_;
  reduced::Projection projection_;
  controller::Sensors sensors_;
  controller::Estimator estimator_;
  controller::BiasEstimator bias_;
  controller::PositionHistory history_;
  Vehicle vehicle_;
  reduced::ReducedState truth_;
  model::VectorX command_, asked_, before_, tension_, pulled_, residual_;
  std::vector<MotorCommand> torques_;
  std::vector<controller::TensionLoop> tension_loops_;
  std::vector<double> work_before_j_;
  long control_every_;
  double pulled_s_{0}, travelled_m_{0}, output_j_{0}, input_j_{0}, squared_error_{0};
  model::Vector3 position_before_{model::Vector3::Zero()};
  double error_time_s_{0};
};

}  // namespace mantle::loop
