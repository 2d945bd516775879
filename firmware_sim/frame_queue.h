#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "firmware_sim/can_frame.h"

/// What a device has to send, oldest first, in a ring of fixed capacity. A frame that finds it full
/// is dropped and counted: a queue nobody empties must not grow.

namespace mantle::firmware_sim {

class FrameQueue {
 public:
  static constexpr std::size_t kCapacity = 64;

  bool empty() const { return count_ == 0; }
  std::size_t size() const { return count_; }
  std::uint64_t dropped() const { return dropped_; }

  bool Push(const CanFrame& frame) {
    if (count_ == kCapacity) {
      ++dropped_;
      return false;
    }
    frames_[(first_ + count_) % kCapacity] = frame;
    ++count_;
    return true;
  }

  /// Takes the oldest frame; false where there is none.
  bool Pop(CanFrame& frame) {
    if (count_ == 0) return false;
    frame = frames_[first_];
    first_ = (first_ + 1) % kCapacity;
    --count_;
    return true;
  }

 private:
  std::array<CanFrame, kCapacity> frames_{};
  std::size_t first_{0};
  std::size_t count_{0};
  std::uint64_t dropped_{0};
};

}  // namespace mantle::firmware_sim
