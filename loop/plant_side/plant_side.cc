#include "loop/plant_side/plant_side.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>
#include <sstream>
#include <stdexcept>

#include "firmware_sim/canopen/motor_data.h"
#include "loop/drive_options.h"

namespace mantle::loop {
namespace {

constexpr double kLongestCouplingPhase = 0.25;
constexpr double kSecond_us = 1e6;
constexpr std::size_t kMostMotors = 16;  // as many as a master has drives

// Mass of rotor and drum as the cable feels it.
double DrumMass_kg() {
  constexpr firmware_sim::MotorData kMotor;
  constexpr firmware_sim::WinchData kWinch;
  const double metres_per_rad =
      1e-6 * kWinch.feed_um_per_turn / (2.0 * std::numbers::pi) / kWinch.gear_ratio;
  const double inertia_kgm2 = kMotor.rotor_inertia_kgm2 +
                              kWinch.drum_inertia_kgm2 / (kWinch.gear_ratio * kWinch.gear_ratio);
  return inertia_kgm2 / (metres_per_rad * metres_per_rad);
}

const DriveOptions& Checked(const DriveOptions& options) {
  CheckDriveOptions(options);
  return options;
}

int CheckedCount(std::size_t motors) {
  if (motors >= 1 && motors <= kMostMotors) return static_cast<int>(motors);
  throw std::invalid_argument(
      fmt::format("a vehicle has 1 to {} motors, not {}", kMostMotors, motors));
}

firmware_sim::CableLoad SlackCable(const DriveOptions& drives, double slack_m) {
  return {0.0, drives.cable_stiffness_n_m, slack_m, drives.cable_damping_n_s_m};
}

}  // namespace

int CouplingSteps(const DriveOptions& options) {
  const double frequency = std::sqrt(options.cable_stiffness_n_m / DrumMass_kg());
  const std::int64_t sub_steps = Period_us(options) / firmware_sim::kSubStep_us;
  auto steps =
      static_cast<std::int64_t>(std::ceil(frequency * options.period_s / kLongestCouplingPhase));
  for (steps = std::clamp<std::int64_t>(steps, 1, sub_steps); sub_steps % steps != 0;) ++steps;
  return static_cast<int>(steps);
}

model::RunSettings PlantSide::RunWithReels(model::RunSettings run) {
  const model::InputHook before = run.stepper.input_hook;
  run.stepper.input_hook = [this, before](double t_s, bool from_left, model::PlantInputs* inputs) {
    if (before) before(t_s, from_left, inputs);
    for (const Reel& reel : reels_) SetCables(reel, t_s, inputs);
  };
  return run;
}

PlantSide::PlantSide(const model::Plant& plant, const model::RunSettings& run,
                     const std::vector<reduced::Actuator>& motors, const DriveOptions& drives,
                     firmware_sim::Bus& bus, const PlantSideOptions& options)
    : period_us_(Period_us(Checked(drives))),
      coupling_steps_(options.coupling_steps != 0 ? options.coupling_steps : CouplingSteps(drives)),
      simulation_(plant, RunWithReels(run)),
      rack_(bus, CheckedCount(motors.size()), SlackCable(drives, options.initial_slack_m), 0) {
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
  drum_tension_n_.assign(count, 0.0);
  length_m_ = length_rate_m_s_ = drum_tension_n_;
  accounts_.resize(count);
  ReadPlant();
}

void PlantSide::Release(std::int64_t now_us) {
  origin_us_ = now_us - std::llround(kSecond_us * simulation_.time_s());
  for (std::size_t i = 0; i < reels_.size(); ++i) {
    const firmware_sim::WinchOutput out = winch(static_cast<int>(i));
    Reel& reel = reels_[i];
    reel.begin = reel.end = {out.reeled_m - slack_m_[i], out.rate_m_s};
    accounts_[i] = {};
    accounts_[i].winch_at_start_j = out.cable_work_j;
    accounts_[i].stored_at_start_j = StoredEnergy(reel, simulation_.EndWork());
  }
  ReadPlant();
  AccountCoupling(0.0);
}

Status PlantSide::Advance(std::int64_t now_us) {
  const double begin_s = simulation_.time_s();
  const double end_s = static_cast<double>(now_us - origin_us_) / kSecond_us;
  const model::PlantWork& work = simulation_.EndWork();
  for (std::size_t i = 0; i < reels_.size(); ++i) {
    rack_[static_cast<int>(i)].SetCable(LoadOnDrum(reels_[i], work, slack_m_[i]));
  }
  rack_.AdvanceTo(now_us);
  for (std::size_t i = 0; i < reels_.size(); ++i) {
    const firmware_sim::WinchOutput out = winch(static_cast<int>(i));
    Reel& reel = reels_[i];
    reel.begin_s = begin_s;
    reel.end_s = end_s;
    reel.begin = reel.end;
    reel.end = {out.reeled_m - slack_m_[i], out.rate_m_s};
  }
  const model::StepStatus status = simulation_.AdvanceTo(end_s);
  if (!status.ok) return {false, status.reason};
  ReadPlant();
  AccountCoupling(end_s - begin_s);
  return {};
}

std::string PlantSide::Checkpoint() const {
  std::string text = fmt::format("reels {}", reels_.size());
  for (const Reel& reel : reels_) text += fmt::format(" {}", reel.end.reeled_m);
  return text + "\n" + simulation_.Checkpoint();
}

void PlantSide::Restore(const std::string& checkpoint) {
  const auto refuse = [] {
    throw model::BadRobot("checkpoint: does not begin with the reels of this vehicle");
  };
  std::istringstream in(checkpoint.substr(0, checkpoint.find('\n')));
  std::string word;
  std::size_t count = 0;
  if (!(in >> word >> count) || word != "reels" || count != reels_.size()) refuse();
  for (std::size_t i = 0; i < count; ++i) {
    double reeled_m = 0;
    if (!(in >> reeled_m) || !std::isfinite(reeled_m)) refuse();
    reels_[i].begin = reels_[i].end = {reeled_m, 0.0};
    slack_m_[i] = -reeled_m;
  }
  simulation_.Restore(checkpoint.substr(checkpoint.find('\n') + 1));
  ReadPlant();
  // While it is held the cables' far ends stand where they are.
  for (std::size_t i = 0; i < count; ++i) {
    firmware_sim::CableLoad load = LoadOnDrum(reels_[i], simulation_.EndWork(), slack_m_[i]);
    const double longer_m = length_m_[i] - reels_[i].rest_length_m;
    load = {0.0, load.stiffness_n_m, slack_m_[i] - longer_m, load.damping_n_s_m};
    rack_[static_cast<int>(i)].SetCable(load);
  }
}

void PlantSide::ReadPlant() {
  const model::PlantWork& work = simulation_.EndWork();
  for (std::size_t i = 0; i < reels_.size(); ++i) {
    drum_tension_n_[i] = DrumTension(reels_[i], work.cable_tension_n);
    length_m_[i] = ReelLength(reels_[i], work.cable_length_m);
    length_rate_m_s_[i] = ReelLength(reels_[i], work.cable_rate_m_s);
  }
}

void PlantSide::AccountCoupling(double step_s) {
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

CouplingWork PlantSide::coupling_work(int i) const {
  const Account& account = accounts_[i];
  return {winch(i).cable_work_j - account.winch_at_start_j, account.plant_j, account.dissipated_j,
          account.stored_j - account.stored_at_start_j};
}

}  // namespace mantle::loop
