#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>

#include "loop/vehicle.h"

/// Before t = 0: boot, configuration, enabling, and the end of every cable's slack. The slack is
/// found as a commissioning tool would find it, from what the drives report: haul until the torque
/// says that the cable pulls. Where a reel at x, sliding at v, says a tension T, the slack ended at
/// x - (T - D v) / K; the mean over some reports is taken. Then the reel goes to where the cable
/// pulls with the pretension.

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

// Hauling, the tension rises by so much per period, at speeds where the reel slides smoothly.
constexpr double kRisePerPeriod_n = 0.05;
constexpr double kSlowestHaul_m_s = 0.002, kFastestHaul_m_s = 0.01;
/// Tension is believed above this, where the reel runs steadily again after the slack ended.
constexpr double kContact_n = 0.15;
constexpr int kReports = 8;
// What starting takes, and settling at the pretension.
constexpr std::int64_t kStart_us = 150'000;
constexpr std::int64_t kSettle_us = 300'000;

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
  struct Search {
    int reports{0};
    double sum_counts{0};
    double last_rate_m_s{0};
  };
  std::vector<Search> searches(reels_.size());
  const double stiffness_n_m = drive_options_.cable_stiffness_n_m;
  const double haul_m_s = std::clamp(kRisePerPeriod_n / (stiffness_n_m * drive_options_.period_s),
                                     kSlowestHaul_m_s, kFastestHaul_m_s);
  const auto counts = [&](double metres) { return metres / winch_map_.metres_per_count; };
  master_->SetMode(OperationMode::kCyclicVelocity);
  const std::int64_t start_us = now_us_;
  for (bool done = false; !done;) {
    done = true;
    for (int i = 0; i < motor_count(); ++i) {
      Search& search = searches[i];
      const double rate_m_s = ReportedRate_m_s(i);
      const double acceleration = (rate_m_s - search.last_rate_m_s) / drive_options_.period_s;
      search.last_rate_m_s = rate_m_s;
      const double tension_n =
          TorqueToTension(winch_map_, report(i).torque_permille, 1.0, acceleration) -
          drive_options_.cable_damping_n_s_m * rate_m_s;
      const bool pulls = now_us_ - start_us > kStart_us && tension_n > kContact_n;
      if (search.reports < kReports) {
        search.reports = pulls ? search.reports + 1 : 0;
        search.sum_counts = pulls ? search.sum_counts + report(i).position_counts + 0.5 -
                                        counts(tension_n / stiffness_n_m)
                                  : 0.0;
      }
      const bool found = search.reports == kReports;
      master_->SetTarget(
          i, {.velocity_counts_s =
                  found ? 0 : static_cast<std::int32_t>(std::lround(counts(haul_m_s)))});
      done = done && found;
    }
    RunDrives(period_us_, true);
    if (StepStatus status = CheckDrives("taking up slack"); !status.ok) return status;
    if (now_us_ - start_us > kSlackLimit_us) {
      return {false, fmt::format("no end of the slack within {} s:\n{}", kSlackLimit_us / 1'000'000,
                                 Describe(*master_))};
    }
  }
  master_->SetMode(OperationMode::kCyclicPosition);
  const double stretch_m = drive_options_.pretension_n / stiffness_n_m;
  for (std::size_t i = 0; i < reels_.size(); ++i) {
    zero_counts_[i] = searches[i].sum_counts / kReports;
    const double target = zero_counts_[i] + counts(stretch_m) - 0.5;
    master_->SetTarget(i, {.position_counts = static_cast<std::int32_t>(std::lround(target))});
  }
  for (const std::int64_t end_us = now_us_ + kSettle_us; now_us_ < end_us;) {
    RunDrives(period_us_, true);
  }
  // From here on the torque is commanded; stiction holds the pretension.
  master_->SetMode(OperationMode::kCyclicTorque);
  const double hold = TensionToTorque(winch_map_, drive_options_.pretension_n, 0.0);
  for (std::size_t i = 0; i < reels_.size(); ++i) {
    master_->SetTarget(i, {.torque_permille = static_cast<std::int16_t>(std::lround(hold))});
  }
  for (const std::int64_t end_us = now_us_ + kSettle_us; now_us_ < end_us;) {
    RunDrives(period_us_, true);
  }
  return CheckDrives("holding the pretension");
}

}  // namespace mantle::loop
