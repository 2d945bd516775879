#include "firmware_sim/drive/motion.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "firmware_sim/canopen/motor_data.h"

namespace mantle::firmware_sim {
namespace {

constexpr double kTick_s = 1e-6 * static_cast<double>(kControlTick_us);

/// Poles of the observer [rad/s]: as fast as a tick of 1 ms carries (w h = 0.5) with a step of one
/// count moving the torque by less than 1 % of rated.
constexpr double kObserverPole = 500.0;
/// Velocity loop [rad/s].
constexpr double kVelocityBandwidth = 200.0;
/// Position loop [1/s]: a fifth of the velocity loop's bandwidth.
constexpr double kPositionGain = 40.0;

constexpr double Inertia_kgm2() {
  constexpr MotorData kMotor;
  constexpr WinchData kWinch;
  return kMotor.rotor_inertia_kgm2 +
         kWinch.drum_inertia_kgm2 / (kWinch.gear_ratio * kWinch.gear_ratio);
}
constexpr double kRadPerCount = 2.0 * std::numbers::pi / WinchData{}.counts_per_turn;
constexpr double kTorquePerMille_nm = 1e-3 * 1e-3 * kRatedTorque_mnm;

/// Acceleration [counts/s^2] that 1/1000 of the rated torque gives rotor and drum alone.
constexpr double kAccelerationPerMille = kTorquePerMille_nm / Inertia_kgm2() / kRadPerCount;

double Approach(double value, double goal, double step) {
  return value < goal ? std::min(value + step, goal) : std::max(value - step, goal);
}

/// Ticks of the interpolation period 60C2, at least one.
int InterpolationTicks(const ObjectDictionary& objects) {
  const auto value = static_cast<double>(objects.Raw(Slot(object::kInterpolationPeriod, 1)));
  const auto exponent = static_cast<double>(objects.Number(Slot(object::kInterpolationPeriod, 2)));
  const double ticks = value * std::pow(10.0, exponent) / kTick_s;
  return std::max(1, static_cast<int>(std::lround(ticks)));
}

double Value(const ObjectDictionary& objects, std::size_t slot) {
  return static_cast<double>(objects.Number(slot));
}

/// Limits 607D count where minimum < maximum.
bool HasPositionLimits(const ObjectDictionary& objects) {
  return objects.Number(Slot(object::kPositionLimits, 1)) <
         objects.Number(Slot(object::kPositionLimits, 2));
}

}  // namespace

void EncoderTracker::Update(std::int64_t counts, double torque) {
  constexpr double w = kObserverPole;
  // Half a count: the encoder rounds down.
  const double error = static_cast<double>(counts) + 0.5 - measured_.position_counts;
  const double acceleration = kAccelerationPerMille * torque + measured_.load_counts_s2;
  measured_.position_counts += kTick_s * (measured_.velocity_counts_s + 3.0 * w * error);
  measured_.velocity_counts_s += kTick_s * (acceleration + 3.0 * w * w * error);
  measured_.load_counts_s2 += kTick_s * w * w * w * error;
}

void Motion::Start(OperationMode mode, const Measured& now, double torque) {
  mode_ = mode;
  demand_position_ = goal_position_ = now.position_counts;
  demand_velocity_ = goal_velocity_ = now.velocity_counts_s;
  ticks_to_goal_ = 0;
  torque_ = torque;
  following_error_ = 0.0;
  stopping_ = limited_ = at_standstill_ = false;
}

void Motion::OnTargets(const ObjectDictionary& objects) {
  if (stopping_) return;
  goal_velocity_ = Value(objects, Slot(object::kTargetVelocity));
  goal_position_ = Value(objects, Slot(object::kTargetPosition));
  limited_ = false;
  if (HasPositionLimits(objects)) {
    const double goal = goal_position_;
    goal_position_ = std::clamp(goal, Value(objects, Slot(object::kPositionLimits, 1)),
                                Value(objects, Slot(object::kPositionLimits, 2)));
    limited_ = mode_ == OperationMode::kCyclicPosition && goal_position_ != goal;
  }
  ticks_to_goal_ = InterpolationTicks(objects);
}

double Motion::Tick(const ObjectDictionary& objects, const Measured& now, StopKind stop) {
  if (stop == StopKind::kNone && stopping_) Start(mode_, now, torque_);
  if (stop != StopKind::kNone) {
    torque_ = StopTick(objects, now, stop);
    return torque_;
  }
  const bool target_limited = mode_ == OperationMode::kCyclicPosition && limited_;
  limited_ = false;
  const double offset = Value(objects, Slot(object::kTorqueOffset));
  double torque = offset;
  following_error_ = 0.0;
  if (mode_ == OperationMode::kCyclicPosition) {
    torque += PositionTick(now);
  } else if (mode_ == OperationMode::kCyclicVelocity) {
    torque += VelocityTick(objects, now);
  } else {
    torque += Value(objects, Slot(object::kTargetTorque));
  }
  torque_ = ClipTorque(objects, now, torque);
  limited_ = limited_ || target_limited;
  return torque_;
}

double Motion::PositionTick(const Measured& now) {
  double feed_forward = 0.0;
  if (ticks_to_goal_ > 0) {
    const double step = (goal_position_ - demand_position_) / ticks_to_goal_;
    demand_position_ += step;
    feed_forward = step / kTick_s;
    --ticks_to_goal_;
  }
  following_error_ = demand_position_ - now.position_counts;
  demand_velocity_ = kPositionGain * following_error_ + feed_forward;
  return VelocityLoop(demand_velocity_, now);
}

double Motion::VelocityTick(const ObjectDictionary& objects, const Measured& now) {
  if (ticks_to_goal_ > 0) {
    demand_velocity_ += (goal_velocity_ - demand_velocity_) / ticks_to_goal_;
    --ticks_to_goal_;
  }
  double demand = demand_velocity_;
  if (HasPositionLimits(objects)) {
    const double x = now.position_counts;
    const bool above = x >= Value(objects, Slot(object::kPositionLimits, 2));
    const bool below = x <= Value(objects, Slot(object::kPositionLimits, 1));
    if ((above && demand > 0.0) || (below && demand < 0.0)) {
      demand = 0.0;
      limited_ = true;
    }
  }
  return VelocityLoop(demand, now);
}

double Motion::VelocityLoop(double demand, const Measured& now) {
  const double acceleration = kVelocityBandwidth * (demand - now.velocity_counts_s);
  return (acceleration - now.load_counts_s2) / kAccelerationPerMille;
}

double Motion::TickPayOut(double demand_counts_s, const Measured& now, double max_torque) {
  torque_ = std::clamp(VelocityLoop(demand_counts_s, now), -max_torque, 0.0);
  return torque_;
}

double Motion::StopTick(const ObjectDictionary& objects, const Measured& now, StopKind stop) {
  if (!stopping_) {
    stopping_ = true;
    at_standstill_ = false;
    demand_position_ = now.position_counts;
    demand_velocity_ = now.velocity_counts_s;
  }
  following_error_ = 0.0;
  limited_ = false;
  if (mode_ == OperationMode::kCyclicTorque) {
    const double slope = Value(objects, Slot(object::kTorqueSlope)) * kTick_s;
    torque_ = stop == StopKind::kAtOnce ? 0.0 : Approach(torque_, 0.0, slope);
    at_standstill_ = torque_ == 0.0;
    return torque_;
  }
  const std::size_t slot =
      stop == StopKind::kQuick ? Slot(object::kQuickStopDeceleration) : Slot(object::kDeceleration);
  const double step = Value(objects, slot) * kTick_s;
  demand_velocity_ = stop == StopKind::kAtOnce ? 0.0 : Approach(demand_velocity_, 0.0, step);
  demand_position_ += demand_velocity_ * kTick_s;
  at_standstill_ = demand_velocity_ == 0.0;
  const double velocity =
      demand_velocity_ + kPositionGain * (demand_position_ - now.position_counts);
  return ClipTorque(objects, now, VelocityLoop(velocity, now));
}

double Motion::ClipTorque(const ObjectDictionary& objects, const Measured& now, double torque) {
  const double max_torque = Value(objects, Slot(object::kMaxTorque));
  double low = -max_torque;
  double high = max_torque;
  if (mode_ == OperationMode::kCyclicTorque && HasPositionLimits(objects)) {
    const double x = now.position_counts;
    if (x >= Value(objects, Slot(object::kPositionLimits, 2))) high = 0.0;
    if (x <= Value(objects, Slot(object::kPositionLimits, 1))) low = 0.0;
  }
  const double clipped = std::clamp(torque, low, high);
  limited_ = limited_ || clipped != torque;
  return clipped;
}

}  // namespace mantle::firmware_sim
