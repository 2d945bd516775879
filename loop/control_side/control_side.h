#pragma once

#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "controller/controller.h"
#include "controller/estimator.h"
#include "controller/reference.h"
#include "controller/tension_loop.h"
#include "loop/control_side/motor_health.h"
#include "loop/control_side/motor_master.h"
#include "loop/control_side/planner.h"
#include "loop/messages.h"

namespace mantle::loop {

/// What a control side is made of.
struct ControlSetup {
  const reduced::ReducedModel& model;  ///< that it believes in; must outlive it
  reduced::StepSettings step;          ///< of the model
  controller::ControlOptions control;
  controller::SensorOptions sensors;  ///< what the estimator is told of them
  DriveOptions drives;
  firmware_sim::SupervisorOptions supervisor{};
  /// The solver gets a deadline, and a controller that can plans in a thread of its own
  /// (planner.h).
  bool real_time{false};
};

/// Figures of the control side's run.
struct ControlCounters {
  long limit_touches{0};  ///< motor periods in which a bound or rate cut what was commanded
  long iterations{0};     ///< of the solver, over all plans
  std::vector<double> prepare_s, solve_s;  ///< of every plan, by the wall clock
  // With a planner in a thread of its own; zero without.
  long late_plans{0};       ///< that were not there when they should have begun
  long overtaken_plans{0};  ///< measurements that were never planned for
  long stuck_cycles{0};     ///< in which tensions were let go, since no plan came any more
};

/// The control's side of the wire: it would run a vehicle.
///
///   Sensors -> estimator -> controller -> limits -> tension loops -> torques -> master -> CAN
///                  ^            ^           ^            ^                          |
///                  | actual tensions        | of lost motors: none                  |
///                  +------- motor health ---+------------+--------- reports --------+
///
/// In real time a controller that can plans in a thread of its own, and a Turn never waits for it:
/// a plan acts from control.delay after its measurement on, or, where it comes later, from then on.
/// Until a plan begins the motors get what it counts on, so that with no plan late the commands are
/// those of a run in lock-step. Without a new plan for kStuck_s the tensions go to their lower
/// limits.
///
/// It learns of the vehicle by sensor messages and CAN frames alone; the rest is what it believes:
/// the reduced model, the drives' data sheet, the motors' gangs.
class ControlSide {
 public:
  /// `bus` must outlive it. Throws as MotorMaster and MakeController do.
  ControlSide(const ControlSetup& setup, firmware_sim::Bus& bus);
  ControlSide(const ControlSide&) = delete;
  ControlSide& operator=(const ControlSide&) = delete;

  MotorMaster& motors() { return motors_; }
  const MotorMaster& motors() const { return motors_; }

  static constexpr double kStuck_s = 0.5;

  /// From a message with a state: a new run begins there; the first plan is under way.
  void Begin(const Sensors& message);
  /// Begin was called, and the first plan is there.
  bool begun() const;
  /// For the SYNC of the message, once its motors are ready: estimate, plan (every control period),
  /// tensions, and the torques that the motors get. Begins where Begin was not called.
  void Turn(const Sensors& message);
  /// The next message begins a new run.
  void Reset() { stage_ = Stage::kNone; }
  /// Between a Turn and the next: what a plan needs that the next message does not change.
  void PrepareNext();

  bool planned() const { return planned_; }                     ///< the last Turn made a new plan
  const model::VectorX& command_n() const { return command_; }  ///< tensions commanded last
  const model::VectorX& before_n() const { return before_; }    ///< a period before
  std::span<const MotorCommand> torques() const { return torques_; }
  const reduced::ReducedState& estimate() const { return estimator_->state(); }
  const controller::Disturbance& disturbance() const { return estimator_->disturbance(); }
  /// Estimator::covariance.
  const Eigen::MatrixXd* covariance() const { return estimator_->covariance(); }
  controller::EstimatorCounters estimator_counters() const { return estimator_->counters(); }
  /// Null where the controller makes no plans. Its values are the planner's while one runs.
  const controller::Mpc* mpc() const { return controller_->mpc(); }
  /// Which motors pull, and what they pull.
  const MotorHealth& health() const { return health_; }
  const ControlCounters& counters() const { return counters_; }
  /// Null where plans are made within Turn.
  Planner* planner() { return planner_ ? &*planner_ : nullptr; }
  /// Ends the planner's thread, and takes its figures into counters().
  void StopPlanner();
  const controller::ControlOptions& options() const { return control_; }
  const controller::Reference& reference() const { return reference_; }

 private:
  enum class Stage : std::uint8_t { kNone, kBegun, kRunning };

  long CycleAt(double t_s) const;
  void Examine();
  void Plan(double t_s);
  void WatchPlanner();
  void Command(double t_s);
  void SetTorques(const Sensors& message);

  controller::ControlOptions control_;
  reduced::StepSettings step_;
  DriveOptions drives_;
  bool real_time_;
  controller::Reference reference_;
  controller::SensorOptions sensors_;
  std::unique_ptr<controller::Controller> controller_;
  std::unique_ptr<controller::Estimator> estimator_;
  MotorMaster motors_;
  std::vector<double> gain_square_;  ///< G of every motor: its tension is G u at the drum
  std::vector<controller::TensionLoop> tension_loops_;
  MotorHealth health_;
  std::vector<MotorEvidence> evidence_;
  model::VectorX command_, before_, unlimited_, held_;
  std::vector<MotorCommand> torques_;
  ControlCounters counters_;
  long every_;             ///< SYNC periods per control period
  long delay_cycles_;      ///< from a measurement until its plan acts
  long cycle_{0};          ///< of the last Turn; that of t = 0 is 0
  long planned_cycle_{0};  ///< of the measurement that was planned for last
  long late_cycle_{-1};    ///< of the last one whose plan was counted as late
  long answered_{0};       ///< of the newest one that was seen to be answered
  Stage stage_{Stage::kNone};
  bool planned_{false}, stuck_{false};
  std::optional<Planner> planner_;  ///< last: it uses what stands above
};

}  // namespace mantle::loop
