#include "firmware_sim/canopen/canopen_node.h"

#include "firmware_sim/bus/wire.h"
#include "firmware_sim/canopen/sdo_server.h"

namespace mantle::firmware_sim {
namespace {

constexpr std::int64_t kMillisecond_us = 1000;
constexpr std::int64_t kEmcyInhibitUnit_us = 100;

std::int64_t Period_us(const ObjectDictionary& objects, std::size_t slot) {
  return kMillisecond_us * static_cast<std::int64_t>(objects.Raw(slot) & 0xFFFFU);
}

bool IsKnown(std::uint8_t command) {
  switch (static_cast<NmtCommand>(command)) {
    case NmtCommand::kStart:
    case NmtCommand::kStop:
    case NmtCommand::kPreOperational:
    case NmtCommand::kResetNode:
    case NmtCommand::kResetCommunication:
      return true;
  }
  return false;
}

}  // namespace

void CanopenNode::Boot(std::int64_t time_us, bool communication_only) {
  if (communication_only) {
    objects_.ResetCommunication();
  } else {
    objects_.Reset();
  }
  pdos_ = PdoSet{};
  pdos_.Configure(objects_);
  emergencies_.Clear();
  if (communication_only) {
    emergency_.Clear(EmcyCode::kPdoLength, objects_);
    emergency_.UpdateRegister(objects_);
  } else {
    emergency_.Reset();
  }
  master_armed_ = master_lost_ = false;
  now_us_ = time_us;
  SendHeartbeat(NmtState::kBootUp);
  SetState(NmtState::kPreOperational);
  next_heartbeat_us_ = time_us + Period_us(objects_, Slot(object::kProducerHeartbeat));
}

void CanopenNode::SetState(NmtState state) {
  if (state != NmtState::kOperational) pdos_.DropBuffered();
  if (state == NmtState::kStopped) emergencies_.Clear();
  state_ = state;
}

void CanopenNode::OnCommunicationError() {
  if (state_ != NmtState::kOperational) return;
  const std::uint32_t behaviour = objects_.Raw(Slot(object::kErrorBehaviour, 1));
  if (behaviour == 0) SetState(NmtState::kPreOperational);
  if (behaviour == 2) SetState(NmtState::kStopped);
}

void CanopenNode::SendHeartbeat(NmtState state) {
  CanFrame frame;
  frame.id = CobHeartbeat(objects_.node());
  frame.size = 1;
  frame.data[0] = static_cast<std::uint8_t>(state);
  Send(frame);
}

bool CanopenNode::EmcyMayLeave() const {
  const std::int64_t inhibit_us =
      kEmcyInhibitUnit_us * static_cast<std::int64_t>(objects_.Raw(Slot(object::kEmcyInhibit)));
  return now_us_ - last_emcy_us_ >= inhibit_us;
}

void CanopenNode::SendEmcy(const CanFrame& frame) {
  if (emergencies_.empty() && EmcyMayLeave()) {
    Send(frame);
    last_emcy_us_ = now_us_;
    return;
  }
  if (emergencies_.size() == emergencies_.capacity()) {
    emergencies_.Pop();
    ++frames_dropped_;
  }
  emergencies_.Push(frame);
}

NodeEvents CanopenNode::OnFrame(const CanFrame& frame, std::int64_t time_us, bool enabled) {
  NodeEvents events;
  if (state_ == NmtState::kBootUp || frame.extended || frame.remote || frame.error) return events;
  now_us_ = time_us;
  const std::uint32_t consumer = objects_.Raw(Slot(object::kConsumerHeartbeat, 1));
  const auto guarded = static_cast<NodeId>(consumer >> 16U & 0x7FU);
  if (frame.id == kCobNmt) {
    OnNmt(frame, events);
  } else if (frame.id == kCobSync) {
    last_sync_us_ = time_us;
    events.sync = state_ == NmtState::kOperational;
  } else if (frame.id == CobSdoRequest(objects_.node())) {
    if (state_ != NmtState::kStopped) OnSdo(frame, enabled, events);
  } else if (guarded != 0 && frame.id == CobHeartbeat(guarded)) {
    // The master's boot-up is no sign that it controls anything yet.
    if (frame.size == 1 && frame.data[0] != static_cast<std::uint8_t>(NmtState::kBootUp)) {
      master_armed_ = true;
      master_lost_ = false;
      last_master_us_ = time_us;
    }
  } else if (state_ == NmtState::kOperational) {
    pdos_.Receive(frame, time_us, objects_, events.controlword);
    if (pdos_.has_length_error()) {
      Raise(EmcyCode::kPdoLength);
    } else {
      Clear(EmcyCode::kPdoLength);
    }
  }
  return events;
}

void CanopenNode::OnNmt(const CanFrame& frame, NodeEvents& events) {
  if (frame.size != 2 || !IsKnown(frame.data[0])) return;
  if (frame.data[1] != 0 && frame.data[1] != objects_.node()) return;
  events.nmt = true;
  events.command = static_cast<NmtCommand>(frame.data[0]);
  switch (events.command) {
    case NmtCommand::kStart:
      SetState(NmtState::kOperational);
      break;
    case NmtCommand::kStop:
      SetState(NmtState::kStopped);
      break;
    case NmtCommand::kPreOperational:
      SetState(NmtState::kPreOperational);
      break;
    case NmtCommand::kResetNode:
    case NmtCommand::kResetCommunication:
      break;
  }
}

void CanopenNode::OnSdo(const CanFrame& frame, bool enabled, NodeEvents& events) {
  const SdoOutcome outcome = ServeSdo(frame, objects_, enabled);
  if (outcome.has_reply) Send(outcome.reply);
  if (!outcome.has_written) return;
  events.has_written = true;
  events.written_slot = outcome.slot;
  events.controlword = outcome.slot == Slot(object::kControlword);
  AfterWrite(outcome.slot, now_us_);
}

void CanopenNode::AfterWrite(std::size_t slot, std::int64_t time_us) {
  const std::uint16_t index = kObjectTable[slot].index;
  if (index >= 0x1400 && index < 0x1C00) pdos_.Configure(objects_);
  if (index == object::kConsumerHeartbeat) master_armed_ = false;
  if (index == object::kProducerHeartbeat) {
    next_heartbeat_us_ = time_us + Period_us(objects_, slot);
  }
  if (index == object::kErrorHistory) {
    for (std::size_t i = 1; i <= kErrorHistoryDepth; ++i) {
      objects_.Store(Slot(object::kErrorHistory, 0) + i, 0);
    }
  }
}

void CanopenNode::SendSyncTpdos(std::int64_t time_us) {
  CanFrame frame;
  for (std::size_t i = 0; i < 2; ++i) {
    if (pdos_.SampleOnSync(i, time_us, objects_, frame)) Send(frame);
  }
}

void CanopenNode::Tick(std::int64_t time_us) {
  now_us_ = time_us;
  if (state_ == NmtState::kBootUp) return;
  if (!emergencies_.empty() && EmcyMayLeave()) {
    Send(emergencies_.Pop());
    last_emcy_us_ = time_us;
  }
  const std::int64_t period_us = Period_us(objects_, Slot(object::kProducerHeartbeat));
  if (period_us > 0 && time_us >= next_heartbeat_us_) {
    SendHeartbeat(state_);
    next_heartbeat_us_ += period_us;
    if (next_heartbeat_us_ <= time_us) next_heartbeat_us_ = time_us + period_us;
  }
  if (state_ != NmtState::kOperational) return;
  CanFrame frame;
  for (std::size_t i = 0; i < 2; ++i) {
    if (pdos_.SampleOnEvent(i, time_us, objects_, frame)) Send(frame);
  }
}

bool CanopenNode::IsHeartbeatLost(std::int64_t time_us) {
  const std::int64_t limit_us = Period_us(objects_, Slot(object::kConsumerHeartbeat, 1));
  if (limit_us == 0) {
    master_lost_ = false;
  } else if (master_armed_ && time_us - last_master_us_ > limit_us) {
    master_armed_ = false;
    master_lost_ = true;
  }
  return master_lost_;
}

bool CanopenNode::IsRpdoOverdue(std::int64_t time_us) const {
  const std::int64_t first_us = Period_us(objects_, kPdoSlots[0].timer);
  const std::int64_t second_us = Period_us(objects_, kPdoSlots[1].timer);
  if (first_us > 0 && time_us - pdos_.last_received_us(0) > first_us) return true;
  if (second_us > 0 && time_us - pdos_.last_received_us(1) > second_us) return true;
  return first_us > 0 && pdos_.NeedsSync() && time_us - last_sync_us_ > first_us;
}

void CanopenNode::TouchRpdos(std::int64_t time_us) {
  pdos_.Touch(time_us);
  last_sync_us_ = time_us;
}

void CanopenNode::Raise(EmcyCode code) {
  if (!emergency_.Raise(code, objects_) || state_ == NmtState::kStopped) return;
  const auto bits = static_cast<std::uint8_t>(objects_.Raw(Slot(object::kErrorRegister)));
  SendEmcy(MakeEmcy(objects_.node(), code, bits));
}

void CanopenNode::Clear(EmcyCode code) {
  if (!emergency_.Clear(code, objects_) || state_ == NmtState::kStopped) return;
  SendEmcy(MakeEmcy(objects_.node(), EmcyCode::kNoError, 0));
}

}  // namespace mantle::firmware_sim
