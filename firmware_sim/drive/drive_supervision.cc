#include <array>
#include <cmath>
#include <cstdlib>

#include "firmware_sim/drive/drive.h"

/// The faults of a drive: when each trips, how long its cause lasts, what follows.
///
///   code  trips                                          its cause lasts while
///   2310  |current| above the comparator's level         the winding measures less than half
///   3210  supply above 16 V                              as long
///   3220  supply below 9 V, switched on or further       supply below 9 V
///   4210  board above 85 deg C                           above 80 deg C
///   4310  winding above 115 deg C                        above 100 deg C
///   7320  a line of the encoder is broken                as long
///   8130  heartbeat overdue (1016)                       until a heartbeat and NMT start
///   8250  enabled, RPDO or SYNC overdue (1400:5)         until both come again
///   8611  mode 8, |demand - actual| above 6065           over with the reaction

namespace mantle::firmware_sim {
namespace {

constexpr std::array<EmcyCode, 9> kFaults = {
    EmcyCode::kOverCurrent,           EmcyCode::kOverVoltage,          EmcyCode::kUnderVoltage,
    EmcyCode::kOverTemperatureDevice, EmcyCode::kOverTemperatureMotor, EmcyCode::kEncoder,
    EmcyCode::kHeartbeatLost,         EmcyCode::kRpdoTimeout,          EmcyCode::kFollowingError};

constexpr double kBoardHysteresis_k = 5.0;
/// The board sits in the housing of the electronics and is that much warmer than the water.
constexpr double kBoardRise_k = 8.0;
/// A winding that measures less than half its resistance is shorted.
constexpr double kShortedShare = 0.5;
constexpr double kDisturbedHigh_v = 18.0;
constexpr double kDisturbedLow_v = 7.0;
constexpr double kDisturbedAmbient_c = 95.0;
constexpr std::int64_t kNoFollowingWindow = 0xFFFFFFFF;

}  // namespace

double Drive::Supply_v() const {
  if (disturbance_ == Disturbance::kOverVoltage) return kDisturbedHigh_v;
  if (disturbance_ == Disturbance::kUnderVoltage) return kDisturbedLow_v;
  return supply_v_;
}

double Drive::Ambient_c() const {
  return disturbance_ == Disturbance::kHotSurroundings ? kDisturbedAmbient_c : ambient_c_;
}

bool Drive::StageMayRun() const {
  const double supply_v = Supply_v();
  return !stage_tripped_ && supply_v >= kStage.under_voltage_v && supply_v <= kStage.over_voltage_v;
}

bool Drive::Trips(EmcyCode code) {
  const PowerStageData& limit = kStage;
  const bool active =
      state_ == DriveState::kOperationEnabled || state_ == DriveState::kQuickStopActive;
  switch (code) {
    case EmcyCode::kOverCurrent:
      return stage_tripped_;
    case EmcyCode::kOverVoltage:
      return Supply_v() > limit.over_voltage_v;
    case EmcyCode::kUnderVoltage:
      return (active || state_ == DriveState::kSwitchedOn) && Supply_v() < limit.under_voltage_v;
    case EmcyCode::kOverTemperatureDevice:
      return Ambient_c() + kBoardRise_k > limit.max_board_c;
    case EmcyCode::kOverTemperatureMotor:
      return winch_.winding_c() > limit.max_winding_c;
    case EmcyCode::kEncoder:
      return encoder_broken_;
    case EmcyCode::kHeartbeatLost:
      return node_.IsHeartbeatLost(now_us_);
    case EmcyCode::kRpdoTimeout:
      return active && node_.IsRpdoOverdue(now_us_);
    case EmcyCode::kFollowingError: {
      const std::int64_t window = node_.objects().Number(Slot(object::kFollowingErrorWindow));
      return state_ == DriveState::kOperationEnabled && window != kNoFollowingWindow &&
             std::abs(motion_.following_error()) > static_cast<double>(window);
    }
    default:
      return false;
  }
}

bool Drive::Lasts(EmcyCode code) {
  const PowerStageData& limit = kStage;
  const bool operational = node_.state() == NmtState::kOperational;
  switch (code) {
    case EmcyCode::kOverCurrent:
      return winch_.resistance_ohm() < kShortedShare * kMotor.resistance_ohm;
    case EmcyCode::kUnderVoltage:
      return Supply_v() < limit.under_voltage_v;
    case EmcyCode::kOverTemperatureDevice:
      return Ambient_c() + kBoardRise_k > limit.max_board_c - kBoardHysteresis_k;
    case EmcyCode::kOverTemperatureMotor:
      return winch_.winding_c() > limit.winding_warning_c;
    case EmcyCode::kHeartbeatLost:
      return !operational || node_.IsHeartbeatLost(now_us_);
    case EmcyCode::kRpdoTimeout:
      return !operational || node_.IsRpdoOverdue(now_us_);
    case EmcyCode::kFollowingError:
      return false;
    default:
      return Trips(code);
  }
}

void Drive::Supervise() {
  if (reset_pending_) return;
  for (const EmcyCode code : kFaults) {
    if (!node_.emergency().IsPresent(code) && Trips(code)) OnFault(code);
  }
}

void Drive::OnFault(EmcyCode code) {
  if (state_ != DriveState::kFault && state_ != DriveState::kFaultReactionActive) {
    const auto option = node_.objects().Number(Slot(object::kFaultReactionOption));
    const bool open = option == 0 || !StageMayRun();
    const auto powered = option == 2 ? ReleaseKind::kDecelerate : ReleaseKind::kTorqueRamp;
    release_.Begin(open ? ReleaseKind::kOpenWinding : powered, motion_, now_us_);
    state_ = DriveState::kFaultReactionActive;  // transition 13
  }
  node_.Raise(code);
  if (code == EmcyCode::kHeartbeatLost) node_.OnCommunicationError();
}

void Drive::ResetFault() {
  for (const EmcyCode code : kFaults) {
    if (node_.emergency().IsPresent(code) && Lasts(code)) return;
  }
  stage_tripped_ = false;
  for (const EmcyCode code : kFaults) node_.Clear(code);
  node_.Clear(EmcyCode::kPdoLength);
  state_ = DriveState::kSwitchOnDisabled;
}

}  // namespace mantle::firmware_sim
