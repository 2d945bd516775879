#include "loop/control_side/motor_health.h"

#include <algorithm>
#include <cmath>

namespace mantle::loop {
namespace {

constexpr double kSlackShare = 0.15;  // of the motor's range: inertia, quantisation, noise
constexpr double kMean_s = 0.1;       // over which reports and commands are averaged
constexpr double kTellsShare = 0.1;  // of the range: a command above it tells whether a motor pulls
constexpr double kDeadShare = 1.0 / 3.0;  // of such a command
constexpr double kFullShare = 0.98;       // of the most that an estimate may say

}  // namespace

MotorHealth::MotorHealth(const controller::WinchMap& map,
                         const std::vector<controller::MotorLimits>& limits,
                         std::vector<double> gain_square, double period_s)
    : map_(map),
      given_(limits),
      limits_(limits),
      gain_square_(std::move(gain_square)),
      period_s_(period_s),
      states_(limits.size()),
      missing_(model::VectorX::Zero(static_cast<Eigen::Index>(limits.size()))) {}

void MotorHealth::Update(std::span<const MotorEvidence> evidence) {
  changed_ = false;
  for (std::size_t i = 0; i < states_.size(); ++i) {
    const MotorEvidence& e = evidence[i];
    const firmware_sim::DriveReport& drive = *e.drive;
    State& state = states_[i];
    const double range_n = gain_square_[i] * given_[i].max_tension_n;
    const double slack_n = kSlackShare * range_n;
    state.disabled = drive.step != firmware_sim::DriveStep::kEnabled;
    double actual_n = 0, command_n = e.command_n;
    if (state.disabled) {
      state.fresh = true;
    } else {
      const double torque = drive.torque_permille, sigma = map_.stiction_ratio;
      const double share = std::min(1.0, period_s_ / kMean_s);
      if (state.fresh) {  // innocent until the reports say otherwise
        state.command_n = state.reckoned_n = state.least_n = state.most_n = e.command_n;
        state.fresh = false;
      }
      const auto average = [&](double now, double* mean) { return *mean += share * (now - *mean); };
      command_n = average(e.command_n, &state.command_n);
      const double reckoned_n = average(e.reckoned_n, &state.reckoned_n);
      const double least_n =
          average(TorqueToTension(map_, torque, sigma), &state.least_n) - slack_n;
      const double most_n = average(TorqueToTension(map_, torque, -sigma), &state.most_n) + slack_n;
      actual_n = std::clamp(command_n, std::max(0.0, reckoned_n - slack_n),
                            std::max(0.0, reckoned_n + slack_n));
      actual_n = std::clamp(actual_n, std::max(0.0, least_n), std::max(0.0, most_n));
    }
    missing_(static_cast<Eigen::Index>(i)) = (actual_n - command_n) / gain_square_[i];
    const bool tells = command_n > kTellsShare * range_n;
    if (tells) {
      const bool pulls =
          state.disabled || actual_n - slack_n > kDeadShare * command_n || actual_n >= command_n;
      state.dead_s = pulls ? 0.0 : state.dead_s + period_s_;
    }
    state.dead = state.dead || state.dead_s > kDead_s;
  }
  SetLimits();
}

void MotorHealth::UpdateBias(const model::VectorX& bias_n, double most_share) {
  for (std::size_t i = 0; i < states_.size(); ++i) {
    State& state = states_[i];
    const double most_n = most_share * given_[i].max_tension_n;
    const bool full = most_n > 0 && bias_n(static_cast<Eigen::Index>(i)) < -kFullShare * most_n;
    state.saturated_s = full ? state.saturated_s + period_s_ : 0.0;
    state.saturated = state.saturated || state.saturated_s > kSaturated_s;
  }
  SetLimits();
}

void MotorHealth::SetLimits() {
  for (std::size_t i = 0; i < states_.size(); ++i) {
    const bool lost = states_[i].lost();
    const double low = lost ? 0.0 : given_[i].min_tension_n;
    const double high = lost ? 0.0 : given_[i].max_tension_n;
    changed_ = changed_ || limits_[i].max_tension_n != high;
    limits_[i].min_tension_n = low;
    limits_[i].max_tension_n = high;
  }
}

int MotorHealth::lost_count() const {
  return static_cast<int>(
      std::count_if(states_.begin(), states_.end(), [](const State& s) { return s.lost(); }));
}

}  // namespace mantle::loop
