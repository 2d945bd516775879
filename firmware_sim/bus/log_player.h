#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "firmware_sim/bus/bus.h"

namespace mantle::firmware_sim {

/// Replays frames on a bus with the timing of their time stamps. Time is an input.
class LogPlayer {
 public:
  /// Frames are sent in the order given; a time stamp that goes back means at once. Error frames
  /// are left out: a station cannot send them. The first frame is due at `start_us`. Throws
  /// std::invalid_argument where `speed` is not above 0 (2 plays twice as fast).
  LogPlayer(std::vector<CanFrame> frames, std::int64_t start_us, double speed = 1.0);

  /// Sends what is due by `now_us`; returns how many frames the bus took. Does not allocate.
  std::size_t Play(std::int64_t now_us, Bus& bus);

  bool done() const { return next_ == frames_.size(); }
  /// When the next frame is due; precondition: not done.
  std::int64_t next_due_us() const { return due_us_[next_]; }
  /// Frames that the bus refused (queue full, link down): they are not offered again.
  std::uint64_t refused() const { return refused_; }

 private:
  std::vector<CanFrame> frames_;
  std::vector<std::int64_t> due_us_;
  std::size_t next_{0};
  std::uint64_t refused_{0};
};

}  // namespace mantle::firmware_sim
