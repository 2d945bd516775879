#include "loop/control_side/bring_up.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace mantle::loop {

using firmware_sim::DriveProblem;
using firmware_sim::DriveReport;
using firmware_sim::OperationMode;

namespace {

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

BringUp::BringUp(firmware_sim::Master& master, const controller::WinchMap& winch,
                 const DriveOptions& drives)
    : master_(master),
      winch_(winch),
      drives_(drives),
      haul_m_s_(std::clamp(kRisePerPeriod_n / (drives.cable_stiffness_n_m * drives.period_s),
                           kSlowestHaul_m_s, kFastestHaul_m_s)),
      searches_(master.drive_count()),
      zero_counts_(master.drive_count(), 0.0) {}

Status BringUp::CheckDrives() const {
  const char* what = phase_ == Phase::kEnabling  ? "enabling the drives"
                     : phase_ == Phase::kHauling ? "taking up slack"
                                                 : "holding the pretension";
  for (std::size_t i = 0; i < master_.drive_count(); ++i) {
    const DriveReport& r = master_.drive(i);
    if (r.problem != DriveProblem::kNone) {
      return {false, fmt::format("{}: {}", what, Describe(r))};
    }
  }
  return {};
}

void BringUp::Enter(Phase phase, std::int64_t now_us) {
  phase_ = phase;
  begin_us_ = now_us;
}

void BringUp::Restart() {
  phase_ = Phase::kBoot;
  found_ = false;
  searches_.assign(searches_.size(), {});
}

Status BringUp::Turn(std::int64_t now_us, std::span<const CableReading> cables) {
  if (phase_ == Phase::kBoot) {
    master_.Enable(now_us);
    Enter(Phase::kEnabling, now_us);
  } else if (Status status = CheckDrives(); !status.ok) {
    return status;
  }
  const std::int64_t spent_us = now_us - begin_us_;
  switch (phase_) {
    case Phase::kBoot:
    case Phase::kDone:
      break;
    case Phase::kEnabling:
      if (spent_us > kEnableLimit_us) {
        return {false, fmt::format("enabling the drives took longer than {} s:\n{}",
                                   kEnableLimit_us / 1'000'000, Describe(master_))};
      }
      if (!master_.enabled()) break;
      master_.SetMode(OperationMode::kCyclicVelocity);
      Enter(Phase::kHauling, now_us);
      Haul(now_us, cables);
      break;
    case Phase::kHauling:
      if (spent_us > kSlackLimit_us) {
        return {false, fmt::format("no end of the slack within {} s:\n{}",
                                   kSlackLimit_us / 1'000'000, Describe(master_))};
      }
      if (!found_) {
        Haul(now_us, cables);
        break;
      }
      GoToPretension(cables);
      Enter(Phase::kSettling, now_us);
      break;
    case Phase::kSettling:
      if (spent_us < kSettle_us) break;
      HoldPretension();
      Enter(Phase::kHolding, now_us);
      break;
    case Phase::kHolding:
      if (spent_us >= kSettle_us) Enter(Phase::kDone, now_us);
      break;
  }
  return {};
}

void BringUp::Haul(std::int64_t now_us, std::span<const CableReading> cables) {
  found_ = true;
  for (std::size_t i = 0; i < searches_.size(); ++i) {
    Search& search = searches_[i];
    const DriveReport& report = master_.drive(i);
    const double rate_m_s = winch_.metres_per_count * report.velocity_counts_s;
    const double acceleration = (rate_m_s - search.last_rate_m_s) / drives_.period_s;
    search.last_rate_m_s = rate_m_s;
    const double tension_n = TorqueToTension(winch_, report.torque_permille, 1.0, acceleration) -
                             drives_.cable_damping_n_s_m * rate_m_s;
    const bool pulls = now_us - begin_us_ > kStart_us && tension_n > kContact_n;
    if (search.reports < kReports) {
      search.reports = pulls ? search.reports + 1 : 0;
      // e = length + reeled (loop/plant_side/reel.h) is what the cable is stretched by.
      const double stretch_m = tension_n / drives_.cable_stiffness_n_m;
      const double length_m = cables.empty() ? 0.0 : cables[i].length_m;
      search.sum_counts = pulls ? search.sum_counts + report.position_counts + 0.5 -
                                      Counts(stretch_m) + Counts(length_m)
                                : 0.0;
    }
    const bool found = search.reports == kReports;
    master_.SetTarget(i,
                      {.velocity_counts_s =
                           found ? 0 : static_cast<std::int32_t>(std::lround(Counts(haul_m_s_)))});
    found_ = found_ && found;
  }
}

void BringUp::GoToPretension(std::span<const CableReading> cables) {
  master_.SetMode(OperationMode::kCyclicPosition);
  const double stretch_m = drives_.pretension_n / drives_.cable_stiffness_n_m;
  for (std::size_t i = 0; i < searches_.size(); ++i) {
    zero_counts_[i] = searches_[i].sum_counts / kReports;
    const double length_m = cables.empty() ? 0.0 : cables[i].length_m;
    const double target = zero_counts_[i] + Counts(stretch_m) - Counts(length_m) - 0.5;
    master_.SetTarget(i, {.position_counts = static_cast<std::int32_t>(std::lround(target))});
  }
}

// From here on the torque is commanded; stiction holds the pretension.
void BringUp::HoldPretension() {
  master_.SetMode(OperationMode::kCyclicTorque);
  const double hold = TensionToTorque(winch_, drives_.pretension_n, 0.0);
  for (std::size_t i = 0; i < searches_.size(); ++i) {
    master_.SetTarget(i, {.torque_permille = static_cast<std::int16_t>(std::lround(hold))});
  }
}

}  // namespace mantle::loop
