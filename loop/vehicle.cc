#include "loop/vehicle.h"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numbers>
#include <set>
#include <stdexcept>

#include "firmware_sim/bus/open_bus.h"

namespace mantle::loop {

using firmware_sim::Master;
using firmware_sim::MasterOptions;
using firmware_sim::OperationMode;
using model::StepStatus;

namespace {

constexpr double kLongestCouplingPhase = 0.25;
constexpr double kSecond_us = 1e6;
// A stop ramps, pays out and brakes; each step of the master has its own time-out of 2 s.
constexpr std::int64_t kStopLimit_us = 8'000'000;

std::int64_t Period_us(const DriveOptions& options) {
  const double period_ms = 1e3 * options.period_s;
  const double whole = std::round(period_ms);
  if (!(whole >= 1.0 && whole <= 100.0) || std::abs(period_ms - whole) > 1e-6) {
    throw std::invalid_argument(fmt::format(
        "drives.period is {:.6g} s, must be 1 to 100 whole milliseconds", options.period_s));
  }
  return 1000 * static_cast<std::int64_t>(whole);
}

const DriveOptions& Checked(const DriveOptions& options) {
  const auto check = [](const char* name, double value, double low, double high) {
    if (std::isfinite(value) && value >= low && value <= high) return;
    throw std::invalid_argument(
        fmt::format("drives.{} is {:.6g}, must be {:.3g} to {:.3g}", name, value, low, high));
  };
  check("cable_stiffness [N/m]", options.cable_stiffness_n_m, 1.0, 1e5);
  check("cable_damping [N s/m]", options.cable_damping_n_s_m, 0.0, 1e3);
  check("pretension [N]", options.pretension_n, 0.0, 1.0);
  return options;
}

}  // namespace

controller::WinchMap SimulatedWinch() {
  constexpr firmware_sim::MotorData kMotor;
  constexpr firmware_sim::WinchData kWinch;
  controller::WinchMap map;
  const double drum_rad_m = 1e-6 * kWinch.feed_um_per_turn / (2.0 * std::numbers::pi);
  map.metres_per_rad = drum_rad_m / kWinch.gear_ratio;
  map.metres_per_count = map.metres_per_rad * 2.0 * std::numbers::pi / kWinch.counts_per_turn;
  map.gear_efficiency = kWinch.gear_efficiency;
  map.friction_torque_nm = kMotor.friction_torque_nm;
  map.stiction_ratio = kMotor.stiction_ratio;
  map.inertia_kgm2 = kMotor.rotor_inertia_kgm2 +
                     kWinch.drum_inertia_kgm2 / (kWinch.gear_ratio * kWinch.gear_ratio);
  map.permille_nm = 1e-3 * 1e-3 * firmware_sim::kRatedTorque_mnm;
  return map;
}

int CouplingSteps(const DriveOptions& options) {
  const double frequency = std::sqrt(options.cable_stiffness_n_m / SimulatedWinch().mass_kg());
  const std::int64_t sub_steps = Period_us(options) / firmware_sim::kSubStep_us;
  auto steps =
      static_cast<std::int64_t>(std::ceil(frequency * options.period_s / kLongestCouplingPhase));
  for (steps = std::clamp<std::int64_t>(steps, 1, sub_steps); sub_steps % steps != 0;) ++steps;
  return static_cast<int>(steps);
}

model::RunSettings Vehicle::RunWithReels(model::RunSettings run) {
  const model::InputHook before = run.stepper.input_hook;
  run.stepper.input_hook = [this, before](double t_s, bool from_left, model::PlantInputs* inputs) {
    if (before) before(t_s, from_left, inputs);
    for (const Reel& reel : reels_) SetCables(reel, t_s, inputs);
  };
  return run;
}

Vehicle::Vehicle(const model::Plant& plant, const model::RunSettings& run,
                 const std::vector<reduced::Actuator>& motors, const DriveOptions& drives,
                 const VehicleOptions& options)
    : options_(options),
      drive_options_(Checked(drives)),
      winch_map_(SimulatedWinch()),
      period_us_(Period_us(drives)),
      coupling_steps_(options.coupling_steps != 0 ? options.coupling_steps : CouplingSteps(drives)),
      simulation_(plant, RunWithReels(run)),
      pacer_(period_us_) {
  if (motors.empty() || motors.size() > firmware_sim::kMaxDrives) {
    throw std::invalid_argument(fmt::format("a vehicle has 1 to {} motors, not {}",
                                            firmware_sim::kMaxDrives, motors.size()));
  }
  if (coupling_steps_ < 1 || period_us_ % (firmware_sim::kSubStep_us * coupling_steps_) != 0) {
    throw std::invalid_argument(fmt::format(
        "coupling steps per period are {}, must divide the period of {} us into steps of whole {} "
        "us",
        coupling_steps_, period_us_, firmware_sim::kSubStep_us));
  }
  std::vector<Reel> reels;
  std::set<int> driven;
  for (const reduced::Actuator& motor : motors) {
    reels.push_back(MakeReel(plant, motor, drives, simulation_.EndWork()));
    for (const ReeledCable& cable : reels.back().cables) {
      if (!driven.insert(cable.index).second) {
        throw std::invalid_argument(
            fmt::format("motor \"{}\": cable {} is driven already", motor.name, cable.index));
      }
    }
  }
  for (Reel& reel : reels) reel.begin.reeled_m = reel.end.reeled_m = -options.initial_slack_m;
  reels_ = std::move(reels);

  const std::size_t count = reels_.size();
  slack_m_.assign(count, options.initial_slack_m);
  zero_counts_.assign(count, 0.0);
  drum_tension_n_.assign(count, 0.0);
  length_m_ = length_rate_m_s_ = drum_tension_n_;
  accounts_.resize(count);

  OpenBuses(drives.bus);
  const firmware_sim::CableLoad cable{0.0, drives.cable_stiffness_n_m, options.initial_slack_m,
                                      drives.cable_damping_n_s_m};
  rack_ = std::make_unique<DriveRack>(*drive_bus_, static_cast<int>(count), cable, now_us_);
  MasterOptions master{{}, options.supervisor};
  for (std::size_t i = 1; i <= count; ++i) {
    master.nodes.push_back(static_cast<firmware_sim::NodeId>(i));
  }
  master.supervisor.settings.period_us = period_us_;
  master.supervisor.settings.mode = OperationMode::kCyclicTorque;
  master.supervisor.settings.rpdo_timeout_us =
      std::max(master.supervisor.settings.rpdo_timeout_us, 3 * period_us_);
  master_ = std::make_unique<Master>(*master_bus_, master);
  ReadPlant();
}

void Vehicle::OpenBuses(const std::string& spec) {
  const std::vector<firmware_sim::CanFilter> filters = Master::Filters();
  const bool in_process = spec == "loop";
  if (in_process) medium_ = std::make_unique<firmware_sim::LoopMedium>();
  master_station_ = firmware_sim::OpenBus(spec, medium_.get(), filters);
  drive_station_ = firmware_sim::OpenBus(spec, medium_.get());
  master_bus_ = master_station_.get();
  drive_bus_ = drive_station_.get();
  if (!in_process) {
    master_link_ = std::make_unique<LockStepBus>(*master_station_, options_.bus_timeout_us);
    drive_link_ = std::make_unique<LockStepBus>(*drive_station_, options_.bus_timeout_us);
    master_link_->Connect(drive_link_.get());
    drive_link_->Connect(master_link_.get());
    master_bus_ = master_link_.get();
    drive_bus_ = drive_link_.get();
  }
  meter_ = std::make_unique<MeteredBus>(*master_bus_);
  master_bus_ = meter_.get();
  if (options_.record != nullptr) {
    recorder_ = std::make_unique<firmware_sim::RecordingBus>(*master_bus_, *options_.record);
    master_bus_ = recorder_.get();
  }
}

void Vehicle::AdvanceBuses() {
  if (medium_) medium_->AdvanceTo(now_us_);
  if (master_link_) {
    master_link_->AdvanceTo(now_us_);
    drive_link_->AdvanceTo(now_us_);
  }
  if (recorder_) recorder_->AdvanceTo(now_us_);
}

void Vehicle::Exchange() {
  rack_->Pump(now_us_);
  master_->Poll(now_us_);
}

StepStatus Vehicle::CheckBus() const {
  const auto describe = [&](const LockStepBus& link, const char* from) -> StepStatus {
    return {false, fmt::format("bus {}: frame {:03X} that {} sent did not come within {:.3g} s",
                               drive_options_.bus, link.missing().id, from,
                               static_cast<double>(options_.bus_timeout_us) / kSecond_us)};
  };
  for (const auto* link : {&master_link_, &drive_link_}) {
    if (!*link || (*link)->foreign() == 0) continue;
    return {false,
            fmt::format("bus {}: {} foreign frames with identifiers of this run, the first "
                        "{:03X}: another run or master is on the bus",
                        drive_options_.bus, (*link)->foreign(), (*link)->first_foreign().id)};
  }
  if (master_link_ && master_link_->stalled()) return describe(*master_link_, "the drives");
  if (drive_link_ && drive_link_->stalled()) return describe(*drive_link_, "the master");
  if (master_->counters().send_failures > 0) {
    return {false, fmt::format("bus {}: refused to send", drive_options_.bus)};
  }
  return {};
}

StepStatus Vehicle::Cycle(std::span<const MotorCommand> commands) {
  assert(commands.size() == reels_.size());
  if (options_.real_time) pacer_.WaitForTurn();
  for (std::size_t i = 0; i < commands.size(); ++i) {
    master_->SetTarget(i, {.torque_permille = commands[i].torque_permille});
  }
  master_->Cycle(now_us_);
  Exchange();
  return Couple(true);
}

StepStatus Vehicle::CycleWithoutMaster() {
  if (options_.real_time) pacer_.WaitForTurn();
  return Couple(false);
}

StepStatus Vehicle::Couple(bool with_master) {
  const std::int64_t start_us = now_us_;
  for (int i = 1; i <= coupling_steps_; ++i) {
    const StepStatus status = CoupleOnce(start_us + i * period_us_ / coupling_steps_);
    if (!status.ok) return status;
  }
  if (with_master) {
    Exchange();
  } else {
    rack_->Pump(now_us_);
  }
  return CheckBus();
}

StepStatus Vehicle::CoupleOnce(std::int64_t to_us) {
  const double begin_s = simulation_.time_s();
  const double end_s = static_cast<double>(to_us - origin_us_) / kSecond_us;
  const model::PlantWork& work = simulation_.EndWork();
  for (std::size_t i = 0; i < reels_.size(); ++i) {
    (*rack_)[static_cast<int>(i)].SetCable(LoadOnDrum(reels_[i], work, slack_m_[i]));
  }
  rack_->AdvanceTo(to_us);
  now_us_ = to_us;
  AdvanceBuses();
  for (std::size_t i = 0; i < reels_.size(); ++i) {
    const firmware_sim::WinchOutput out = winch(static_cast<int>(i));
    Reel& reel = reels_[i];
    reel.begin_s = begin_s;
    reel.end_s = end_s;
    reel.begin = reel.end;
    reel.end = {out.reeled_m - slack_m_[i], out.rate_m_s};
  }
  const StepStatus status = simulation_.AdvanceTo(end_s);
  if (!status.ok) return status;
  ReadPlant();
  AccountCoupling(end_s - begin_s);
  return {};
}

void Vehicle::ReadPlant() {
  const model::PlantWork& work = simulation_.EndWork();
  for (std::size_t i = 0; i < reels_.size(); ++i) {
    drum_tension_n_[i] = DrumTension(reels_[i], work.cable_tension_n);
    length_m_[i] = ReelLength(reels_[i], work.cable_length_m);
    length_rate_m_s_[i] = ReelLength(reels_[i], work.cable_rate_m_s);
  }
}

void Vehicle::AccountCoupling(double step_s) {
  const model::PlantWork& work = simulation_.EndWork();
  for (std::size_t i = 0; i < reels_.size(); ++i) {
    double plant_w = 0, dissipated_w = 0;
    for (const ReeledCable& cable : reels_[i].cables) {
      const double u = work.cable_tension_n[cable.index];
      const double rate = work.cable_rate_m_s[cable.index];
      plant_w -= u * rate;
      const double e_dot = rate + cable.gain * reels_[i].end.rate_m_s;
      if (u > 0.0) dissipated_w += cable.damping_n_s_m * e_dot * e_dot;
    }
    Account& account = accounts_[i];
    account.stored_j = StoredEnergy(reels_[i], work);
    account.plant_j += 0.5 * step_s * (account.plant_w + plant_w);
    account.dissipated_j += 0.5 * step_s * (account.dissipated_w + dissipated_w);
    account.plant_w = plant_w;
    account.dissipated_w = dissipated_w;
  }
}

CouplingWork Vehicle::coupling_work(int i) const {
  const Account& account = accounts_[i];
  return {winch(i).cable_work_j - account.winch_at_start_j, account.plant_j, account.dissipated_j,
          account.stored_j - account.stored_at_start_j};
}

double Vehicle::ReportedReel_m(int i) const {
  return winch_map_.metres_per_count * (report(i).position_counts + 0.5 - zero_counts_[i]);
}

double Vehicle::ReportedRate_m_s(int i) const {
  return winch_map_.metres_per_count * report(i).velocity_counts_s;
}

StepStatus Vehicle::Stop() {
  RequestStop();
  std::vector<MotorCommand> none(reels_.size());
  for (const std::int64_t end_us = now_us_ + kStopLimit_us; !(stopped() && rack_->braked());) {
    if (now_us_ >= end_us) return {false, "drives did not stop:\n" + Describe(*master_)};
    if (StepStatus status = Cycle(none); !status.ok) return status;
  }
  for (int i = 0; i < motor_count(); ++i) {
    if (report(i).step != firmware_sim::DriveStep::kStopped) {
      return {false, "a drive did not stop as it should: " + Describe(report(i))};
    }
  }
  return {};
}

}  // namespace mantle::loop
