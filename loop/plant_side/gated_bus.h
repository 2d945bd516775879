#pragma once

#include <cstdint>
#include <optional>

#include "firmware_sim/bus/bus.h"
#include "firmware_sim/bus/frame_ring.h"

namespace mantle::loop {

/// A station whose frames are handed out by the time at which they were on the bus: a plant that
/// runs behind the wall clock, or was held up, so gets each frame at the instant of its own time at
/// which it came. Stamps are CLOCK_REALTIME, as the transports give them; one that lies ahead
/// counts as of now.
class GatedBus final : public firmware_sim::Bus {
 public:
  /// `bus` must outlive this one.
  explicit GatedBus(firmware_sim::Bus& bus);

  /// Reads what has come; Receive from now on gives the frames of CLOCK_MONOTONIC `until_us` and
  /// before.
  void Open(std::int64_t until_us);
  /// CLOCK_MONOTONIC [us] of the first SYNC that Receive would give and that came at `from_us` or
  /// later; none where there is none.
  std::optional<std::int64_t> FindSync(std::int64_t from_us) const;

  firmware_sim::BusStatus Send(std::span<const firmware_sim::CanFrame> frames) override {
    return bus_.Send(frames);
  }
  std::size_t Receive(std::span<firmware_sim::CanFrame> frames) override;
  firmware_sim::BusStatus Wait(std::int64_t timeout_us) override { return bus_.Wait(timeout_us); }
  firmware_sim::BusCounters counters() const override { return bus_.counters(); }

  std::uint64_t syncs() const { return syncs_; }  ///< given by Receive
  std::uint64_t lost() const { return lost_; }    ///< frames for which there was no room

 private:
  firmware_sim::Bus& bus_;
  firmware_sim::FrameRing waiting_;  ///< stamped with CLOCK_MONOTONIC
  std::int64_t until_us_{0};
  std::uint64_t syncs_{0}, lost_{0};
};

}  // namespace mantle::loop
