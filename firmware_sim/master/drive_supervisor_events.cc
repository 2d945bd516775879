#include <algorithm>
#include <cstdlib>

#include "firmware_sim/bus/wire.h"
#include "firmware_sim/master/drive_supervisor.h"

/// What a drive's frames tell its supervisor: TPDOs, EMCY, heartbeats and boot-ups.

namespace mantle::firmware_sim {

namespace {

constexpr int kCyclesAtRest = 3;

}  // namespace

void DriveSupervisor::OnFrame(const CanFrame& frame, std::int64_t now_us) {
  const NodeId node = report_.node;
  const std::uint8_t* data = frame.data.data();
  // Whatever it sends, it lives: on a bad cable a few heartbeats in a row may be missing.
  report_.last_heard_us = now_us;
  if (frame.id == CobTpdo1(node)) {
    if (frame.size < 8) {
      ++report_.short_frames;
      return;
    }
    ++report_.tpdo1_count;
    ++answers_;
    ++answers_in_window_;
    report_.statusword = static_cast<std::uint16_t>(LoadLe(data, 2));
    report_.torque_permille = static_cast<std::int16_t>(LoadLe(data + 2, 2));
    report_.position_counts = static_cast<std::int32_t>(LoadLe(data + 4, 4));
    report_.tpdo1_time_us = frame.time_us;
    report_.status_valid = true;
    OnStatusword(now_us);
  } else if (frame.id == CobTpdo2(node)) {
    if (frame.size < 8) {
      ++report_.short_frames;
      return;
    }
    ++report_.tpdo2_count;
    report_.velocity_counts_s = static_cast<std::int32_t>(LoadLe(data, 4));
    report_.current_permille = static_cast<std::int16_t>(LoadLe(data + 4, 2));
    report_.mode_display = static_cast<std::int8_t>(data[6]);
    report_.temperature_celsius = static_cast<std::int8_t>(data[7]);
  } else if (frame.id == CobSdoReply(node)) {
    sdo_.OnReply(frame);
  } else if (frame.id == CobEmcy(node)) {
    if (frame.size < 3) {
      ++report_.short_frames;
      return;
    }
    std::rotate(report_.emcy.begin(), report_.emcy.end() - 1, report_.emcy.end());
    report_.emcy[0] = {now_us, static_cast<EmcyCode>(LoadLe(data, 2)), data[2]};
    ++report_.emcy_count;
  } else if (frame.id == CobHeartbeat(node)) {
    OnHeartbeat(frame, now_us);
  }
}

void DriveSupervisor::OnHeartbeat(const CanFrame& frame, std::int64_t now_us) {
  if (frame.size < 1) {
    ++report_.short_frames;
    return;
  }
  report_.heard = true;
  // Bit 7 is a toggle bit of node guarding, which nobody uses here.
  report_.nmt = static_cast<NmtState>(frame.data[0] & 0x7FU);
  if (report_.nmt == NmtState::kBootUp) {
    OnBootUp(now_us);
    return;
  }
  switch (report_.step) {
    case DriveStep::kStart:
      // Entered only after the start command left: an older heartbeat says pre-operational.
      break;
    case DriveStep::kClearFault:
    case DriveStep::kEnable:
    case DriveStep::kEnabled:
    case DriveStep::kReady:
      // It left operational by itself: a fault, or a reboot whose boot-up message was lost.
      if (report_.nmt != NmtState::kOperational) EnterStep(DriveStep::kExamine, now_us);
      break;
    case DriveStep::kLost:
      EnterStep(DriveStep::kExamine, now_us);
      break;
    case DriveStep::kStopNmt:
      if (report_.nmt == NmtState::kStopped) EnterStep(DriveStep::kStopped, now_us);
      break;
    case DriveStep::kFailed:
      // It answers again after all.
      if (report_.problem == DriveProblem::kNoAnswer && goal_ != Goal::kStopped) Restart(now_us);
      break;
    default:
      break;
  }
}

void DriveSupervisor::OnBootUp(std::int64_t now_us) {
  // During identification it is the power-on that everybody expects.
  if (report_.step != DriveStep::kIdentify || sub_step_ > 0) ++report_.reboots;
  report_.nmt = NmtState::kPreOperational;
  if (goal_ == Goal::kStopped) {
    EnterStep(DriveStep::kStopNmt, now_us);
    return;
  }
  report_.problem = DriveProblem::kNone;
  Restart(now_us);
}

void DriveSupervisor::OnStatusword(std::int64_t now_us) {
  // A TPDO proves what the next heartbeat will say.
  if (report_.step == DriveStep::kStart) report_.nmt = NmtState::kOperational;
  const DriveState state = report_.state();
  const bool faulty = state == DriveState::kFault || state == DriveState::kFaultReactionActive;
  switch (report_.step) {
    case DriveStep::kStart:
      if (state == DriveState::kNotReady || state == DriveState::kFaultReactionActive) break;
      EnterStep(faulty ? DriveStep::kClearFault : DriveStep::kEnable, now_us);
      reset_bit_ = false;
      break;
    case DriveStep::kClearFault:
      if (!faulty && state != DriveState::kNotReady) EnterStep(DriveStep::kEnable, now_us);
      break;
    case DriveStep::kEnable:
      if (faulty) {
        Fail(DriveProblem::kFault, DriveStep::kFaulted, now_us);
      } else if (goal_ == Goal::kEnabled && state == DriveState::kOperationEnabled) {
        report_.problem = DriveProblem::kNone;
        EnterStep(DriveStep::kEnabled, now_us);
      } else if (goal_ == Goal::kReady && state == DriveState::kReadyToSwitchOn) {
        report_.problem = DriveProblem::kNone;
        EnterStep(DriveStep::kReady, now_us);
      }
      break;
    case DriveStep::kEnabled:
    case DriveStep::kReady:
      if (faulty) {
        Fail(DriveProblem::kFault, DriveStep::kFaulted, now_us);
      } else if (report_.step == DriveStep::kEnabled && state != DriveState::kOperationEnabled) {
        EnterStep(DriveStep::kEnable, now_us);
      }
      break;
    case DriveStep::kStopRamp:
      at_rest_ = std::abs(int{report_.torque_permille}) <= options_.rest_torque_permille
                     ? at_rest_ + 1
                     : 0;
      if (faulty || state != DriveState::kOperationEnabled) {
        EnterStep(DriveStep::kStopDisable, now_us);
      } else if (at_rest_ >= kCyclesAtRest) {
        EnterStep(DriveStep::kStopDisable, now_us);
      }
      break;
    case DriveStep::kStopDisable:
      if (faulty || state == DriveState::kSwitchOnDisabled) {
        EnterStep(DriveStep::kStopNmt, now_us);
      }
      break;
    default:
      break;
  }
}

}  // namespace mantle::firmware_sim
