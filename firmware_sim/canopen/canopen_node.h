#pragma once

#include <cstdint>

#include "firmware_sim/bus/can_frame.h"
#include "firmware_sim/bus/frame_ring.h"
#include "firmware_sim/canopen/canopen.h"
#include "firmware_sim/canopen/emergency.h"
#include "firmware_sim/canopen/object_dictionary.h"
#include "firmware_sim/canopen/pdo.h"

namespace mantle::firmware_sim {

/// What a frame meant for its node.
struct NodeEvents {
  bool sync{false};
  bool controlword{false};  ///< object 6040 was written
  bool has_written{false};  ///< an SDO wrote `written_slot`
  std::size_t written_slot{0};
  bool nmt{false};  ///< `command` came; resets are the drive's to carry out
  NmtCommand command{NmtCommand::kStart};
};

/// The CANopen half of a drive: NMT slave, heartbeat producer and consumer, SDO server, PDOs and
/// EMCY around one object dictionary. It knows nothing of motors: what a frame asks of the drive it
/// returns as NodeEvents, and the drive decides.
class CanopenNode {
 public:
  /// Frames that may wait to be taken: a cycle has three, a reset or a fault two more.
  static constexpr std::size_t kOutCapacity = 64;
  /// EMCYs that may wait for the time in 1015; of more, the oldest is lost (1003 has its code).
  static constexpr std::size_t kEmcyCapacity = 8;

  explicit CanopenNode(NodeId node) : objects_(node) { pdos_.Configure(objects_); }

  ObjectDictionary& objects() { return objects_; }
  const ObjectDictionary& objects() const { return objects_; }
  NmtState state() const { return state_; }
  /// Takes the oldest frame to send; false where there is none.
  bool TakeFrame(CanFrame& frame) {
    if (out_.empty()) return false;
    frame = out_.Pop();
    return true;
  }
  /// Frames lost because nobody took those before them.
  std::uint64_t frames_dropped() const { return frames_dropped_; }
  const PdoSet& pdos() const { return pdos_; }
  const Emergency& emergency() const { return emergency_; }

  /// Restores the defaults (all, or those of communication), sends boot-up, is pre-operational; the
  /// first heartbeat follows one period later.
  void Boot(std::int64_t time_us, bool communication_only);
  /// Deaf and mute until Boot: an NMT reset waits for the torque to end.
  void Suspend() { state_ = NmtState::kBootUp; }

  /// Takes one data frame. Before it the drive has refreshed the actual values.
  NodeEvents OnFrame(const CanFrame& frame, std::int64_t time_us, bool enabled);

  /// At SYNC, in this order: latch, let the drive act on the controlword, send.
  bool LatchRpdos() { return pdos_.ApplyBuffered(objects_); }
  void SendSyncTpdos(std::int64_t time_us);

  /// Heartbeat, event-driven TPDOs and an EMCY held back by 1015 that are due.
  void Tick(std::int64_t time_us);

  /// The master's heartbeat was heard once and is overdue now.
  bool IsHeartbeatLost(std::int64_t time_us);
  /// RPDO or SYNC did not come for the time in 1400:5 (1401:5 where not zero).
  bool IsRpdoOverdue(std::int64_t time_us) const;
  /// Starts those time-outs (the drive was enabled).
  void TouchRpdos(std::int64_t time_us);

  void Raise(EmcyCode code);
  void Clear(EmcyCode code);
  void SetState(NmtState state);
  /// What 1029:1 wants of an operational node: pre-operational (0), no change (1), stopped (2).
  void OnCommunicationError();

 private:
  static constexpr std::int64_t kNever_us = INT64_MIN / 2;

  void Send(const CanFrame& frame) {
    if (!out_.Push(frame)) ++frames_dropped_;
  }
  void SendHeartbeat(NmtState state);
  /// At once, or where the last was less than 1015 ago, when that is over.
  void SendEmcy(const CanFrame& frame);
  bool EmcyMayLeave() const;
  void OnNmt(const CanFrame& frame, NodeEvents& events);
  void OnSdo(const CanFrame& frame, bool enabled, NodeEvents& events);
  void AfterWrite(std::size_t slot, std::int64_t time_us);

  ObjectDictionary objects_;
  PdoSet pdos_;
  Emergency emergency_;
  FrameRing out_{kOutCapacity};
  FrameRing emergencies_{kEmcyCapacity};
  std::uint64_t frames_dropped_{0};
  NmtState state_{NmtState::kBootUp};
  std::int64_t next_heartbeat_us_{0};
  std::int64_t last_sync_us_{0};
  std::int64_t last_master_us_{0};
  std::int64_t now_us_{0};
  std::int64_t last_emcy_us_{kNever_us};
  bool master_armed_{false};
  bool master_lost_{false};
};

}  // namespace mantle::firmware_sim
