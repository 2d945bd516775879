#include "loop/closed_loop.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>

#include "firmware_sim/bus/bus_load.h"
#include "loop/drive_options.h"

namespace mantle::loop {
namespace {

constexpr std::int64_t kBusTimeout_us = 2'000'000;
constexpr double kStepTolerance = 1e-6;  // of the controller's own model, see StepSettings

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

controller::ControlOptions ControlOf(const scene::Scene& scene, const ClosedLoopOptions& options) {
  controller::ControlOptions control = *scene.control;
  if (options.controller) control.controller = *options.controller;
  return control;
}

// Share of the wire.
double Load(std::uint64_t bits, double time_s) {
  return static_cast<double>(bits) / (time_s * static_cast<double>(firmware_sim::kBitRate));
}

// What a run would have to say if it ended with this plan: the controller has given up, or never
// had a plan.
void NoteFallbacks(const ControlSide& control, LoopResult* r) {
  const controller::Mpc* mpc = control.mpc();
  if (mpc == nullptr || !control.planned()) return;
  r->ended.clear();
  const controller::MpcCounters& c = mpc->counters();
  const controller::MpcStatus& status = mpc->status();
  if (status.outcome != controller::Outcome::kSafe && c.fallbacks_in_turn != c.solves) return;
  r->ended =
      fmt::format("ended on fallbacks: the last {} of {} plans", c.fallbacks_in_turn, c.solves);
  if (status.cause != nullptr) r->ended += fmt::format(" ({})", status.cause);
}

}  // namespace

model::Robot PlantRobot(const scene::Scene& scene) {
  model::Robot robot = scene.robot;
  robot.mismatch = scene.mismatch;
  return robot;
}

model::Robot BelievedRobot(const scene::Scene& scene) {
  model::Robot robot = scene.robot;
  robot.effects.current_m_s.reset();
  robot.effects.unsteady_current.reset();
  return robot;
}

ClosedLoop::ClosedLoop(const scene::Scene& scene, const ClosedLoopOptions& options)
    : scene_(Checked(scene)),
      plant_(PlantRobot(scene)),
      model_(BelievedRobot(scene), scene.reduction),
      wire_(options.bus.value_or(scene.drives.bus), kBusTimeout_us, options.record),
      vehicle_(MakeVehicle()),
      plant_vehicle_(dynamic_cast<PlantVehicle*>(vehicle_.get())),
      control_side_(
          {.model = model_,
           .step = {scene.reduction.scheme, std::max(scene.reduction.tolerance, kStepTolerance)},
           .control = ControlOf(scene, options),
           .sensors = scene.sensors,
           .drives = scene.drives,
           .real_time = options.real_time},
          wire_.control_station()),
      pacer_(Period_us(scene.drives)),
      lock_step_(*vehicle_, control_side_.motors(), wire_, options.real_time ? &pacer_ : nullptr),
      account_(model_, control_side_.options(), control_side_.reference(), scene.run.duration_s),
      work_before_j_(scene.reduction.actuators.size(), 0.0) {}

std::unique_ptr<VehicleSide> ClosedLoop::MakeVehicle() {
  if (scene_.drives.vehicle == kPlantVehicle) {
    return std::make_unique<PlantVehicle>(plant_, model_, scene_.run, scene_.reduction.actuators,
                                          scene_.drives, scene_.sensors, wire_.plant_station());
  }
  return FindVehicle(scene_.drives.vehicle)
      .make({model_, scene_.mismatch, scene_.reduction.actuators, scene_.drives, scene_.sensors,
             wire_.plant_station()});
}

PlantSide& ClosedLoop::plant_side() {
  if (plant_vehicle_ != nullptr) return plant_vehicle_->side();
  throw std::logic_error(fmt::format("vehicle \"{}\": is not the plant", scene_.drives.vehicle));
}

void ClosedLoop::PassSensors() {
  vehicle_->Measure(&measured_);
  channel_.Send(measured_);
  while (channel_.Receive(&received_)) control_side_.Turn(received_);
}

Status ClosedLoop::Advance(LoopResult* result) {
  const std::uint64_t bits_before = wire_.traffic().worst_bits;
  const Status status = lock_step_.Cycle();
  result->bus_load_peak =
      std::max(result->bus_load_peak,
               Load(wire_.traffic().worst_bits - bits_before, scene_.drives.period_s));
  for (std::size_t i = 0; i < work_before_j_.size(); ++i) {
    const double work = vehicle_->cable_work_j(static_cast<int>(i));
    result->cable_work_j += std::max(work - work_before_j_[i], 0.0);
    work_before_j_[i] = work;
  }
  return status;
}

LoopStep ClosedLoop::StepNow(bool planned, double error, const LoopResult& result) const {
  const ControlSide& control = control_side_;
  return {vehicle_->truth().time_s,
          planned,
          vehicle_->truth(),
          control.estimate(),
          control.command_n(),
          control.torques(),
          vehicle_->tension_n(),
          control.disturbance(),
          plant_vehicle_ == nullptr ? nullptr : &plant_vehicle_->side(),
          control.motors(),
          control.mpc(),
          result.cost,
          error};
}

LoopResult ClosedLoop::Run(const std::function<bool(const LoopStep&)>& observer) {
  LoopResult r;
  const auto begin = std::chrono::steady_clock::now();
  Status status = lock_step_.BringUp();
  const bool up = status.ok;
  const BusTraffic before = wire_.traffic();
  account_.Start(scene_.robot.root_pose.position, &r);
  for (std::size_t i = 0; i < work_before_j_.size(); ++i) {
    work_before_j_[i] = vehicle_->cable_work_j(static_cast<int>(i));
  }
  const double period = scene_.drives.period_s;
  const long cycles = std::lround(scene_.run.duration_s / period);
  for (bool go = true; go && status.ok && r.cycles <= cycles;) {
    const long cycle = r.cycles;
    status = vehicle_->Look(static_cast<double>(cycle) * period);
    if (!status.ok) break;
    const bool at_end = cycle == cycles;
    if (!at_end) {
      PassSensors();
      NoteFallbacks(control_side_, &r);
    }
    const reduced::ReducedState& truth = vehicle_->truth();
    const double error = account_.Look(
        truth, reference().has_tip() ? vehicle_->tip(reference().arm()) : model::Vector3::Zero(),
        &r);
    if (observer) go = observer(StepNow(!at_end && control_side_.planned(), error, r));
    if (at_end || !go) break;
    account_.Add(truth, period, control_side_.command_n(), control_side_.before_n(),
                 vehicle_->tension_n(), &r);
    if (control_side_.options().estimator.current && plant_vehicle_ != nullptr) {
      account_.AddCurrent(truth.time_s, period, control_side_.disturbance().current_m_s,
                          EvaluateWater(plant_.robot.effects, truth.time_s).velocity_m_s, &r);
    }
    control_side_.PrepareNext();
    status = Advance(&r);
    if (status.ok) ++r.cycles;
  }
  r.traffic = {wire_.traffic().frames - before.frames, wire_.traffic().bits - before.bits,
               wire_.traffic().worst_bits - before.worst_bits};
  r.ok = status.ok;
  r.reason = status.reason;
  Conclude(&r);
  // Also where the plant could not go on: the drives may.
  if (up) status = lock_step_.Stop();
  if (r.ok && !status.ok) {
    r.ok = false;
    r.reason = status.reason;
  }
  r.wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  return r;
}

// Figures of the run, before the drives are taken down.
void ClosedLoop::Conclude(LoopResult* r) {
  const ControlCounters& control = control_side_.counters();
  r->prepare_s = control.prepare_s;
  r->solve_s = control.solve_s;
  r->iterations = control.iterations;
  r->limit_touches = control.limit_touches;
  r->time_s = static_cast<double>(r->cycles) * scene_.drives.period_s;
  r->estimator = control_side_.estimator_counters();
  account_.Conclude(r);
  if (r->cycles > 0) r->bus_load = Load(r->traffic.worst_bits, r->time_s);
  for (int i = 0; i < control_side_.motors().motor_count(); ++i) {
    r->late_pdos += control_side_.motors().report(i).tpdo1_late;
  }
  if (const controller::Mpc* mpc = control_side_.mpc()) r->counters = mpc->counters();
  r->ended = Ending(*r);
  for (int i = 0; i < control_side_.motors().motor_count(); ++i) {
    if (control_side_.health().lost(i)) r->lost_motors.insert(i);
  }
  r->late_cycles = pacer_.late_turns();
  r->worst_lateness_s = 1e-6 * static_cast<double>(pacer_.worst_lateness_us());
  if (plant_vehicle_ == nullptr) return;
  r->plant = plant_vehicle_->side().PlantResult();
  r->energetic_index = r->plant.index.ratio_of_means;
}

// What the last plan left, and the drives.
std::string ClosedLoop::Ending(const LoopResult& r) const {
  std::string text = r.ended;
  const MotorMaster& motors = control_side_.motors();
  for (int i = 0; i < motors.motor_count(); ++i) {
    const firmware_sim::DriveReport& report = motors.report(i);
    if (report.step == firmware_sim::DriveStep::kEnabled) continue;
    text += fmt::format("{}ended with a drive that does not work: motor \"{}\", {}",
                        text.empty() ? "" : "; ",
                        scene_.reduction.actuators[static_cast<std::size_t>(i)].name,
                        firmware_sim::Describe(report));
  }
  return text;
}

}  // namespace mantle::loop
