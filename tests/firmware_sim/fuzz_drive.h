#pragma once

#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <span>

#include "firmware_sim/bus/wire.h"
#include "firmware_sim/drive/drive.h"

/// What must hold of a drive whatever a bus brings it; used by fuzz_test.cc (10^6 frames in every
/// run) and by the libFuzzer target fuzz_target.cc.

namespace mantle::firmware_sim::test {

/// States that may follow each other within one frame or sub-step: what CiA 402 draws, plus
/// "fault" and "switch-on disabled" (NMT stop, reset) from anywhere.
inline bool MayFollow(DriveState from, DriveState to) {
  using enum DriveState;
  if (from == to || to == kSwitchOnDisabled) return true;
  switch (to) {
    case kReadyToSwitchOn:
      return from == kSwitchOnDisabled || from == kSwitchedOn || from == kOperationEnabled;
    case kSwitchedOn:
      return from == kReadyToSwitchOn || from == kOperationEnabled;
    case kOperationEnabled:
      return from == kReadyToSwitchOn || from == kSwitchedOn || from == kQuickStopActive;
    case kQuickStopActive:
      return from == kOperationEnabled;
    case kFaultReactionActive:
      return from != kFault;
    case kFault:
      // Without torque, and with the brake closed, the reaction is over in the tick of the fault.
      return from != kOperationEnabled && from != kQuickStopActive;
    default:
      return false;
  }
}

class FuzzedDrive {
 public:
  FuzzedDrive() : drive_(DriveConfig{.node = 5}, 0) {}

  /// Puts a frame on the bus after `wait_us`; returns what is wrong, or null.
  const char* Put(const CanFrame& frame, std::int64_t wait_us) {
    now_us_ += wait_us;
    while (drive_.now_us() + kSubStep_us <= now_us_) {
      if (const char* wrong = Step([&] { drive_.AdvanceTo(drive_.now_us() + kSubStep_us); })) {
        return wrong;
      }
    }
    if (const char* wrong = Step([&] { drive_.OnFrame(frame, now_us_); })) return wrong;
    return CheckObjects();
  }

  const Drive& drive() const { return drive_; }
  std::uint64_t frames_out() const { return frames_out_; }

 private:
  template <class Action>
  const char* Step(const Action& action) {
    const DriveState before = drive_.state();
    action();
    if (!MayFollow(before, drive_.state())) return "a transition that CiA 402 does not draw";
    return CheckMotor();
  }

  const char* CheckMotor() {
    const Winch& winch = drive_.winch();
    if (!std::isfinite(winch.speed_rad_s() + winch.angle_rad() + winch.current_a() +
                       winch.winding_c() + winch.tension_n())) {
      return "not finite";
    }
    if (std::abs(drive_.demanded_torque()) > 2000.0) return "torque above the motor's";
    if (drive_.state() == DriveState::kFault && drive_.demanded_torque() != 0.0) {
      return "torque in fault";
    }
    if (drive_.state() == DriveState::kOperationEnabled && drive_.brake_closed()) {
      return "brake closed while enabled";
    }
    return nullptr;
  }

  const char* CheckObjects() {
    for (std::size_t i = 0; i < kObjectTable.size(); ++i) {
      const ObjectEntry& row = kObjectTable[i];
      const std::int64_t number = drive_.objects().Number(i);
      if (row.access == Access::kReadWrite && row.index != object::kErrorHistory &&
          (number < row.low || number > row.high)) {
        return "object out of its range";
      }
    }
    CanFrame out;
    while (drive_.TakeFrame(out)) {
      ++frames_out_;
      if (out.id > 0x7FF || out.size > 8 || out.extended || out.remote || out.error) {
        return "malformed frame sent";
      }
    }
    return nullptr;
  }

  Drive drive_;
  std::int64_t now_us_{0};
  std::uint64_t frames_out_{0};
};

/// Reads `bytes` as frames of twelve bytes: id (2), flags and size, wait [10 us], data (8).
inline const char* PutAll(FuzzedDrive& drive, std::span<const std::uint8_t> bytes) {
  for (; bytes.size() >= 12; bytes = bytes.subspan(12)) {
    CanFrame frame;
    frame.id = LoadLe(bytes.data(), 2) & 0x7FFU;
    frame.size = bytes[2] & 0x0FU;
    frame.extended = (bytes[2] & 0x10U) != 0;
    frame.remote = (bytes[2] & 0x20U) != 0;
    frame.error = (bytes[2] & 0x40U) != 0;
    for (std::size_t i = 0; i < 8; ++i) frame.data[i] = bytes[4 + i];
    if (const char* wrong = drive.Put(frame, 10 * bytes[3])) return wrong;
  }
  return nullptr;
}

}  // namespace mantle::firmware_sim::test
