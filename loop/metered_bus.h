#pragma once

#include <cstdint>
#include <span>

#include "firmware_sim/bus/bus.h"

namespace mantle::loop {

/// Frames that a station has passed, and the bits that they take on a wire.
struct BusTraffic {
  std::uint64_t frames{0};
  std::uint64_t bits{0};        ///< with the stuff bits that the frames' content needs
  std::uint64_t worst_bits{0};  ///< with the most stuff bits that frames of their sizes can need
};

/// A station that counts the frames it passes, both ways, and the bits they take on a wire
/// (firmware_sim/bus/bus_load.h). At the master's station of a bus with drives alone that is all of
/// the traffic.
class MeteredBus final : public firmware_sim::Bus {
 public:
  /// `bus` must outlive this one.
  explicit MeteredBus(firmware_sim::Bus& bus) : bus_(bus) {}

  firmware_sim::BusStatus Send(std::span<const firmware_sim::CanFrame> frames) override;
  std::size_t Receive(std::span<firmware_sim::CanFrame> frames) override;
  firmware_sim::BusStatus Wait(std::int64_t timeout_us) override { return bus_.Wait(timeout_us); }
  firmware_sim::BusCounters counters() const override { return bus_.counters(); }

  const BusTraffic& traffic() const { return traffic_; }
  /// The most worst_bits between two SYNCs that this station sent.
  std::uint64_t peak_worst_bits() const { return peak_; }
  /// Forgets the peak so far.
  void RestartPeak() {
    peak_ = 0;
    synced_ = false;
  }

 private:
  void MarkSync();
  void Count(std::span<const firmware_sim::CanFrame> frames);

  firmware_sim::Bus& bus_;
  BusTraffic traffic_;
  std::uint64_t at_sync_{0}, peak_{0};  ///< of worst_bits
  bool synced_{false};
};

}  // namespace mantle::loop
