#include "loop/closed_loop.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>

#include "firmware_sim/bus/bus_load.h"

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

const scene::Scene& Checked(const scene::Scene& scene) {
  if (!scene.control) {
    throw scene::BadScene(scene.name +
                          ": control: table is missing: a closed loop needs [control]");
  }
  if (!scene.has_time) {
    throw scene::BadScene(scene.name +
                          ": time: table is missing: a closed loop needs [time] with `duration`");
  }
  const double share = scene.control->period_s / scene.drives.period_s;
  if (share < 1 - 1e-9 || std::abs(share - std::round(share)) > 1e-6) {
    throw scene::BadScene(
        fmt::format("{}: control.period: {} s: must be a multiple of drives.period, {} s",
                    scene.name, scene.control->period_s, scene.drives.period_s));
  }
  return scene;
}

DriveOptions DrivesOf(const scene::Scene& scene, const ClosedLoopOptions& options) {
  DriveOptions drives = scene.drives;
  if (options.bus) drives.bus = *options.bus;
  return drives;
}

controller::ControlOptions ControlOf(const scene::Scene& scene, const ClosedLoopOptions& options) {
  controller::ControlOptions control = *scene.control;
  if (options.controller) control.controller = *options.controller;
  // What has no model has no use for what the model missed, unless that helps to filter.
  const bool has_model = control.controller == controller::ControllerKind::kMpc ||
                         control.controller == controller::ControllerKind::kLqr;
  if (!has_model && !control.estimator.observer) control.estimator.disturbance = false;
  return control;
}

// Share of the wire.
double Load(std::uint64_t bits, double time_s) {
  return static_cast<double>(bits) / (time_s * static_cast<double>(firmware_sim::kBitRate));
}

VehicleOptions VehicleOf(const ClosedLoopOptions& options) {
  VehicleOptions v;
  v.real_time = options.real_time;
  v.record = options.record;
  return v;
}

}  // namespace

model::Robot PlantRobot(const scene::Scene& scene) {
  model::Robot robot = scene.robot;
  robot.mismatch = scene.mismatch;
  return robot;
}

