#pragma once

#include <cstdint>
#include <map>
#include <vector>

#include "firmware_sim/bus/wire.h"
#include "firmware_sim/drive/drive.h"

/// A drive on a test bench: a hand that sends frames at chosen times and keeps what comes back.
/// The bench is the bus: no transport, no wall clock.

namespace mantle::firmware_sim::test {

inline CanFrame Frame(std::uint32_t id, std::initializer_list<unsigned> bytes) {
  CanFrame frame;
  frame.id = id;
  for (const unsigned byte : bytes) {
    frame.data[frame.size++] = static_cast<std::uint8_t>(byte);
  }
  return frame;
}

struct Reply {
  bool came{false};
  std::uint8_t command{0};
  std::uint32_t data{0};
  SdoAbort abort() const {
    return command == kSdoAbortCommand ? static_cast<SdoAbort>(data) : SdoAbort::kNone;
  }
};

struct Targets {
  std::uint16_t controlword{0};
  std::int16_t torque{0};
  std::int32_t position{0};
  std::int32_t velocity{0};
  std::int16_t torque_offset{0};
  std::int8_t mode{10};
};

class DriveBench {
 public:
  static constexpr std::int64_t kCycle_us = 10'000;

  explicit DriveBench(DriveConfig config = {}, std::int64_t start_us = 0)
      : drive(config, start_us), now_us(start_us) {
    Collect();
  }

  void Send(const CanFrame& frame) {
    drive.OnFrame(frame, now_us);
    Collect();
  }
  void Advance(std::int64_t span_us) {
    now_us += span_us;
    drive.AdvanceTo(now_us);
    Collect();
  }

  void Nmt(NmtCommand command, unsigned node = 0) {
    Send(Frame(kCobNmt, {static_cast<unsigned>(command), node}));
  }
  void Sync() { Send(Frame(kCobSync, {})); }
  void Heartbeat() { Send(Frame(CobHeartbeat(kMasterNode), {5})); }

  Reply Request(const CanFrame& request) {
    const std::size_t before = frames.size();
    Send(request);
    for (std::size_t i = before; i < frames.size(); ++i) {
      if (frames[i].id != CobSdoReply(node())) continue;
      return {true, frames[i].data[0], LoadLe(&frames[i].data[4], 4)};
    }
    return {};
  }
  Reply Upload(unsigned index, unsigned sub) {
    return Request(
        Frame(CobSdoRequest(node()), {0x40, index & 0xFFU, index >> 8U, sub, 0, 0, 0, 0}));
  }
  Reply Download(unsigned index, unsigned sub, unsigned bytes, std::uint32_t value) {
    CanFrame request = Frame(CobSdoRequest(node()), {SdoDownloadRequest(bytes), index & 0xFFU,
                                                     index >> 8U, sub, 0, 0, 0, 0});
    StoreLe(&request.data[4], 4, value);
    return Request(request);
  }

  /// Both RPDOs of the profile, then SYNC.
  void SendTargets(const Targets& t) {
    CanFrame first = Frame(CobRpdo1(node()), {0, 0, 0, 0, 0, 0, 0, 0});
    StoreLe(&first.data[0], 2, t.controlword);
    StoreLe(&first.data[2], 2, static_cast<std::uint16_t>(t.torque));
    StoreLe(&first.data[4], 4, static_cast<std::uint32_t>(t.position));
    CanFrame second = Frame(CobRpdo2(node()), {0, 0, 0, 0, 0, 0, 0});
    StoreLe(&second.data[0], 4, static_cast<std::uint32_t>(t.velocity));
    StoreLe(&second.data[4], 2, static_cast<std::uint16_t>(t.torque_offset));
    second.data[6] = static_cast<std::uint8_t>(t.mode);
    Send(first);
    Send(second);
    Sync();
  }
  /// Cycles of 10 ms with master heartbeat, targets and SYNC.
  void Run(const Targets& t, int cycles) {
    for (int i = 0; i < cycles; ++i) {
      Heartbeat();
      SendTargets(t);
      Advance(kCycle_us);
    }
  }
  /// NMT start, then up to operation enabled with `t`'s mode and targets.
  void Enable(Targets t) {
    if (drive.nmt_state() != NmtState::kOperational) Nmt(NmtCommand::kStart, 0);
    for (const std::uint16_t word : {controlword::kShutdown, controlword::kSwitchOn}) {
      t.controlword = word;
      Run(t, 1);
    }
    t.controlword = controlword::kEnableOperation;
    Run(t, 1);
  }

  NodeId node() const { return drive.objects().node(); }
  std::uint16_t statusword() const {
    return static_cast<std::uint16_t>(drive.objects().Raw(Slot(object::kStatusword)));
  }
  std::int64_t Number(std::size_t slot) const { return drive.objects().Number(slot); }

  /// EMCY codes in the order in which they came.
  std::vector<EmcyCode> Emergencies() const {
    std::vector<EmcyCode> codes;
    for (const CanFrame& frame : frames) {
      if (frame.id == CobEmcy(node())) {
        codes.push_back(static_cast<EmcyCode>(LoadLe(frame.data.data(), 2)));
      }
    }
    return codes;
  }
  /// Frames with an identifier, with the time at which the bench took them.
  std::vector<CanFrame> WithId(std::uint32_t id) const {
    std::vector<CanFrame> found;
    for (const CanFrame& frame : frames) {
      if (frame.id == id) found.push_back(frame);
    }
    return found;
  }

  Drive drive;
  std::int64_t now_us;
  std::vector<CanFrame> frames;

 private:
  void Collect() {
    CanFrame frame;
    while (drive.TakeFrame(frame)) {
      frame.time_us = now_us;
      frames.push_back(frame);
    }
  }
};

/// Targets that make a tension of some 0.95 N.
inline Targets Hauling() {
  Targets t;
  t.torque = 400;
  return t;
}

/// A reset edge on the cyclic controlword.
inline void TryReset(DriveBench& bench, Targets t) {
  t.controlword = 0;
  bench.Run(t, 2);
  t.controlword = controlword::kFaultReset;
  bench.Run(t, 2);
  t.controlword = 0;
  bench.Run(t, 1);
}

}  // namespace mantle::firmware_sim::test
