#include "firmware_sim/drive/drive.h"

/// What frames ask of a drive: NMT, SYNC, SDO writes, the controlword.

namespace mantle::firmware_sim {

void Drive::OnFrame(const CanFrame& frame, std::int64_t time_us) {
  AdvanceTo(time_us);
  RefreshObjects();
  const NodeEvents events = node_.OnFrame(frame, now_us_, IsEnabled(state_));
  if (events.nmt) OnNmt(events.command);
  if (events.sync) {
    OnSync();
    return;
  }
  if (events.has_written) OnSdoWrite(events.written_slot);
  if (events.controlword) OnControlword();
}

void Drive::OnSync() {
  if (node_.LatchRpdos()) OnControlword();
  motion_.OnTargets(node_.objects());
  RefreshObjects();
  node_.SendSyncTpdos(now_us_);
}

void Drive::OnSdoWrite(std::size_t slot) {
  switch (kObjectTable[slot].index) {
    case object::kDisturbance:
      Disturb(static_cast<Disturbance>(node_.objects().Raw(slot)));
      break;
    case object::kTargetPosition:
    case object::kTargetVelocity:
      motion_.OnTargets(node_.objects());
      break;
    default:
      break;
  }
}

void Drive::OnNmt(NmtCommand command) {
  const bool active =
      state_ == DriveState::kOperationEnabled || state_ == DriveState::kQuickStopActive;
  switch (command) {
    case NmtCommand::kStart:
    case NmtCommand::kPreOperational:
      // Nothing here: an enabled drive misses its RPDOs in pre-operational, and 8250 follows.
      break;
    case NmtCommand::kStop:
      if (active) {
        state_ = DriveState::kSwitchOnDisabled;
        release_.Begin(ReleaseKind::kTorqueRamp, motion_, now_us_);
      }
      break;
    case NmtCommand::kResetNode:
    case NmtCommand::kResetCommunication:
      if (active) {
        state_ = DriveState::kSwitchOnDisabled;
        release_.Begin(ReleaseKind::kTorqueRamp, motion_, now_us_);
      }
      reset_pending_ = true;
      start_up_until_us_ = now_us_ + kStartUpTime_us;
      reset_communication_only_ = command == NmtCommand::kResetCommunication;
      node_.Suspend();
      FinishReset();
      break;
  }
}

void Drive::FinishReset() {
  if (!reset_pending_) return;
  if (release_.holds_torque()) start_up_until_us_ = now_us_ + kStartUpTime_us;
  if (now_us_ < start_up_until_us_) return;
  reset_pending_ = false;
  last_controlword_ = 0;
  node_.Boot(now_us_, reset_communication_only_);
  const bool faulty = state_ == DriveState::kFault || state_ == DriveState::kFaultReactionActive;
  if (!(reset_communication_only_ && faulty)) state_ = DriveState::kSwitchOnDisabled;
}

void Drive::OnControlword() {
  const auto word = static_cast<std::uint16_t>(node_.objects().Raw(Slot(object::kControlword)));
  const DriveCommand command = DecodeCommand(word, last_controlword_, state_ == DriveState::kFault);
  last_controlword_ = word;
  if (command == DriveCommand::kNone) return;
  const auto option = static_cast<int>(node_.objects().Number(Slot(object::kQuickStopOption)));
  const Transition transition = CommandTransition(state_, command, option);
  if (transition.number != 0) Enter(transition);
}

void Drive::Enter(const Transition& transition) {
  const bool was_active =
      state_ == DriveState::kOperationEnabled || state_ == DriveState::kQuickStopActive;
  switch (transition.number) {
    case 3:
      if (!StageMayRun()) return;
      break;
    case 4:
    case 16:
      // Nobody would notice a controlword that no longer comes: not enabled without 1400:5.
      if (!StageMayRun() || node_.objects().Raw(Slot(0x1400, 5)) == 0) return;
      release_.Cancel();
      node_.TouchRpdos(now_us_);
      motion_.Start(static_cast<OperationMode>(node_.objects().Number(Slot(object::kMode))),
                    tracker_.measured(), was_active ? motion_.torque() : 0.0);
      stage_command_ = {true, false, motion_.torque()};
      break;
    case 5:
    case 8:
      release_.Begin(ReleaseKind::kTorqueRamp, motion_, now_us_);
      break;
    case 9:
    case 12:
      release_.Begin(ReleaseKind::kOpenWinding, motion_, now_us_);
      break;
    case 11:
      stopping_since_us_ = now_us_;
      if (node_.objects().Raw(Slot(object::kQuickStopOption)) == 0) {
        state_ = DriveState::kSwitchOnDisabled;  // 11, then 12 at once
        release_.Begin(ReleaseKind::kOpenWinding, motion_, now_us_);
        return;
      }
      break;
    case 15:
      ResetFault();
      return;
    default:
      break;
  }
  state_ = transition.next;
}

}  // namespace mantle::firmware_sim
