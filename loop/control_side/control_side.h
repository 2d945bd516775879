#pragma once

#include <memory>
#include <span>
#include <vector>

#include "controller/controller.h"
#include "controller/estimator.h"
#include "controller/reference.h"
#include "controller/tension_loop.h"
#include "loop/control_side/motor_health.h"
#include "loop/control_side/motor_master.h"
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
  bool real_time{false};  ///< the solver gets a deadline
};

/// Figures of the control side's run.
struct ControlCounters {
  long limit_touches{0};  ///< motor periods in which a bound or rate cut what was commanded
  long iterations{0};     ///< of the solver, over all plans
  std::vector<double> prepare_s, solve_s;  ///< of every plan, by the wall clock
};

/// The control's side of the wire: it would run a vehicle.
///
///   Sensors -> estimator -> controller -> limits -> tension loops -> torques -> master -> CAN
///                  ^            ^           ^            ^                          |
///                  | actual tensions        | of lost motors: none                  |
///                  +------- motor health ---+------------+--------- reports --------+
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

  /// For the SYNC of the message, once its motors are ready: estimate, plan (every control period),
  /// tensions, and the torques that the motors get. The first message starts the estimator.
  void Turn(const Sensors& message);
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
  /// Null where the controller makes no plans.
  const controller::Mpc* mpc() const { return controller_->mpc(); }
  /// Which motors pull, and what they pull.
  const MotorHealth& health() const { return health_; }
  const ControlCounters& counters() const { return counters_; }
  const controller::ControlOptions& options() const { return control_; }
  const controller::Reference& reference() const { return reference_; }

 private:
  void Examine();
  void Plan(double t_s);
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
  long every_;     ///< SYNC periods per control period
  long cycle_{0};  ///< of the last Turn; the first is 0
  bool started_{false}, planned_{false};
};

}  // namespace mantle::loop
