#pragma once

#include <cstdint>

#include "firmware_sim/bus/bus.h"

namespace mantle::loop {

/// One station of a lock-step run whose other station is in another program, on a bus that takes
/// wall time: the other side says how many frames it has sent, and Receive waits until so many have
/// come, as LockStepBus does within a process. A frame that does not come within the time-out is
/// given up (`stalled`); one more than was sent is foreign, and falsifies the run. Frames are
/// stamped with the simulated time of the last AdvanceTo.
class CountedBus final : public firmware_sim::Bus {
 public:
  /// `bus` must outlive this one.
  CountedBus(firmware_sim::Bus& bus, std::int64_t timeout_us)
      : bus_(bus), timeout_us_(timeout_us) {}
  void AdvanceTo(std::int64_t now_us) { now_us_ = now_us; }
  /// The other side has sent `total` frames so far.
  void Expect(std::int64_t total) { expected_ = total; }

  firmware_sim::BusStatus Send(std::span<const firmware_sim::CanFrame> frames) override {
    return bus_.Send(frames);
  }
  std::size_t Receive(std::span<firmware_sim::CanFrame> frames) override;
  firmware_sim::BusStatus Wait(std::int64_t timeout_us) override { return bus_.Wait(timeout_us); }
  firmware_sim::BusCounters counters() const override { return bus_.counters(); }

  bool stalled() const { return stalled_; }
  /// Frames that were expected and did not come; where stalled.
  std::int64_t missing() const { return expected_ - received_; }
  std::uint64_t foreign() const { return foreign_; }
  /// The last frame that came; of some use where one is foreign.
  const firmware_sim::CanFrame& last() const { return last_; }

 private:
  firmware_sim::Bus& bus_;
  std::int64_t timeout_us_, now_us_{0}, expected_{0}, received_{0};
  std::uint64_t foreign_{0};
  firmware_sim::CanFrame last_{};
  bool stalled_{false};
};

}  // namespace mantle::loop
