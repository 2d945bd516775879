#pragma once

#include <array>
#include <cstddef>
#include <span>

#include "firmware_sim/bus/can_frame.h"
#include "firmware_sim/canopen/canopen.h"

namespace mantle::firmware_sim {

/// Frames collected for one Send, in fixed storage.
class FrameBatch {
 public:
  static constexpr std::size_t kCapacity = 128;

  /// Drops the frame where the batch is full: the protocols above repeat themselves.
  void Push(const CanFrame& frame) {
    if (size_ < kCapacity) frames_[size_++] = frame;
  }
  void PushNmt(NmtCommand command, NodeId node) {
    CanFrame frame;
    frame.id = kCobNmt;
    frame.size = 2;
    frame.data[0] = static_cast<std::uint8_t>(command);
    frame.data[1] = node;
    Push(frame);
  }
  std::span<const CanFrame> frames() const { return {frames_.data(), size_}; }
  bool empty() const { return size_ == 0; }
  void Clear() { size_ = 0; }

 private:
  std::array<CanFrame, kCapacity> frames_{};
  std::size_t size_{0};
};

}  // namespace mantle::firmware_sim
