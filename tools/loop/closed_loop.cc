#include "tools/loop/closed_loop.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>

#include "firmware_sim/bus_load.h"

namespace mantle::loop {
namespace {

using model::VectorX;

constexpr double kStepTolerance = 1e-6;  // of the controller's own model, see StepSettings
constexpr double kCut_n = 1e-6;          // a limit that changes a tension by more has touched
constexpr double kSlidingRate_m_s = 2e-3;

std::int64_t Now_ns() {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(
             std::chrono::steady_clock::now().time_since_epoch())
      .count();
}

const model::Scene& Checked(const model::Scene& scene) {
  if (!scene.control) {
    throw model::BadScene(scene.name +
                          ": control: table is missing: a closed loop needs [control]");
  }
  if (!scene.has_time) {
    throw model::BadScene(scene.name +
                          ": time: table is missing: a closed loop needs [time] with `duration`");
  }
  const double share = scene.control->period_s / scene.drives.period_s;
  if (share < 1 - 1e-9 || std::abs(share - std::round(share)) > 1e-6) {
    throw model::BadScene(
        fmt::format("{}: control.period: {} s: must be a multiple of drives.period, {} s",
                    scene.name, scene.control->period_s, scene.drives.period_s));
  }
  return scene;
}

model::DriveOptions DrivesOf(const model::Scene& scene, const ClosedLoopOptions& options) {
  model::DriveOptions drives = scene.drives;
  if (options.bus) drives.bus = *options.bus;
  return drives;
}

model::ControlOptions ControlOf(const model::Scene& scene, const ClosedLoopOptions& options) {
  model::ControlOptions control = *scene.control;
  if (options.controller) control.controller = *options.controller;
  return control;
}

VehicleOptions VehicleOf(const ClosedLoopOptions& options) {
  VehicleOptions v;
  v.real_time = options.real_time;
  v.record = options.record;
  return v;
}

}  // namespace

model::Robot PlantRobot(const model::Scene& scene) {
  model::Robot robot = scene.robot;
  const model::Mismatch& m = scene.mismatch;
  for (model::Arm& arm : robot.arms) {
    arm.material.young_pa *= m.young;
    arm.material.viscosity_pa_s *= m.viscosity;
    if (arm.stiffness) *arm.stiffness *= m.young;
    if (arm.viscosity) *arm.viscosity *= m.viscosity;
    arm.drag_coefficients *= m.drag;
    arm.added_mass_coefficient *= m.added_mass;
  }
  if (robot.mantle) {
    robot.mantle->material.young_pa *= m.young;
    robot.mantle->material.viscosity_pa_s *= m.viscosity;
    robot.mantle->drag_coefficient *= m.drag;
    robot.mantle->added_mass_coefficient *= m.added_mass;
    robot.mantle->nozzle_radius_m /= std::sqrt(m.jet);  // thrust goes with 1 / A_n
  }
  if (robot.effects.lateral_drag) robot.effects.lateral_drag->coefficient *= m.drag;
  if (robot.effects.roll_drag) robot.effects.roll_drag->coefficient_n_m_s2 *= m.drag;
  if (robot.effects.rigid_drag) {
    robot.effects.rigid_drag->lateral_coefficient *= m.drag;
    robot.effects.rigid_drag->axial_coefficient *= m.drag;
  }
  return robot;
}

ClosedLoop::ClosedLoop(const model::Scene& scene, const ClosedLoopOptions& options)
    : scene_(Checked(scene)),
      control_(ControlOf(scene, options)),
      options_(options),
      plant_(PlantRobot(scene)),
      model_(scene.robot, scene.reduction),
      step_{scene.reduction.scheme, std::max(scene.reduction.tolerance, kStepTolerance)},
      reference_(control_.goal, scene_.robot),
      cost_(model_, control_, reference_),
      controller_(controller::MakeController({model_, step_, control_, reference_})),
      projection_(model_),
      sensors_(model_, scene.sensors),
      estimator_(model_, step_, control_.estimator),
      bias_(model_, step_, control_.estimator, control_.motors),
      history_(control_.gait.period_s + 1.0),
      vehicle_(plant_, scene.run, scene.reduction.actuators, DrivesOf(scene, options),
               VehicleOf(options)),
      truth_(InitialState(model_)) {
  const int motors = model_.input_count();
  command_.setZero(motors);
  for (int i = 0; i < motors; ++i) command_(i) = control_.motors[i].min_tension_n;
  before_ = command_;
  tension_ = pulled_ = VectorX::Zero(motors);
  residual_.setZero(cost_.rows());
  torques_.resize(motors);
  for (int i = 0; i < motors; ++i) {
    tension_loops_.emplace_back(
        vehicle_.winch_map(),
        controller::TensionLoopOptions{scene_.drives.period_s, scene_.drives.cable_stiffness_n_m,
                                       scene_.drives.cable_damping_n_s_m});
  }
  work_before_j_.assign(motors, 0.0);
  control_every_ = std::lround(control_.period_s / scene.drives.period_s);
}

// Tension and torque of every motor for the SYNC at t.
void ClosedLoop::Command(double t_s, const reduced::ReducedState* estimate, LoopResult* result) {
  const double period = scene_.drives.period_s;
  before_ = command_;
  controller_->Command(t_s + period, estimate, command_);
  for (Eigen::Index i = 0; i < command_.size(); ++i) {
    if (!std::isfinite(command_(i))) command_(i) = before_(i);
  }
  asked_ = command_;
  controller::LimitTensions(control_.motors, before_, period, command_);
  result->limit_touches += ((asked_ - command_).array().abs() > kCut_n).count();
  AskForTorques();
}

// The drives' torques from the wanted tensions, each cable's measured length and what its drive
// reported.
void ClosedLoop::AskForTorques() {
  for (int i = 0; i < vehicle_.motor_count(); ++i) {
    const Reel& reel = vehicle_.reel(i);
    controller::TensionLoopInput in;
    in.tension_n = reel.gain_square * before_(i);
    in.tension_rate_n_s = reel.gain_square * (command_(i) - before_(i)) / scene_.drives.period_s;
    in.length_m = sensors_.MeasureCable(vehicle_.length_m(i) - reel.rest_length_m);
    in.length_rate_m_s = sensors_.MeasureCableRate(vehicle_.length_rate_m_s(i));
    in.reported_m = vehicle_.ReportedReel_m(i);
    in.reported_rate_m_s = vehicle_.ReportedRate_m_s(i);
    torques_[i].torque_permille =
        static_cast<std::int16_t>(std::lround(tension_loops_[i].Update(in)));
  }
}

model::StepStatus ClosedLoop::Turn(long cycle, LoopResult* result) {
  const double t = static_cast<double>(cycle) * scene_.drives.period_s;
  if (!projection_.Project(vehicle_.state(), &truth_)) {
    model::StepStatus status;
    status.ok = false;
    status.reason = "the plant's state could not be projected: an element turned too far";
    return status;
  }
  truth_.time_s = t;
  const auto measured = sensors_.Measure(truth_);
  for (int i = 0; i < vehicle_.motor_count(); ++i) {
    tension_(i) = vehicle_.drum_tension_n(i) / vehicle_.reel(i).gain_square;
  }
  if (cycle == 0) {
    estimator_.Start(measured ? *measured : truth_);
    bias_.Start(estimator_.state());
    controller_->Start(estimator_.state());
  } else {
    estimator_.Update(t, command_, measured ? &*measured : nullptr);
    pulled_ += command_;
    ++pulled_s_;
  }
  const reduced::ReducedState* estimate = &estimator_.state();
  if (cycle % control_every_ == 0) {
    if (pulled_s_ > 0) bias_.Update(*estimate, pulled_ / pulled_s_);
    pulled_.setZero();
    pulled_s_ = 0;
    const std::int64_t deadline =
        options_.real_time ? Now_ns() + static_cast<std::int64_t>(1e9 * control_.deadline_s) : 0;
    controller_->Update(t, estimate, command_, bias_.bias(), deadline);
    if (const controller::Mpc* mpc = controller_->mpc()) {
      result->prepare_s.push_back(mpc->status().prepare_s);
      result->solve_s.push_back(mpc->status().solve_s);
    }
  }
  Command(t, estimate, result);
  return {};
}

// Costs and errors over the period that begins now.
void ClosedLoop::Account(LoopResult* r) {
  const double t = truth_.time_s, dt = scene_.drives.period_s;
  const controller::ReferencePoint ref = reference_.At(t);
  cost_.Evaluate(truth_, &residual_, nullptr);
  history_.Add(t, truth_.root.position);
  double stage = cost_.Value(residual_) + cost_.InputValue(command_, (command_ - before_) / dt);
  double error = 0;
  bool counts = true;
  if (reference_.has_position()) {
    r->error_name = "position_m";
    error = (truth_.root.position - ref.position).norm();
    const auto& goal = std::get<model::PathTask>(control_.goal);
    for (std::size_t i = 0; i < goal.waypoints.size(); ++i) {
      WaypointResult& w = r->waypoints[i];
      if (i > 0 && !r->waypoints[i - 1].passed) break;
      const double distance = (truth_.root.position - goal.waypoints[i]).norm();
      if (distance < w.distance_m) {
        w.distance_m = distance;
        w.time_s = t;
        w.passed = distance <= goal.tolerance_m;
      }
    }
  } else if (reference_.has_tip()) {
    r->error_name = "tip_m";
    const int a = reference_.arm();
    const model::Pose tip =
        AbsolutePose(plant_, vehicle_.state(), a, plant_.rods[a].element_count());
    error = (tip.position - ref.tip).norm();
    counts = t >= reference_.SettledTime();
  } else {
    r->error_name = "mean_speed_m_s";
    const double period = control_.gait.period_s;
    const model::Vector3 mean = (truth_.root.position - history_.At(t - period)) / period;
    error = (mean - ref.velocity).norm();
    counts = t >= period;
  }
  if (cost_.has_mean_velocity()) {
    const double period = control_.gait.period_s;
    const model::Vector3 mean = (truth_.root.position - history_.At(t - period)) / period;
    stage += control_.cost.mean_velocity * (mean - ref.velocity).squaredNorm();
  }
  r->cost += dt * stage;
  r->final_error = error;
  if (counts) {
    r->mean_error += dt * error;
    error_time_s_ += dt;
    r->max_error = std::max(r->max_error, error);
  }
  r->effort_n2_s += dt * command_.squaredNorm();
  squared_error_ += (tension_ - before_).squaredNorm();
  travelled_m_ += (truth_.root.position - position_before_).norm();
  position_before_ = truth_.root.position;
}

LoopResult ClosedLoop::Run(const std::function<bool(const LoopStep&)>& observer) {
  LoopResult r;
  const auto begin = std::chrono::steady_clock::now();
  if (const auto* goal = std::get_if<model::PathTask>(&control_.goal)) {
    r.waypoints.assign(goal->waypoints.size(),
                       {std::numeric_limits<double>::infinity(), 0.0, false});
  }
  const int motors = vehicle_.motor_count();
  r.bus_load = 0;
  model::StepStatus status = vehicle_.BringUp();
  history_.Reset(0.0, scene_.robot.root_pose.position);
  position_before_ = scene_.robot.root_pose.position;
  const long cycles = std::lround(scene_.run.duration_s / scene_.drives.period_s);
  long cycle = 0;
  for (int i = 0; status.ok && i < motors; ++i) work_before_j_[i] = vehicle_.winch(i).cable_work_j;
  for (; status.ok && cycle < cycles; ++cycle) {
    status = Turn(cycle, &r);
    if (!status.ok) break;
    Account(&r);
    if (observer) {
      const LoopStep step{truth_.time_s,
                          cycle % control_every_ == 0,
                          truth_,
                          estimator_.state(),
                          command_,
                          tension_,
                          bias_.bias(),
                          vehicle_,
                          controller_->mpc(),
                          r.cost};
      if (!observer(step)) break;
    }
    status = vehicle_.Cycle(torques_);
    for (int i = 0; i < motors; ++i) {
      const double work = vehicle_.winch(i).cable_work_j;
      r.cable_work_j += std::max(work - work_before_j_[i], 0.0);
      work_before_j_[i] = work;
    }
  }
  r.ok = status.ok;
  r.reason = status.reason;
  r.cycles = cycle;
  r.time_s = static_cast<double>(cycle) * scene_.drives.period_s;
  if (error_time_s_ > 0) r.mean_error /= error_time_s_;
  if (cycle > 0) {
    r.tension_error_n =
        std::sqrt(squared_error_ / static_cast<double>(cycle) / static_cast<double>(motors));
    r.mean_speed_m_s = travelled_m_ / r.time_s;
  }
  if (const controller::Mpc* mpc = controller_->mpc()) r.counters = mpc->counters();
  r.late_cycles = vehicle_.pacer().late_turns();
  if (status.ok) {
    r.last = vehicle_.Observe();
    const model::StepStatus stopped = vehicle_.Stop();
    if (!stopped.ok) {
      r.ok = false;
      r.reason = stopped.reason;
    }
  }
  r.wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  return r;
}

}  // namespace mantle::loop
