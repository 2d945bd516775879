#include "firmware_sim/drive/drive.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <stdexcept>

namespace mantle::firmware_sim {
namespace {

constexpr NodeId kLastDriveNode = kMaxNode - 1;
constexpr double kTick_s = 1e-6 * static_cast<double>(kControlTick_us);
constexpr double kRatedTorque_nm = 1e-3 * kRatedTorque_mnm;
constexpr double kRatedCurrent_a = 1e-3 * kRatedCurrent_ma;
constexpr double kShortFactor = 0.1;

template <class Integer>
std::uint32_t Saturated(double value) {
  const double low = std::numeric_limits<Integer>::min();
  const double high = std::numeric_limits<Integer>::max();
  return static_cast<std::uint32_t>(
      static_cast<std::int64_t>(std::lround(std::clamp(value, low, high))));
}

NodeId Checked(NodeId node) {
  if (node < 1 || node > kLastDriveNode) {
    throw std::invalid_argument(fmt::format("drive node {} outside 1..{}", node, kLastDriveNode));
  }
  return node;
}

}  // namespace

Drive::Drive(const DriveConfig& config, std::int64_t start_us)
    : node_(Checked(config.node)),
      winch_(kMotor, kWinch),
      supply_v_(kStage.supply_v),
      now_us_(start_us),
      next_tick_us_(start_us + kControlTick_us) {
  if (!SetCable(config.cable)) {
    throw std::invalid_argument(fmt::format(
        "cable of drive {}: tension {} N, changing by {} N/s, stiffness {} N/m, damping {} N s/m, "
        "at {} m reeled in: must be finite, stiffness and damping not below 0",
        config.node, config.cable.tension_n, config.cable.tension_rate_n_s,
        config.cable.stiffness_n_m, config.cable.damping_n_s_m, config.cable.at_reeled_m));
  }
  node_.Boot(start_us, false);
  state_ = DriveState::kSwitchOnDisabled;  // transitions 0 and 1
  RefreshObjects();
}

bool Drive::SetCable(const CableLoad& cable) {
  for (const double value : {cable.tension_n, cable.tension_rate_n_s, cable.at_reeled_m,
                             cable.stiffness_n_m, cable.damping_n_s_m}) {
    if (!std::isfinite(value)) return false;
  }
  if (cable.stiffness_n_m < 0.0 || cable.damping_n_s_m < 0.0) return false;
  around_.cable = cable;
  return true;
}

void Drive::Disturb(Disturbance disturbance) {
  disturbance_ = disturbance;
  around_.winding_short_factor = disturbance == Disturbance::kWindingShort ? kShortFactor : 1.0;
}

void Drive::AdvanceTo(std::int64_t time_us) {
  while (now_us_ + kSubStep_us <= time_us) {
    SubStep();
    now_us_ += kSubStep_us;
    if (now_us_ >= next_tick_us_) {
      next_tick_us_ += kControlTick_us;
      Tick();
    }
  }
}

void Drive::SubStep() {
  WinchCommand command;
  command.powered = stage_command_.powered && !stage_tripped_;
  command.brake_closed = stage_command_.brake_closed || disturbance_ == Disturbance::kJammed;
  if (command.powered) {
    const double reference_a =
        1e-3 * stage_command_.torque * kRatedTorque_nm / kMotor.torque_constant_nm_a;
    const double speed_rad_s =
        tracker_.measured().velocity_counts_s * 2.0 * std::numbers::pi / kWinch.counts_per_turn;
    command.voltage_v = regulator_.Voltage(kMotor, reference_a, winch_.current_a(),
                                           encoder_broken_ ? 0.0 : speed_rad_s, Supply_v());
  }
  winch_.Step(command, around_);
  around_.cable.tension_n += around_.cable.tension_rate_n_s * kSubStep_s;
  if (std::abs(winch_.current_a()) > kStage.over_current_a) stage_tripped_ = true;
}

void Drive::Tick() {
  around_.ambient_c = Ambient_c();
  winch_.AdvanceThermal(around_, kTick_s);
  TickEncoder();
  Supervise();
  TickMotion();
  FinishReset();
  RefreshObjects();
  node_.Tick(now_us_);
}

void Drive::TickEncoder() {
  const bool broken = disturbance_ == Disturbance::kEncoderBroken;
  if (broken) {
    // The counter stands still and says nothing of the speed.
    encoder_broken_ = true;
    return;
  }
  if (encoder_broken_) tracker_ = EncoderTracker(winch_.encoder_counts());
  encoder_broken_ = false;
  const double torque_nm = winch_.current_a() * kMotor.torque_constant_nm_a;
  tracker_.Update(winch_.encoder_counts(), 1000.0 * torque_nm / kRatedTorque_nm);
}

ReleaseInputs Drive::GatherInputs() const {
  return {tracker_.measured(), winch_.tension_n() < kWinch.slack_tension_n, StageMayRun(),
          !encoder_broken_};
}

StopKind Drive::WantedStop() const {
  if (state_ == DriveState::kQuickStopActive) {
    switch (node_.objects().Number(Slot(object::kQuickStopOption))) {
      case 1:
      case 5:
        return StopKind::kRamp;
      case 2:
      case 6:
        return StopKind::kQuick;
      default:
        return StopKind::kAtOnce;
    }
  }
  if ((last_controlword_ & controlword::kHalt) == 0) return StopKind::kNone;
  switch (node_.objects().Number(Slot(object::kHaltOption))) {
    case 1:
      return StopKind::kRamp;
    case 2:
      return StopKind::kQuick;
    default:
      return StopKind::kAtOnce;
  }
}

void Drive::TickMotion() {
  const ReleaseInputs inputs = GatherInputs();
  if (state_ != DriveState::kOperationEnabled && state_ != DriveState::kQuickStopActive) {
    stage_command_ = release_.Tick(node_.objects(), inputs, motion_, now_us_);
    if (!stage_command_.powered) regulator_.Reset();
    if (state_ == DriveState::kFaultReactionActive && release_.phase() == ReleasePhase::kBraked) {
      state_ = DriveState::kFault;  // transition 14
    }
    return;
  }
  const auto mode = static_cast<OperationMode>(node_.objects().Number(Slot(object::kMode)));
  if (mode != motion_.mode()) {
    motion_.Start(mode, inputs.measured, motion_.torque());
    motion_.OnTargets(node_.objects());
  }
  stage_command_ = {true, false, motion_.Tick(node_.objects(), inputs.measured, WantedStop())};
  if (state_ == DriveState::kQuickStopActive) FinishQuickStop(inputs.measured);
}

void Drive::FinishQuickStop(const Measured& measured) {
  if (node_.objects().Number(Slot(object::kQuickStopOption)) >= 5) return;
  const bool late = now_us_ - stopping_since_us_ > kDecelerationTimeout_us;
  const bool still = motion_.mode() == OperationMode::kCyclicTorque ||
                     std::abs(measured.velocity_counts_s) < kStandstill_counts_s;
  if (!late && !(still && motion_.at_standstill())) return;
  state_ = DriveState::kSwitchOnDisabled;  // transition 12 by itself
  // The torque may still hold a position.
  release_.Begin(ReleaseKind::kTorqueRamp, motion_, now_us_);
}

std::uint16_t Drive::Statusword() const {
  unsigned word = EncodeState(state_);
  const double supply_v = Supply_v();
  const bool enabled = state_ == DriveState::kOperationEnabled;
  if (supply_v >= kStage.under_voltage_v && supply_v <= kStage.over_voltage_v) {
    word |= statusword::kVoltageEnabled;
  }
  if (node_.emergency().IsPresent(EmcyCode::kPdoLength) ||
      winch_.winding_c() > kStage.winding_warning_c) {
    word |= statusword::kWarning;
  }
  if (node_.state() != NmtState::kStopped) word |= statusword::kRemote;
  if (enabled && motion_.limited()) word |= statusword::kInternalLimit;
  if (enabled && !motion_.limited() && (last_controlword_ & controlword::kHalt) == 0) {
    word |= statusword::kFollowsCommand;
  }
  if (node_.emergency().IsPresent(EmcyCode::kFollowingError)) word |= statusword::kFollowingError;
  return static_cast<std::uint16_t>(word);
}

void Drive::RefreshObjects() {
  ObjectDictionary& objects = node_.objects();
  const double current_a = winch_.current_a();
  const double torque_nm = current_a * kMotor.torque_constant_nm_a;
  const Measured& measured = tracker_.measured();
  objects.Store(Slot(object::kStatusword), Statusword());
  objects.Store(Slot(object::kTorqueActual),
                Saturated<std::int16_t>(1000.0 * torque_nm / kRatedTorque_nm));
  objects.Store(Slot(object::kCurrentActual),
                Saturated<std::int16_t>(1000.0 * current_a / kRatedCurrent_a));
  if (!encoder_broken_) {
    objects.Store(Slot(object::kPositionActual),
                  static_cast<std::uint32_t>(winch_.encoder_counts()));
  }
  objects.Store(Slot(object::kVelocityActual), Saturated<std::int32_t>(measured.velocity_counts_s));
  objects.Store(Slot(object::kModeDisplay), objects.Raw(Slot(object::kMode)));
  objects.Store(Slot(object::kTemperature), Saturated<std::int8_t>(winch_.winding_c()));
}

}  // namespace mantle::firmware_sim
