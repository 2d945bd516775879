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
void NoteFallbacks(const controller::MpcStatus& status, const controller::MpcCounters& c,
                   LoopResult* r) {
  r->ended.clear();
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
      real_time_(options.real_time),
      plant_(PlantRobot(scene)),
      model_(BelievedRobot(scene), scene.reduction),
      wire_(options.bus.value_or(scene.drives.bus), kBusTimeout_us, options.record,
            options.real_time ? WireTime::kReal : WireTime::kLockStep),
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
      lock_step_(*vehicle_, control_side_.motors(), wire_),
      account_(model_, control_side_.options(), control_side_.reference(), scene.run.duration_s),
      work_before_j_(scene.reduction.actuators.size(), 0.0),
      work_j_(work_before_j_) {
  reports_.resize(work_j_.size());
  reeled_m_.resize(work_j_.size());
}

std::unique_ptr<VehicleSide> ClosedLoop::MakeVehicle() {
  if (real_time_) gate_.emplace(wire_.plant_station());
  firmware_sim::Bus& station =
      gate_ ? static_cast<firmware_sim::Bus&>(*gate_) : wire_.plant_station();
  if (scene_.drives.vehicle == kPlantVehicle) {
    return std::make_unique<PlantVehicle>(plant_, model_, scene_.run, scene_.reduction.actuators,
                                          scene_.drives, scene_.sensors, station);
  }
  return FindVehicle(scene_.drives.vehicle)
      .make({model_, scene_.mismatch, scene_.reduction.actuators, scene_.drives, scene_.sensors,
             station});
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

void ClosedLoop::AddCableWork(std::span<const double> work_j, LoopResult* result) {
  for (std::size_t i = 0; i < work_before_j_.size(); ++i) {
    result->cable_work_j += std::max(work_j[i] - work_before_j_[i], 0.0);
    work_before_j_[i] = work_j[i];
  }
}

Status ClosedLoop::Advance(LoopResult* result) {
  const std::uint64_t bits_before = wire_.traffic().worst_bits;
  const Status status = lock_step_.Cycle();
  result->bus_load_peak =
      std::max(result->bus_load_peak,
               Load(wire_.traffic().worst_bits - bits_before, scene_.drives.period_s));
  for (std::size_t i = 0; i < work_j_.size(); ++i) {
    work_j_[i] = vehicle_->cable_work_j(static_cast<int>(i));
  }
  AddCableWork(work_j_, result);
  return status;
}

void ClosedLoop::TakeReports() {
  const MotorMaster& motors = control_side_.motors();
  for (int i = 0; i < motors.motor_count(); ++i) {
    reports_[static_cast<std::size_t>(i)] = motors.report(i);
    reeled_m_[static_cast<std::size_t>(i)] = motors.ReportedReel_m(i);
  }
}

LoopStep ClosedLoop::StepNow(bool planned, double error, const LoopResult& result) {
  const ControlSide& control = control_side_;
  TakeReports();
  if (const Eigen::MatrixXd* covariance = control.covariance()) variance_ = covariance->diagonal();
  look_ = [this]() -> std::optional<PlantView> {
    if (plant_vehicle_ == nullptr) return std::nullopt;
    sample_ = plant_vehicle_->side().Observe();
    const model::Simulation& simulation = plant_vehicle_->side().simulation();
    return PlantView{*sample_, simulation.state(), simulation.energy()};
  };
  const controller::Mpc* mpc = control.mpc();
  return {vehicle_->truth().time_s,
          planned,
          vehicle_->truth(),
          control.estimate(),
          control.command_n(),
          control.torques(),
          vehicle_->tension_n(),
          control.disturbance(),
          plant_vehicle_ == nullptr ? nullptr : &plant_vehicle_->side(),
          reports_,
          reeled_m_,
          mpc == nullptr ? nullptr : &mpc->plan(),
          mpc == nullptr ? nullptr : &mpc->status(),
          mpc == nullptr ? nullptr : &mpc->counters(),
          variance_,
          nullptr,
          result.cost,
          error,
          look_};
}

LoopResult ClosedLoop::Run(const std::function<bool(const LoopStep&)>& observer) {
  return real_time_ ? RunInRealTime(observer) : RunInLockStep(observer);
}

LoopResult ClosedLoop::RunInLockStep(const std::function<bool(const LoopStep&)>& observer) {
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
      if (const controller::Mpc* mpc = control_side_.mpc(); mpc && control_side_.planned()) {
        NoteFallbacks(mpc->status(), mpc->counters(), &r);
      }
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
  TakeReports();
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

LoopResult ClosedLoop::RunInRealTime(const std::function<bool(const LoopStep&)>& observer) {
  LoopResult r;
  const auto begin = std::chrono::steady_clock::now();
  BusTraffic before, after;  // of the time in command
  const auto on_phase = [&](ControlPhase phase) {
    if (phase == ControlPhase::kRunning) {
      before = wire_.traffic();
      wire_.RestartPeak();
    }
    if (phase == ControlPhase::kStopping) after = wire_.traffic();
  };
  account_.Start(scene_.robot.root_pose.position, &r);
  RealTimeRun run({*vehicle_, plant_vehicle_ == nullptr ? nullptr : &plant_vehicle_->side(), *gate_,
                   channel_, control_side_},
                  {.duration_s = scene_.run.duration_s,
                   .output_interval_s = scene_.run.output_interval_s,
                   .period_us = Period_us(scene_.drives),
                   .tip_arm = reference().has_tip() ? reference().arm() : -1,
                   .on_phase = on_phase});
  bool first = true;
  const Status status = run.Run(
      [&](const RealTimeRun::Step& step) {
        if (first) work_before_j_ = step.plant.cable_work_j;
        first = false;
        return OnRealTimeStep(step, &r, observer);
      },
      [this] {
        wire_.WriteRecord();
        return wire_.Check();
      });
  r.real_time = run.figures();
  r.traffic = {after.frames - before.frames, after.bits - before.bits,
               after.worst_bits - before.worst_bits};
  r.bus_load_peak = Load(wire_.peak_worst_bits(), scene_.drives.period_s);
  r.ok = status.ok;
  r.reason = status.reason;
  Conclude(&r);
  r.late_cycles = r.real_time->control.late_cycles + r.real_time->control.missed_cycles;
  r.worst_lateness_s = 1e-6 * static_cast<double>(r.real_time->control.lateness.worst_us());
  r.wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  return r;
}

// In the listener's thread: all is by value.
bool ClosedLoop::OnRealTimeStep(const RealTimeRun::Step& step, LoopResult* r,
                                const std::function<bool(const LoopStep&)>& observer) {
  const ControlFrame& control = step.control;
  const double period = scene_.drives.period_s;
  const bool at_end = step.plant.time_s >= scene_.run.duration_s - 0.5 * period;
  if (step.plan != nullptr) {
    solver_ = step.plan->status;
    solver_counters_ = step.plan->counters;
    NoteFallbacks(solver_, solver_counters_, r);
  }
  reports_ = control.reports;
  const double error = account_.Look(step.plant.truth, step.plant.tip, r);
  AddCableWork(step.plant.cable_work_j, r);
  look_ = [&step]() -> std::optional<PlantView> {
    if (step.snapshot == nullptr) return std::nullopt;
    return PlantView{step.snapshot->sample, step.snapshot->state, step.snapshot->energy};
  };
  const bool plans = control_side_.planner() != nullptr && solver_counters_.solves > 0;
  bool go = true;
  if (observer) {
    go = observer({step.plant.time_s,
                   !at_end && (step.plan != nullptr || (control.planned && !plans)),
                   step.plant.truth, control.estimate, control.command_n, control.torques,
                   step.plant.tension_n, control.disturbance,
                   plant_vehicle_ == nullptr ? nullptr : &plant_vehicle_->side(), control.reports,
                   control.reeled_m, step.plan == nullptr ? nullptr : &step.plan->plan,
                   plans ? &solver_ : nullptr, plans ? &solver_counters_ : nullptr,
                   control.variance, &control.counters, r->cost, error, look_});
  }
  if (at_end || !go) return go;
  account_.Add(step.plant.truth, period, control.command_n, control.before_n, step.plant.tension_n,
               r);
  if (control_side_.options().estimator.current && plant_vehicle_ != nullptr) {
    account_.AddCurrent(step.plant.time_s, period, control.disturbance.current_m_s,
                        EvaluateWater(plant_.robot.effects, step.plant.time_s).velocity_m_s, r);
  }
  ++r->cycles;
  return true;
}

// Figures of the run; in lock-step, before the drives are taken down.
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
  for (const firmware_sim::DriveReport& report : reports_) r->late_pdos += report.tpdo1_late;
  if (const controller::Mpc* mpc = control_side_.mpc()) r->counters = mpc->counters();
  r->ended = Ending(*r);
  for (int i = 0; i < control_side_.motors().motor_count(); ++i) {
    if (control_side_.health().lost(i)) r->lost_motors.insert(i);
  }
  if (plant_vehicle_ == nullptr) return;
  r->plant = plant_vehicle_->side().PlantResult();
  r->energetic_index = r->plant.index.ratio_of_means;
}

// What the last plan left, and the drives.
std::string ClosedLoop::Ending(const LoopResult& r) const {
  std::string text = r.ended;
  for (std::size_t i = 0; i < reports_.size(); ++i) {
    const firmware_sim::DriveReport& report = reports_[i];
    if (report.step == firmware_sim::DriveStep::kEnabled) continue;
    text += fmt::format("{}ended with a drive that does not work: motor \"{}\", {}",
                        text.empty() ? "" : "; ", scene_.reduction.actuators[i].name,
                        firmware_sim::Describe(report));
  }
  return text;
}

}  // namespace mantle::loop
