#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>

#include "tools/loop/vehicle.h"

/// Before t = 0: boot, configuration, enabling, and the end of every cable's slack. The slack is
/// found as a commissioning tool would find it, from what the drives report: haul until the torque
/// says the cable pulls, pay out a little, creep back. Where the creeping torque says a tension T,
/// the slack ended T / K before.

namespace mantle::loop {

using firmware_sim::DriveProblem;
using firmware_sim::DriveReport;
using firmware_sim::DriveStep;
using firmware_sim::OperationMode;
using model::StepStatus;

namespace {

constexpr std::int64_t kTick_us = 1000;
constexpr std::int64_t kEnableLimit_us = 5'000'000;
constexpr std::int64_t kSlackLimit_us = 30'000'000;

constexpr double kHaulRate_m_s = 0.02;
constexpr double kBackOffRate_m_s = 0.005;
constexpr double kBackOff_m = 5e-4;
constexpr double kFastestCreep_m_s = 1e-3;
/// Hauling, tension is believed from here on: well above what starting the motor takes.
constexpr double kContact_n = 0.08;
constexpr int kCyclesToStart = 10;

}  // namespace

StepStatus Vehicle::BringUp() {
  if (StepStatus status = Enable(); !status.ok) return status;
  if (StepStatus status = TakeUpSlack(); !status.ok) return status;
  origin_us_ = now_us_;
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
  return CheckBus();
}

/// Runs the drives for one period's time, the plant held; begins with a SYNC where asked.
void Vehicle::RunDrives(std::int64_t span_us, bool sync) {
  if (sync) {
    master_->Cycle(now_us_);
    Exchange();
  }
  for (const std::int64_t end_us = now_us_ + span_us; now_us_ < end_us;) {
    now_us_ += kTick_us;
    rack_->AdvanceTo(now_us_);
    AdvanceBuses();
    Exchange();
  }
}

StepStatus Vehicle::CheckDrives(const char* what) const {
  if (StepStatus status = CheckBus(); !status.ok) return status;
  for (int i = 0; i < motor_count(); ++i) {
    const DriveReport& r = report(i);
    if (r.problem != DriveProblem::kNone) {
      return {false, fmt::format("{}: {}", what, Describe(r))};
    }
  }
  return {};
}

StepStatus Vehicle::Enable() {
  AdvanceBuses();
  Exchange();
  master_->Enable(now_us_);
  while (!master_->enabled()) {
    RunDrives(period_us_, true);
    if (StepStatus status = CheckDrives("enabling the drives"); !status.ok) return status;
    if (now_us_ > kEnableLimit_us) {
      return {false, fmt::format("enabling the drives took longer than {} s:\n{}",
                                 kEnableLimit_us / 1'000'000, Describe(*master_))};
    }
  }
  return {};
}

StepStatus Vehicle::TakeUpSlack() {
  enum class Phase { kHaul, kBackOff, kCreep, kDone };
  struct Progress {
    Phase phase{Phase::kHaul};
    int cycles{0};  ///< in the phase
    std::int32_t target_counts{0};
  };
  std::vector<Progress> progress(reels_.size());
  const double creep_m_s = std::min(
      kFastestCreep_m_s, drive_options_.pretension_n /
                             (2.0 * drive_options_.cable_stiffness_n_m * drive_options_.period_s));
  const auto counts = [&](double metres) {
    return static_cast<std::int32_t>(std::lround(metres / winch_map_.metres_per_count));
  };
  const auto back_off_counts = counts(kBackOff_m);
  master_->SetMode(OperationMode::kCyclicVelocity);
  const std::int64_t limit_us = now_us_ + kSlackLimit_us;
  for (bool done = false; !done;) {
    done = true;
    for (std::size_t i = 0; i < reels_.size(); ++i) {
      Progress& p = progress[i];
      const DriveReport& r = report(static_cast<int>(i));
      const double tension_n = TorqueToTension(winch_map_, r.torque_permille, 1.0);
      const auto enter = [&](Phase phase) {
        p.phase = phase;
        p.cycles = 0;
      };
      ++p.cycles;
      if (p.phase == Phase::kHaul && p.cycles > kCyclesToStart && tension_n > kContact_n) {
        p.target_counts = r.position_counts -
                          counts(tension_n / drive_options_.cable_stiffness_n_m) - back_off_counts;
        enter(Phase::kBackOff);
      } else if (p.phase == Phase::kBackOff && r.position_counts < p.target_counts) {
        enter(Phase::kCreep);
      } else if (p.phase == Phase::kCreep && p.cycles > kCyclesToStart &&
                 tension_n >= drive_options_.pretension_n) {
        zero_counts_[i] =
            r.position_counts + 0.5 -
            tension_n / drive_options_.cable_stiffness_n_m / winch_map_.metres_per_count;
        enter(Phase::kDone);
      }
      double rate_m_s = 0.0;
      if (p.phase == Phase::kHaul) rate_m_s = kHaulRate_m_s;
      if (p.phase == Phase::kBackOff) rate_m_s = -kBackOffRate_m_s;
      if (p.phase == Phase::kCreep) rate_m_s = creep_m_s;
      master_->SetTarget(i, {.velocity_counts_s = counts(rate_m_s)});
      done = done && p.phase == Phase::kDone;
    }
    RunDrives(period_us_, true);
    if (StepStatus status = CheckDrives("taking up slack"); !status.ok) return status;
    if (now_us_ > limit_us) {
      return {false, fmt::format("no end of the slack within {} s:\n{}", kSlackLimit_us / 1'000'000,
                                 Describe(*master_))};
    }
  }
  // From here on the torque is commanded; stiction holds the pretension.
  master_->SetMode(OperationMode::kCyclicTorque);
  const double hold = TensionToTorque(winch_map_, drive_options_.pretension_n, 0.0);
  for (std::size_t i = 0; i < reels_.size(); ++i) {
    master_->SetTarget(i, {.torque_permille = static_cast<std::int16_t>(std::lround(hold))});
  }
  for (int k = 0; k < kCyclesToStart; ++k) RunDrives(period_us_, true);
  return CheckDrives("holding the pretension");
}

}  // namespace mantle::loop
