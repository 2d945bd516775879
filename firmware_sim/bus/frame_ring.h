#pragma once

#include <cstddef>
#include <vector>

#include "firmware_sim/bus/can_frame.h"

namespace mantle::firmware_sim {

/// First-in-first-out queue of frames whose storage is allocated once, at construction.
class FrameRing {
 public:
  explicit FrameRing(std::size_t capacity) : frames_(capacity) {}

  bool empty() const { return size_ == 0; }
  std::size_t size() const { return size_; }
  std::size_t capacity() const { return frames_.size(); }

  /// Returns false, and leaves the queue as it was, where it is full.
  bool Push(const CanFrame& frame) {
    if (size_ == frames_.size()) return false;
    std::size_t at = head_ + size_;
    if (at >= frames_.size()) at -= frames_.size();
    frames_[at] = frame;
    ++size_;
    return true;
  }

  /// Precondition: not empty.
  const CanFrame& Front() const { return frames_[head_]; }

  /// The `i`-th that waits, 0 the oldest. Precondition: i < size().
  const CanFrame& At(std::size_t i) const {
    const std::size_t at = head_ + i;
    return frames_[at < frames_.size() ? at : at - frames_.size()];
  }

  /// Precondition: not empty.
  CanFrame Pop() {
    const CanFrame frame = frames_[head_];
    if (++head_ == frames_.size()) head_ = 0;
    --size_;
    return frame;
  }

  void Clear() { head_ = size_ = 0; }

 private:
  std::vector<CanFrame> frames_;
  std::size_t head_{0};
  std::size_t size_{0};
};

}  // namespace mantle::firmware_sim