ClosedLoop::ClosedLoop(const scene::Scene& scene, const ClosedLoopOptions& options)
    : scene_(Checked(scene)),
      control_(ControlOf(scene, options)),
      options_(options),
      plant_(PlantRobot(scene)),
      model_(scene.robot, scene.reduction),
      step_{scene.reduction.scheme, std::max(scene.reduction.tolerance, kStepTolerance)},
      reference_(control_.goal, scene_.robot),
      controller_(controller::MakeController({model_, step_, control_, reference_})),
      projection_(model_),
      sensors_(model_, scene.sensors),
      estimator_(model_, step_, control_.estimator, scene.sensors, control_.motors),
      vehicle_(plant_, scene.run, scene.reduction.actuators, DrivesOf(scene, options),
               VehicleOf(options)),
      account_(model_, control_, reference_, plant_),
      truth_(InitialState(model_)) {
  const int motors = model_.input_count();
  command_.setZero(motors);
  for (int i = 0; i < motors; ++i) command_(i) = control_.motors[i].min_tension_n;
  before_ = command_;
  tension_ = held_ = VectorX::Zero(motors);
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

model::StepStatus ClosedLoop::Read(double t_s) {
  if (!projection_.Project(vehicle_.state(), &truth_)) {
    return {false, "the plant's state could not be projected: an element turned too far"};
  }
  truth_.time_s = t_s;
  for (int i = 0; i < vehicle_.motor_count(); ++i) {
    tension_(i) = vehicle_.drum_tension_n(i) / vehicle_.reel(i).gain_square;
  }
  return {};
}

void ClosedLoop::Turn(long cycle, LoopResult* result) {
  const double t = truth_.time_s;
  const auto measured = sensors_.Measure(truth_);
  if (cycle == 0) {
    estimator_.Start(measured ? *measured : truth_);
    controller_->Start(estimator_.state());
  } else {
    held_ = 0.5 * (before_ + command_);  // from the one to the other since the last SYNC
    estimator_.Update(t, held_, measured ? &*measured : nullptr);
  }
  const reduced::ReducedState* estimate = &estimator_.state();
  if (cycle % control_every_ == 0) {
    const std::int64_t deadline =
        options_.real_time ? Now_ns() + static_cast<std::int64_t>(1e9 * control_.deadline_s) : 0;
    controller_->Update(t, estimate, command_, deadline);
    if (const controller::Mpc* mpc = controller_->mpc()) {
      result->prepare_s.push_back(mpc->status().prepare_s);
      result->solve_s.push_back(mpc->status().solve_s);
      result->iterations += mpc->status().iterations;
    }
  }
  Command(t, estimate, result);
}

model::StepStatus ClosedLoop::Advance(LoopResult* result) {
  const std::uint64_t bits_before = vehicle_.traffic().worst_bits;
  const model::StepStatus status = vehicle_.Cycle(torques_);
  result->bus_load_peak =
      std::max(result->bus_load_peak,
               Load(vehicle_.traffic().worst_bits - bits_before, scene_.drives.period_s));
  for (int i = 0; i < vehicle_.motor_count(); ++i) {
    const double work = vehicle_.winch(i).cable_work_j;
    result->cable_work_j += std::max(work - work_before_j_[i], 0.0);
    work_before_j_[i] = work;
  }
  return status;
}

LoopStep ClosedLoop::StepNow(bool planned, double error, const LoopResult& result) const {
  return {truth_.time_s, planned,
          truth_,        estimator_.state(),
          command_,      torques_,
          tension_,      estimator_.disturbance(),
          vehicle_,      controller_->mpc(),
          result.cost,   error};
}

LoopResult ClosedLoop::Run(const std::function<bool(const LoopStep&)>& observer) {
  LoopResult r;
  const auto begin = std::chrono::steady_clock::now();
  model::StepStatus status = vehicle_.BringUp();
  const bool up = status.ok;
  const BusTraffic before = vehicle_.traffic();
  account_.Start(scene_.robot.root_pose.position, &r);
  for (int i = 0; i < vehicle_.motor_count(); ++i) {
    work_before_j_[i] = vehicle_.winch(i).cable_work_j;
  }
  const double period = scene_.drives.period_s;
  const long cycles = std::lround(scene_.run.duration_s / period);
  for (bool go = true; go && status.ok && r.cycles <= cycles;) {
    const long cycle = r.cycles;
    status = Read(static_cast<double>(cycle) * period);
    if (!status.ok) break;
    const bool at_end = cycle == cycles;
    if (!at_end) Turn(cycle, &r);
    const double error = account_.Look(truth_, vehicle_.state(), &r);
    const bool planned = !at_end && cycle % control_every_ == 0;
    if (observer) go = observer(StepNow(planned, error, r));
    if (at_end || !go) break;
    account_.Add(truth_, period, command_, before_, tension_, &r);
    if ((cycle + 1) % control_every_ == 0) {  // before the measurement that it is for
      controller_->SetDisturbance(estimator_.disturbance());
      controller_->Prepare(static_cast<double>(cycle + 1) * period, command_);
    }
    status = Advance(&r);
    if (status.ok) ++r.cycles;
  }
  r.traffic = {vehicle_.traffic().frames - before.frames, vehicle_.traffic().bits - before.bits,
               vehicle_.traffic().worst_bits - before.worst_bits};
  r.ok = status.ok;
  r.reason = status.reason;
  Conclude(&r);
  // Also where the plant could not go on: the drives may.
  if (up) status = vehicle_.Stop();
  if (r.ok && !status.ok) {
    r.ok = false;
    r.reason = status.reason;
  }
  r.wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  return r;
}

// Figures of the run, before the drives are taken down.
void ClosedLoop::Conclude(LoopResult* r) {
  r->time_s = static_cast<double>(r->cycles) * scene_.drives.period_s;
  account_.Conclude(r);
  if (r->cycles > 0) r->bus_load = Load(r->traffic.worst_bits, r->time_s);
  for (int i = 0; i < vehicle_.motor_count(); ++i) r->late_pdos += vehicle_.report(i).tpdo1_late;
  if (const controller::Mpc* mpc = controller_->mpc()) r->counters = mpc->counters();
  r->late_cycles = vehicle_.pacer().late_turns();
  r->worst_lateness_s = 1e-6 * static_cast<double>(vehicle_.pacer().worst_lateness_us());
  r->plant = vehicle_.PlantResult();
  r->energetic_index = r->plant.index.ratio_of_means;
}

}  // namespace mantle::loop
