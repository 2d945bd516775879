#pragma once

#include <cstdint>
#include <span>

#include "firmware_sim/bus/bus.h"
#include "firmware_sim/bus/candump_log.h"

namespace mantle::firmware_sim {

/// A bus that writes every frame it passes, sent and received, to a candump log. Received frames
/// keep the transport's time stamp; sent ones get the time of the last AdvanceTo, which the caller
/// keeps on the transport's clock (CLOCK_REALTIME on sockets).
class RecordingBus final : public Bus {
 public:
  /// Both must outlive this bus.
  RecordingBus(Bus& bus, CandumpWriter& log) : bus_(bus), log_(log) {}

  void AdvanceTo(std::int64_t now_us) { now_us_ = now_us; }

  BusStatus Send(std::span<const CanFrame> frames) override;
  std::size_t Receive(std::span<CanFrame> frames) override;
  BusStatus Wait(std::int64_t timeout_us) override { return bus_.Wait(timeout_us); }
  BusCounters counters() const override { return bus_.counters(); }

 private:
  Bus& bus_;
  CandumpWriter& log_;
  std::int64_t now_us_{0};
};

}  // namespace mantle::firmware_sim
