#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "firmware_sim/bus/bus.h"
#include "firmware_sim/bus/can_filter.h"
#include "firmware_sim/bus/frame_ring.h"

namespace mantle::firmware_sim {

/// What a LoopMedium is like.
struct LoopOptions {
  std::int64_t bit_rate{0};            ///< bit/s; 0: frames take no time
  std::size_t receive_capacity{1024};  ///< frames a station may leave unread
  std::size_t transmit_capacity{256};  ///< frames a station may have waiting (with a bit rate)
};

class LoopStation;

/// The in-process bus: one LoopMedium is the wire, each station it hands out is one Bus on it.
/// Deterministic and single-threaded: the same calls in the same order give the same frames.
///
/// Without a bit rate (the default) a frame is at every other station as soon as it is sent, in the
/// order of the calls, stamped with the time of the last AdvanceTo.
///
/// With a bit rate the wire is what ISO 11898-1 makes it: a frame waits in its sender's queue, the
/// lowest arbitration field among the queue heads wins, and a frame reaches the others when its
/// last bit has passed (ActualFrameBits of bus_load.h over the bit rate), stamped with that moment.
/// Then AdvanceTo carries the traffic.
class LoopMedium {
 public:
  /// Throws std::invalid_argument for a negative bit rate or a capacity of 0.
  explicit LoopMedium(LoopOptions options = {});
  LoopMedium(const LoopMedium&) = delete;
  LoopMedium& operator=(const LoopMedium&) = delete;
  /// Every station must be gone before its medium.
  ~LoopMedium();

  /// A new station that receives what passes `filters`. Allocates; do it before the first cycle.
  std::unique_ptr<Bus> MakeStation(std::span<const CanFilter> filters = {});

  /// Moves the wire's clock to `now_us`; never back. Frames whose last bit falls before or on
  /// `now_us` are delivered.
  void AdvanceTo(std::int64_t now_us);

  /// Takes the link down or up, as `ip link set vcan0 down` does: frames under way and waiting are
  /// lost, sending returns kDown.
  void SetUp(bool up);

  std::int64_t now_us() const { return now_us_; }
  bool up() const { return up_; }
  /// Frames and bits carried since construction (bits with actual stuffing and interframe space).
  std::uint64_t frames_carried() const { return frames_carried_; }
  std::uint64_t bits_carried() const { return bits_carried_; }

 private:
  friend class LoopStation;

  LoopStation* NextToSend();
  void Deliver(const LoopStation* from, const CanFrame& frame);

  LoopOptions options_;
  std::vector<LoopStation*> stations_;
  LoopStation* sending_{nullptr};
  CanFrame frame_on_wire_{};
  std::int64_t wire_free_ns_{0};
  std::int64_t now_us_{0};
  std::uint64_t frames_carried_{0};
  std::uint64_t bits_carried_{0};
  bool up_{true};
};

}  // namespace mantle::firmware_sim
