#include "firmware_sim/master/drive_supervisor.h"

#include <array>

#include "firmware_sim/bus/wire.h"

namespace mantle::firmware_sim {

namespace {

constexpr std::array<SdoObject, 5> kIdentityObjects{{{object::kDeviceType, 0},
                                                     {object::kIdentity, 1},
                                                     {object::kIdentity, 2},
                                                     {object::kIdentity, 3},
                                                     {object::kIdentity, 4}}};

// An NMT command has no reply: repeated until the heartbeat shows its effect.
constexpr std::int64_t kNmtRepeat_us = 250'000;
// Two drives give two TPDO1 a SYNC. So many in so many SYNCs are no accident: neither a bad cable
// that doubles every tenth nor a busy machine that delivers five late ones comes to it.
constexpr int kWindow = 16;
constexpr int kTooManyAnswers = 24;

}  // namespace

DriveSupervisor::DriveSupervisor(NodeId node, const SupervisorOptions& options)
    : options_(options),
      sdo_(node, options.sdo_timeout_us, options.sdo_attempts),
      mode_(options.settings.mode) {
  report_.node = node;
}

void DriveSupervisor::EnterStep(DriveStep step, std::int64_t now_us) {
  report_.step = step;
  step_begin_us_ = now_us;
  nmt_sent_ = false;
  sub_step_ = 0;
  at_rest_ = 0;
  sdo_.Cancel();
}

void DriveSupervisor::Fail(DriveProblem problem, DriveStep next, std::int64_t now_us) {
  report_.problem = problem;
  report_.problem_step = report_.step;
  report_.problem_object = sdo_.object();
  report_.problem_abort_code = sdo_.abort_code();
  EnterStep(next, now_us);
}

void DriveSupervisor::Restart(std::int64_t now_us) {
  report_.status_valid = false;
  target_set_ = false;
  supervised_ = false;
  was_synced_ = false;
  EnterStep(DriveStep::kIdentify, now_us);
}

void DriveSupervisor::Enable(std::int64_t now_us) {
  goal_ = Goal::kEnabled;
  target_set_ = false;
  switch (report_.step) {
    case DriveStep::kFaulted:
    case DriveStep::kReady:
    case DriveStep::kStopRamp:
    case DriveStep::kStopDisable:
    case DriveStep::kStopNmt:
    case DriveStep::kStopped:
      report_.problem = DriveProblem::kNone;
      report_.status_valid = false;
      EnterStep(DriveStep::kStart, now_us);
      break;
    case DriveStep::kFailed:
    case DriveStep::kLost:
      Restart(now_us);
      break;
    default:
      break;
  }
}

void DriveSupervisor::Stop(std::int64_t now_us) {
  if (goal_ == Goal::kStopped) return;
  goal_ = Goal::kStopped;
  const bool powered =
      report_.status_valid && TakesRpdos() && report_.state() == DriveState::kOperationEnabled;
  EnterStep(powered ? DriveStep::kStopRamp : DriveStep::kStopNmt, now_us);
}

void DriveSupervisor::SetTarget(const DriveTarget& target) {
  target_ = target;
  target_set_ = true;
}

bool DriveSupervisor::TakesRpdos() const {
  switch (report_.step) {
    case DriveStep::kIdentify:
    case DriveStep::kConfigure:
    case DriveStep::kExamine:
    case DriveStep::kLost:
    case DriveStep::kStopNmt:
    case DriveStep::kStopped:
      return false;
    default:
      return report_.nmt == NmtState::kOperational;
  }
}

bool DriveSupervisor::SdoFailed(SdoResult result, std::int64_t now_us) {
  if (result != SdoResult::kAborted && result != SdoResult::kTimedOut) return false;
  Fail(result == SdoResult::kAborted ? DriveProblem::kRefused : DriveProblem::kNoAnswer,
       DriveStep::kFailed, now_us);
  return true;
}

void DriveSupervisor::AdvanceIdentify(std::int64_t now_us, FrameBatch& out) {
  if (!nmt_sent_) {
    // Whatever it was doing: PDOs are configured in pre-operational.
    out.PushNmt(NmtCommand::kPreOperational, report_.node);
    nmt_sent_ = true;
    sdo_.Upload(kIdentityObjects[0]);
  }
  const SdoResult result = sdo_.Advance(now_us, out);
  if (SdoFailed(result, now_us) || result != SdoResult::kDone) return;
  DriveIdentity& identity = report_.identity;
  std::uint32_t* const fields[] = {&identity.device_type, &identity.vendor, &identity.product,
                                   &identity.revision, &identity.serial};
  const std::size_t known = kIdentityObjects.size();
  const std::uint32_t value = sdo_.value();
  if (sub_step_ < known) *fields[sub_step_] = value;
  std::uint32_t expected = value;
  if (sub_step_ == 0) expected = kDeviceType;
  if (sub_step_ >= known) expected = options_.expected[sub_step_ - known].value;
  if (value != expected) {
    report_.problem_value = value;
    report_.expected_value = expected;
    Fail(DriveProblem::kWrongDevice, DriveStep::kFailed, now_us);
    return;
  }
  if (++sub_step_ < known + options_.expected.size()) {
    sdo_.Upload(sub_step_ < known ? kIdentityObjects[sub_step_]
                                  : options_.expected[sub_step_ - known].object);
    sdo_.Advance(now_us, out);
    return;
  }
  EnterStep(DriveStep::kConfigure, now_us);
}

void DriveSupervisor::AdvanceConfigure(std::int64_t now_us, FrameBatch& out) {
  SdoResult result = sdo_.Advance(now_us, out);
  if (SdoFailed(result, now_us) || result == SdoResult::kBusy) return;
  if (result == SdoResult::kDone) ++sub_step_;
  const auto write = ConfigurationStep(options_.settings, report_.node, sub_step_);
  if (!write) {
    supervised_ = true;
    report_.last_heard_us = now_us;
    EnterStep(DriveStep::kStart, now_us);
    return;
  }
  sdo_.Download(*write);
  sdo_.Advance(now_us, out);
}

void DriveSupervisor::AdvanceExamine(std::int64_t now_us, FrameBatch& out) {
  if (sdo_.result() == SdoResult::kIdle) sdo_.Upload({object::kStatusword, 0});
  const SdoResult result = sdo_.Advance(now_us, out);
  if (SdoFailed(result, now_us) || result != SdoResult::kDone) return;
  const DriveState state = DecodeState(static_cast<std::uint16_t>(sdo_.value()));
  if (state == DriveState::kFault) {
    report_.statusword = static_cast<std::uint16_t>(sdo_.value());
    Fail(DriveProblem::kFault, DriveStep::kFaulted, now_us);
  } else if (state == DriveState::kFaultReactionActive || state == DriveState::kNotReady) {
    sdo_.Cancel();  // ask again
  } else {
    if (report_.problem != DriveProblem::kHeartbeatLost) ++report_.reboots;
    Restart(now_us);
  }
}

void DriveSupervisor::AdvanceNmt(NmtCommand command, std::int64_t now_us, FrameBatch& out) {
  if (nmt_sent_ && now_us - nmt_sent_us_ < kNmtRepeat_us) return;
  nmt_sent_ = true;
  nmt_sent_us_ = now_us;
  out.PushNmt(command, report_.node);
}

void DriveSupervisor::CheckTimes(std::int64_t now_us) {
  const bool expects_heartbeat =
      supervised_ && report_.step != DriveStep::kLost && report_.step != DriveStep::kFailed;
  if (expects_heartbeat && now_us - report_.last_heard_us > options_.heartbeat_loss_us) {
    report_.status_valid = false;
    was_synced_ = false;
    Fail(DriveProblem::kHeartbeatLost, DriveStep::kLost, now_us);
    return;
  }
  if (now_us - step_begin_us_ <= options_.step_timeout_us) return;
  switch (report_.step) {
    case DriveStep::kStart:
    case DriveStep::kEnable:
    case DriveStep::kExamine:
      Fail(DriveProblem::kStepTimeout, DriveStep::kFailed, now_us);
      break;
    case DriveStep::kClearFault:
      // The cause lasts.
      Fail(DriveProblem::kFault, DriveStep::kFaulted, now_us);
      break;
    case DriveStep::kStopRamp:
      Fail(DriveProblem::kStepTimeout, DriveStep::kStopDisable, now_us);
      break;
    case DriveStep::kStopDisable:
      Fail(DriveProblem::kStepTimeout, DriveStep::kStopNmt, now_us);
      break;
    case DriveStep::kStopNmt:
      Fail(DriveProblem::kStepTimeout, DriveStep::kFailed, now_us);
      break;
    default:
      break;
  }
}

void DriveSupervisor::Advance(std::int64_t now_us, FrameBatch& out) {
  switch (report_.step) {
    case DriveStep::kIdentify:
      AdvanceIdentify(now_us, out);
      break;
    case DriveStep::kConfigure:
      AdvanceConfigure(now_us, out);
      break;
    case DriveStep::kExamine:
      AdvanceExamine(now_us, out);
      break;
    case DriveStep::kStart:
      AdvanceNmt(NmtCommand::kStart, now_us, out);
      break;
    case DriveStep::kStopNmt:
      AdvanceNmt(NmtCommand::kStop, now_us, out);
      break;
    default:
      break;
  }
  CheckTimes(now_us);
}

std::uint16_t DriveSupervisor::Controlword() {
  const DriveState state = report_.state();
  switch (report_.step) {
    case DriveStep::kClearFault:
      // An edge every other cycle, so that a lost frame costs two cycles and no more.
      reset_bit_ = !reset_bit_;
      return reset_bit_ ? controlword::kFaultReset : controlword::kDisableVoltage;
    case DriveStep::kEnabled:
      return controlword::kEnableOperation;
    case DriveStep::kStopRamp:
      return controlword::kEnableOperation | controlword::kHalt;
    case DriveStep::kReady:
      return controlword::kShutdown;
    case DriveStep::kStopDisable:
      // Shutdown first: it pays the cable out, disable voltage would only open the winding.
      return state == DriveState::kOperationEnabled || state == DriveState::kSwitchedOn
                 ? controlword::kShutdown
                 : controlword::kDisableVoltage;
    case DriveStep::kEnable:
      switch (state) {
        case DriveState::kSwitchOnDisabled:
          return controlword::kShutdown;
        case DriveState::kReadyToSwitchOn:
          return goal_ == Goal::kEnabled ? controlword::kSwitchOn : controlword::kShutdown;
        case DriveState::kSwitchedOn:
        case DriveState::kOperationEnabled:
          return goal_ == Goal::kEnabled ? controlword::kEnableOperation : controlword::kShutdown;
        default:
          return controlword::kDisableVoltage;
      }
    default:
      return controlword::kDisableVoltage;
  }
}

void DriveSupervisor::Cycle(std::int64_t now_us, FrameBatch& out) {
  if (was_synced_) {
    if (answers_ == 0) ++report_.tpdo1_late;
    if (++syncs_in_window_ == kWindow) {
      if (answers_in_window_ >= kTooManyAnswers &&
          report_.problem != DriveProblem::kDuplicateNode) {
        goal_ = Goal::kStopped;
        Fail(DriveProblem::kDuplicateNode, DriveStep::kStopRamp, now_us);
      }
      syncs_in_window_ = answers_in_window_ = 0;
    }
  }
  answers_ = 0;
  const bool synced = report_.status_valid && TakesRpdos();
  if (synced != was_synced_) syncs_in_window_ = answers_in_window_ = 0;
  was_synced_ = synced;
  if (!was_synced_) return;
  ++report_.syncs;

  const bool follows = report_.step == DriveStep::kEnabled && target_set_;
  const bool stopping =
      report_.step == DriveStep::kStopRamp || report_.step == DriveStep::kStopDisable;
  const DriveTarget target =
      follows ? target_ : DriveTarget{.position_counts = report_.position_counts};
  CanFrame first;
  first.id = CobRpdo1(report_.node);
  first.size = 8;
  StoreLe(&first.data[0], 2, Controlword());
  StoreLe(&first.data[2], 2, static_cast<std::uint16_t>(target.torque_permille));
  StoreLe(&first.data[4], 4, static_cast<std::uint32_t>(target.position_counts));
  out.Push(first);
  if (!options_.settings.second_pdos) return;
  CanFrame second;
  second.id = CobRpdo2(report_.node);
  second.size = 7;
  StoreLe(&second.data[0], 4, static_cast<std::uint32_t>(target.velocity_counts_s));
  StoreLe(&second.data[4], 2, static_cast<std::uint16_t>(target.torque_offset_permille));
  // A halt holds the cable in modes 8 and 9, and lets it go in 10.
  second.data[6] = static_cast<std::uint8_t>(stopping ? OperationMode::kCyclicTorque : mode_);
  out.Push(second);
}

}  // namespace mantle::firmware_sim
