#pragma once

#include <cstddef>
#include <memory>
#include <span>

#include "firmware_sim/bus/bus.h"
#include "firmware_sim/bus/can_filter.h"

namespace mantle::firmware_sim {

/// The in-process bus between two threads: two stations, each used by one thread. What one sends
/// waits in a queue of fixed depth until the other receives it, stamped with CLOCK_REALTIME as the
/// sockets stamp; neither waits for the other, but in Wait. Without a bit rate.
class PairBus {
 public:
  /// `capacity` frames wait each way at most; further ones are lost and counted at the receiver.
  /// Throws std::system_error where the system has no more file descriptors.
  explicit PairBus(std::size_t capacity = 4096);
  PairBus(const PairBus&) = delete;
  PairBus& operator=(const PairBus&) = delete;
  ~PairBus();

  /// One of the two stations, that receives what passes `filters`; each is made once. It must be
  /// gone before this object.
  std::unique_ptr<Bus> MakeStation(int side, std::span<const CanFilter> filters = {});

 private:
  struct Way;
  std::unique_ptr<Way> ways_[2];
};

}  // namespace mantle::firmware_sim
