#include "loop/control_side/control_side.h"

#include <algorithm>
#include <chrono>
#include <cmath>

#include "controller/plan.h"
#include "controller/registry.h"

namespace mantle::loop {
namespace {

using model::VectorX;

constexpr double kCut_n = 1e-6;  // a limit that changes a tension by more has touched

std::int64_t Now_ns() {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(
             std::chrono::steady_clock::now().time_since_epoch())
      .count();
}

controller::ControlOptions Effective(controller::ControlOptions control) {
  // What has no use for what the model missed does without, unless that helps to filter.
  const bool used = controller::FindController(control.controller).uses_disturbance;
  if (!used && !control.estimator.observer) control.estimator.disturbance = false;
  return control;
}

std::vector<double> GainSquares(const reduced::ReducedModel& model) {
  std::vector<double> squares;
  for (const reduced::Actuator& motor : model.actuators) {
    double& sum = squares.emplace_back(0.0);
    for (const reduced::ActuatorTarget& target : motor.targets) sum += target.gain * target.gain;
  }
  return squares;
}

}  // namespace

ControlSide::ControlSide(const ControlSetup& setup, firmware_sim::Bus& bus)
    : control_(Effective(setup.control)),
      step_(setup.step),
      drives_(setup.drives),
      real_time_(setup.real_time),
      reference_(control_.goal, setup.model.robot),
      sensors_(setup.sensors),
      controller_(controller::MakeController({setup.model, step_, control_, reference_})),
      estimator_(controller::MakeEstimator(
          {setup.model, step_, control_.estimator, sensors_, control_.motors})),
      motors_(bus, setup.model.input_count(), setup.drives, setup.supervisor),
      gain_square_(GainSquares(setup.model)),
      health_(motors_.winch_map(), control_.motors, gain_square_, setup.drives.period_s),
      evidence_(gain_square_.size()) {
  const int motors = setup.model.input_count();
  command_.setZero(motors);
  for (int i = 0; i < motors; ++i) command_(i) = control_.motors[i].min_tension_n;
  before_ = unlimited_ = command_;
  held_ = VectorX::Zero(motors);
  torques_.resize(motors);
  for (int i = 0; i < motors; ++i) {
    tension_loops_.emplace_back(
        motors_.winch_map(),
        controller::TensionLoopOptions{drives_.period_s, drives_.cable_stiffness_n_m,
                                       drives_.cable_damping_n_s_m});
  }
  every_ = std::lround(control_.period_s / drives_.period_s);
  delay_cycles_ =
      std::max(1L, static_cast<long>(std::ceil(control_.delay_s / drives_.period_s - 1e-6)));
  if (real_time_ && controller_->plans_apart()) {
    planner_.emplace(*controller_, control_.deadline_s, InitialState(setup.model), control_.motors);
  }
}

long ControlSide::CycleAt(double t_s) const { return std::lround(t_s / drives_.period_s); }

void ControlSide::Begin(const Sensors& message) {
  estimator_->Start(message.state);
  cycle_ = planned_cycle_ = answered_ = CycleAt(message.time_s);
  late_cycle_ = -1;
  if (planner_) {
    planner_->PostStart(estimator_->state());
    planner_->PostUpdate(cycle_, message.time_s, estimator_->state(), command_);
  } else {
    controller_->Start(estimator_->state());
  }
  stage_ = Stage::kBegun;
}

bool ControlSide::begun() const {
  return stage_ != Stage::kNone && (!planner_ || planner_->answered() == cycle_);
}

void ControlSide::Turn(const Sensors& message) {
  const double t = message.time_s;
  const reduced::ReducedState* measured = message.has_state ? &message.state : nullptr;
  if (stage_ == Stage::kNone) Begin(message);
  const bool first = stage_ == Stage::kBegun && (!real_time_ || CycleAt(t) <= cycle_);
  stage_ = Stage::kRunning;
  if (first) {
    planned_ = true;
    if (!planner_) Plan(t);
  } else {
    // In real time a period may have been missed.
    cycle_ = real_time_ ? std::max(cycle_ + 1, CycleAt(t)) : cycle_ + 1;
    Examine();
    // From the one to the other since the last SYNC, but for what the drives say was not pulled.
    held_ = 0.5 * (before_ + command_) + health_.missing_n();
    estimator_->Update(t, held_, measured);
    planned_ = cycle_ / every_ != planned_cycle_ / every_;
    if (planned_) Plan(t);
  }
  if (planner_) WatchPlanner();
  Command(t);
  SetTorques(message);
}

// What the motors did since the last SYNC, and what may be asked of them.
void ControlSide::Examine() {
  for (int i = 0; i < motors_.motor_count(); ++i) {
    evidence_[i] = {&motors_.report(i), gain_square_[i] * before_(i),
                    tension_loops_[i].tension_n()};
  }
  health_.Update(evidence_);
  health_.UpdateBias(estimator_->disturbance().bias_n, controller::StateFilter::kMostBias);
  if (!health_.changed()) return;
  if (planner_) {
    planner_->SetLimits(health_.limits());
  } else {
    controller_->SetLimits(health_.limits());
  }
}

void ControlSide::Plan(double t_s) {
  planned_cycle_ = cycle_;
  if (planner_) {
    planner_->PostUpdate(cycle_, t_s, estimator_->state(), command_);
    return;
  }
  const std::int64_t deadline =
      real_time_ ? Now_ns() + static_cast<std::int64_t>(1e9 * control_.deadline_s) : 0;
  controller_->Update(t_s, &estimator_->state(), command_, deadline);
  if (const controller::Mpc* mpc = controller_->mpc()) {
    counters_.prepare_s.push_back(mpc->status().prepare_s);
    counters_.solve_s.push_back(mpc->status().solve_s);
    counters_.iterations += mpc->status().iterations;
  }
}

// Whether the plan that should act by now is there, and whether any has come of late.
void ControlSide::WatchPlanner() {
  const long answered = planner_->answered();
  if (answered > answered_) answered_ = answered;
  const bool due = cycle_ >= planned_cycle_ + delay_cycles_;
  if (due && answered_ < planned_cycle_ && late_cycle_ != planned_cycle_) {
    late_cycle_ = planned_cycle_;
    ++counters_.late_plans;
  }
  stuck_ =
      static_cast<double>(cycle_ - answered_) * drives_.period_s > control_.period_s + kStuck_s;
  if (stuck_) ++counters_.stuck_cycles;
}

void ControlSide::StopPlanner() {
  if (!planner_) return;
  planner_->Stop();
  const PlannerCounters& planner = planner_->counters();
  counters_.prepare_s = planner.prepare_s;
  counters_.solve_s = planner.solve_s;
  counters_.iterations = planner.iterations;
  counters_.overtaken_plans = planner.overtaken + planner.refused;
}

// Tensions for the end of the period that begins at t.
void ControlSide::Command(double t_s) {
  before_ = command_;
  controller_->Command(t_s + drives_.period_s, &estimator_->state(), command_);
  for (Eigen::Index i = 0; i < command_.size(); ++i) {
    if (!std::isfinite(command_(i))) command_(i) = before_(i);
    if (stuck_) command_(i) = control_.motors[static_cast<std::size_t>(i)].min_tension_n;
  }
  unlimited_ = command_;
  controller::LimitTensions(health_.limits(), before_, drives_.period_s, command_);
  counters_.limit_touches += ((unlimited_ - command_).array().abs() > kCut_n).count();
}

// The drives' torques from the commanded tensions, each cable's measured length and what its drive
// reported.
void ControlSide::SetTorques(const Sensors& message) {
  for (int i = 0; i < motors_.motor_count(); ++i) {
    const double gain_square = gain_square_[i];
    controller::TensionLoopInput in;
    in.tension_n = gain_square * before_(i);
    in.tension_rate_n_s = gain_square * (command_(i) - before_(i)) / drives_.period_s;
    in.length_m = message.cables[i].length_m;
    in.length_rate_m_s = message.cables[i].rate_m_s;
    in.reported_m = motors_.ReportedReel_m(i);
    in.reported_rate_m_s = motors_.ReportedRate_m_s(i);
    torques_[i].torque_permille =
        static_cast<std::int16_t>(std::lround(tension_loops_[i].Update(in)));
  }
  motors_.SetTorques(torques_);
}

void ControlSide::PrepareNext() {
  if ((cycle_ + 1) % every_ != 0) return;
  const double next_s = static_cast<double>(cycle_ + 1) * drives_.period_s;
  if (planner_) {
    planner_->PostPrepare(next_s, command_, estimator_->disturbance());
    return;
  }
  controller_->SetDisturbance(estimator_->disturbance());
  controller_->Prepare(next_s, command_);
}

}  // namespace mantle::loop
