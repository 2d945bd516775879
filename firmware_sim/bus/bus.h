#pragma once

#include <cstdint>
#include <span>

#include "firmware_sim/bus/can_frame.h"

namespace mantle::firmware_sim {

enum class BusStatus : std::uint8_t {
  kOk,
  kFull,  ///< transmit queue full; the frames not taken may be offered again
  kDown,  ///< link down; comes back by itself
  kGone,  ///< interface deleted; the transport reopens it when it reappears
};

/// Frames since a station was opened.
struct BusCounters {
  std::uint64_t sent{0};
  std::uint64_t received{0};
  std::uint64_t send_dropped{0};     ///< refused on sending (queue full, link down)
  std::uint64_t receive_dropped{0};  ///< lost before we read them (socket queue overflow)
  std::uint64_t error_frames{0};
  std::uint64_t malformed{0};   ///< datagrams that were no frames
  std::uint64_t recoveries{0};  ///< link or interface came back
};

/// The seam between drives, master and whatever carries their frames. One Bus object is one
/// station's access to a bus: what it sends, the others receive; it does not receive its own
/// frames. Implementations: LoopBus (in process, deterministic), SocketCanBus, UdpMulticastBus, and
/// decorators (FaultInjectingBus, recorder). No member throws or allocates after construction;
/// everything that can go wrong on a wire is a returned status or a counter.
class Bus {
 public:
  virtual ~Bus() = default;

  /// Offers `frames` in order. Returns kOk when all were taken; otherwise the rest is dropped and
  /// counted in `send_dropped`.
  virtual BusStatus Send(std::span<const CanFrame> frames) = 0;

  /// Copies up to `frames.size()` waiting frames, oldest first, without blocking; returns how many.
  /// Bounded work: no more than `frames.size()` datagrams or frames are looked at, so that fewer,
  /// even none, may be returned though more wait (foreign ones, malformed ones, our own).
  virtual std::size_t Receive(std::span<CanFrame> frames) = 0;

  /// Waits until a frame is ready or `timeout_us` passed (returns at once for in-process buses).
  virtual BusStatus Wait(std::int64_t timeout_us) = 0;

  virtual BusCounters counters() const = 0;
};

}  // namespace mantle::firmware_sim
