#include "controller/tension_loop.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

namespace mantle::controller {
namespace {

// Found by random search over tracking errors with true, wrong (30 % more, 30 % less) friction and
// with noise on lambda, on a free-swimming mantle with an arm (docs/vehicle.md).
constexpr double kPositionGain = 1.0;   // of m / period^2 ...
constexpr double kStiffnessGain = 1.1;  // ... but at most this share of K
constexpr double kRateGain = 0.9;       // of m / period
constexpr double kInertiaShare = 0.5;
constexpr double kDirectionGain = 0.25;  // of 1 / period
constexpr double kSlowest_m_s = 0.004;
// Share of a new difference of lambda_dot in the estimate of lambda_ddot.
constexpr double kAccelerationShare = 0.5;
// Phase sqrt(K / m) period of the drum on its cable from which gains fade, to none at pi.
constexpr double kFullGainPhase = 1.2;
// A cable is not pushed: paying out takes at most so many times the sliding friction.
constexpr double kMostPush = 4.0;
constexpr int kPredictionSteps = 10;

void Check(const char* name, double value, double low, double high) {
  if (std::isfinite(value) && value >= low && value <= high) return;
  throw std::invalid_argument(
      fmt::format("tension loop: {} is {:.6g}, must be {:.3g} to {:.3g}", name, value, low, high));
}

}  // namespace

TensionLoop::TensionLoop(const WinchMap& map, const TensionLoopOptions& options)
    : map_(map), options_(options) {
  CheckWinchMap(map);
  Check("period [s]", options.period_s, 1e-4, 1.0);
  Check("stiffness [N/m]", options.stiffness_n_m, 1.0, 1e6);
  Check("damping [N s/m]", options.damping_n_s_m, 0.0, 1e4);
  const double mass_kg = map.mass_kg();
  const double phase = options.period_s * std::sqrt(options.stiffness_n_m / mass_kg);
  const double share =
      std::clamp((std::numbers::pi - phase) / (std::numbers::pi - kFullGainPhase), 0.0, 1.0);
  k1_n_m_ = share * std::min(kStiffnessGain * options.stiffness_n_m,
                             kPositionGain * mass_kg / (options.period_s * options.period_s));
  k2_n_s_m_ = share * kRateGain * mass_kg / options.period_s;
  inertia_share_ = share * kInertiaShare;
}

void TensionLoop::Reset() {
  has_past_ = false;
  torque_permille_ = length_rate_m_s_ = length_acceleration_m_s2_ = tension_n_ = 0;
}

TensionLoop::Motion TensionLoop::Predict(const TensionLoopInput& in) const {
  Motion now{in.reported_m, in.reported_rate_m_s};
  if (!has_past_) return now;
  const double mass_kg = map_.mass_kg();
  const double h = options_.period_s / kPredictionSteps;
  const double force_n = Force(torque_permille_);
  for (int i = 0; i < kPredictionSteps; ++i) {
    const double ago_s = options_.period_s - (i + 0.5) * h;
    const double e = now.reeled_m + in.length_m - ago_s * in.length_rate_m_s;
    const double tension_n =
        std::max(0.0, options_.stiffness_n_m * e +
                          options_.damping_n_s_m * (now.rate_m_s + in.length_rate_m_s));
    const double impulse = mass_kg * now.rate_m_s + h * (force_n - map_.mean_load() * tension_n);
    const double sliding = h * FrictionForce(map_, tension_n);
    const double holding = now.rate_m_s == 0.0 ? map_.stiction_ratio * sliding : sliding;
    now.rate_m_s =
        std::abs(impulse) <= holding ? 0.0 : (impulse - std::copysign(sliding, impulse)) / mass_kg;
    now.reeled_m += h * now.rate_m_s;
  }
  return now;
}

double TensionLoop::Update(const TensionLoopInput& in) {
  const double wanted_n = std::isfinite(in.tension_n) ? std::max(0.0, in.tension_n) : 0.0;
  if (!std::isfinite(in.tension_rate_n_s + in.length_m + in.length_rate_m_s + in.reported_m +
                     in.reported_rate_m_s)) {
    Reset();
    return std::min(TensionToTorque(map_, wanted_n, 0.0), map_.max_permille);
  }
  const double period_s = options_.period_s;
  if (has_past_) {
    const double difference = (in.length_rate_m_s - length_rate_m_s_) / period_s;
    length_acceleration_m_s2_ += kAccelerationShare * (difference - length_acceleration_m_s2_);
  }
  const Motion now = Predict(in);
  tension_n_ = std::max(0.0, options_.stiffness_n_m * (now.reeled_m + in.length_m) +
                                 options_.damping_n_s_m * (now.rate_m_s + in.length_rate_m_s));

  const double position_error = wanted_n / options_.stiffness_n_m - in.length_m - now.reeled_m;
  const double asked_rate = in.tension_rate_n_s / options_.stiffness_n_m - in.length_rate_m_s;
  const double rate_at_end = asked_rate - period_s * length_acceleration_m_s2_;
  const double going =
      0.5 * (now.rate_m_s + rate_at_end) + kDirectionGain * position_error / period_s;
  const double sigma = std::clamp(going / kSlowest_m_s, -1.0, 1.0);

  const double mid_n = std::max(0.0, wanted_n + 0.5 * period_s * in.tension_rate_n_s);
  const double extra_n = k1_n_m_ * position_error + k2_n_s_m_ * (asked_rate - now.rate_m_s);
  const double torque =
      TensionToTorque(map_, mid_n, sigma, -inertia_share_ * length_acceleration_m_s2_) +
      extra_n * map_.metres_per_rad / map_.permille_nm;
  const double push = kMostPush * map_.friction_torque_nm / map_.permille_nm;
  torque_permille_ = std::clamp(torque, -std::min(push, map_.max_permille), map_.max_permille);
  length_rate_m_s_ = in.length_rate_m_s;
  has_past_ = true;
  return torque_permille_;
}

}  // namespace mantle::controller
