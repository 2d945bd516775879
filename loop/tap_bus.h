#pragma once

#include "firmware_sim/bus/bus.h"
#include "firmware_sim/bus/socket_time.h"
#include "firmware_sim/bus/spsc_ring.h"

namespace mantle::loop {

/// A station that hands a copy of every frame it passes, both ways, to another thread: no file
/// holds its own up. Sent frames are stamped with CLOCK_REALTIME.
class TapBus final : public firmware_sim::Bus {
 public:
  /// Both must outlive this one.
  TapBus(firmware_sim::Bus& bus, firmware_sim::SpscRing<firmware_sim::CanFrame>& frames)
      : bus_(bus), frames_(frames) {}

  firmware_sim::BusStatus Send(std::span<const firmware_sim::CanFrame> frames) override {
    const std::uint64_t before = bus_.counters().sent;
    const firmware_sim::BusStatus status = bus_.Send(frames);
    const std::int64_t now_us = firmware_sim::RealTime_us();
    for (firmware_sim::CanFrame frame :
         frames.first(static_cast<std::size_t>(bus_.counters().sent - before))) {
      frame.time_us = now_us;
      if (!frames_.Push(frame)) ++missed_;
    }
    return status;
  }
  std::size_t Receive(std::span<firmware_sim::CanFrame> frames) override {
    const std::size_t count = bus_.Receive(frames);
    for (const firmware_sim::CanFrame& frame : frames.first(count)) {
      if (!frames_.Push(frame)) ++missed_;
    }
    return count;
  }
  firmware_sim::BusStatus Wait(std::int64_t timeout_us) override { return bus_.Wait(timeout_us); }
  firmware_sim::BusCounters counters() const override { return bus_.counters(); }

  std::uint64_t missed() const { return missed_; }  ///< frames for which there was no room

 private:
  firmware_sim::Bus& bus_;
  firmware_sim::SpscRing<firmware_sim::CanFrame>& frames_;
  std::uint64_t missed_{0};
};

}  // namespace mantle::loop
