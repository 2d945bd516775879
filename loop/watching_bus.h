#pragma once

#include <atomic>
#include <bitset>
#include <cstdint>

#include "firmware_sim/bus/bus.h"

namespace mantle::loop {

/// A station that owns the identifiers it has sent: a frame that comes with one of them is foreign
/// (a second master or a second set of drives is on the bus). Such frames are counted and passed
/// on.
class WatchingBus final : public firmware_sim::Bus {
 public:
  /// `bus` must outlive this one.
  explicit WatchingBus(firmware_sim::Bus& bus) : bus_(bus) {}

  firmware_sim::BusStatus Send(std::span<const firmware_sim::CanFrame> frames) override;
  std::size_t Receive(std::span<firmware_sim::CanFrame> frames) override;
  firmware_sim::BusStatus Wait(std::int64_t timeout_us) override { return bus_.Wait(timeout_us); }
  firmware_sim::BusCounters counters() const override { return bus_.counters(); }

  // From any thread.
  std::uint64_t foreign() const { return foreign_.load(std::memory_order_relaxed); }
  /// Identifier of the first one; where there is one.
  std::uint32_t first_foreign() const { return first_.load(std::memory_order_relaxed); }

 private:
  firmware_sim::Bus& bus_;
  std::bitset<2048> owned_;
  std::atomic<std::uint64_t> foreign_{0};
  std::atomic<std::uint32_t> first_{0};
};

}  // namespace mantle::loop
