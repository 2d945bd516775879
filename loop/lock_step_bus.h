#pragma once

#include <bitset>
#include <cstdint>

#include "firmware_sim/bus/bus.h"
#include "firmware_sim/bus/frame_ring.h"

namespace mantle::loop {

/// Makes a bus that takes wall time (SocketCAN, multicast) behave towards two stations of one
/// process as the in-process bus does: what one has sent the other has received, before it looks.
/// So a run in simulated time gives the same frames at the same instants whatever the machine does
/// meanwhile. Each station is wrapped; the two know one another:
///
///   Send      passes the frames on and tells the peer to expect them
///   Receive   waits until every expected frame has come, in order, then returns as usual; frames
///             of others pass through and are not waited for
///
/// A frame that does not come within the time-out is given up, and `stalled` says so from then on.
/// A run in lock-step owns the identifiers that its stations have sent: a frame that carries one,
/// and was not sent by the peer, comes from a stranger (another run on the same bus) and falsifies
/// the run. Such frames are counted in `foreign`; their own identifiers strangers may use.
/// Frames are stamped with the simulated time of the last AdvanceTo.
class LockStepBus final : public firmware_sim::Bus {
 public:
  /// `bus` must outlive this one. Until Connect nothing is waited for.
  LockStepBus(firmware_sim::Bus& bus, std::int64_t timeout_us);
  /// The other station; both must live as long as either is used.
  void Connect(LockStepBus* peer) { peer_ = peer; }
  void AdvanceTo(std::int64_t now_us) { now_us_ = now_us; }

  firmware_sim::BusStatus Send(std::span<const firmware_sim::CanFrame> frames) override;
  std::size_t Receive(std::span<firmware_sim::CanFrame> frames) override;
  firmware_sim::BusStatus Wait(std::int64_t timeout_us) override { return bus_.Wait(timeout_us); }
  firmware_sim::BusCounters counters() const override { return bus_.counters(); }

  bool stalled() const { return stalled_; }
  /// The first frame that did not come; where stalled.
  const firmware_sim::CanFrame& missing() const { return missing_; }
  /// Frames of strangers that carried an identifier of the two stations.
  std::uint64_t foreign() const { return foreign_; }
  /// The first of them; where there is one.
  const firmware_sim::CanFrame& first_foreign() const { return first_foreign_; }

 private:
  void Own(std::span<const firmware_sim::CanFrame> frames);
  void CheckSender(const firmware_sim::CanFrame& frame);

  firmware_sim::Bus& bus_;
  LockStepBus* peer_{nullptr};
  firmware_sim::FrameRing expected_;
  firmware_sim::CanFrame missing_{}, first_foreign_{};
  std::bitset<2048> owned_;  ///< base identifiers that either station has sent
  std::uint64_t foreign_{0};
  std::int64_t timeout_us_;
  std::int64_t now_us_{0};
  bool stalled_{false};
};

}  // namespace mantle::loop
