#pragma once

#include <cstddef>
#include <cstdint>
#include <random>
#include <span>
#include <vector>

#include "firmware_sim/bus/bus.h"

namespace mantle::firmware_sim {

/// What a FaultInjectingBus does to frames.
struct FaultOptions {
  double loss{0};       ///< share of frames that vanish, 0..1
  double duplicate{0};  ///< share of frames that arrive twice, 0..1
  double reorder{0};    ///< share of frames held back by up to reorder_window_us, 0..1
  std::int64_t reorder_window_us{2000};
  std::int64_t delay_us{0};    ///< of every frame
  std::int64_t jitter_us{0};   ///< added to the delay, uniform in 0..jitter_us
  std::uint64_t seed{1};       ///< of the random numbers
  std::size_t capacity{1024};  ///< frames under way in each direction
};

/// What became of the frames.
struct FaultCounters {
  std::uint64_t passed{0};
  std::uint64_t lost{0};
  std::uint64_t duplicated{0};
  std::uint64_t held_back{0};
  std::uint64_t overflowed{0};  ///< found no room among the frames under way
};

/// A bad cable between one station and its bus: frames in both directions are lost, duplicated,
/// delayed and put out of order, at random with a fixed seed. Time is an input: a delayed frame
/// moves on in the AdvanceTo, Send or Receive after it is due.
class FaultInjectingBus final : public Bus {
 public:
  /// `bus` must outlive this one. Throws std::invalid_argument for a share outside 0..1, a negative
  /// time, or a capacity of 0.
  FaultInjectingBus(Bus& bus, const FaultOptions& options);

  /// Moves the clock, never back, and passes on what is due.
  void AdvanceTo(std::int64_t now_us);

  /// New shares and times from now on (the seed and capacity stay).
  void SetOptions(const FaultOptions& options);

  BusStatus Send(std::span<const CanFrame> frames) override;
  std::size_t Receive(std::span<CanFrame> frames) override;
  BusStatus Wait(std::int64_t timeout_us) override { return bus_.Wait(timeout_us); }
  BusCounters counters() const override { return bus_.counters(); }
  const FaultCounters& fault_counters() const { return counters_; }

 private:
  struct Pending {
    std::int64_t due_us{0};
    CanFrame frame;
  };
  using Line = std::vector<Pending>;  // sorted by due_us, first in first out among equals

  double Uniform();
  void Disturb(const CanFrame& frame, Line& line);
  void Schedule(const CanFrame& frame, Line& line);
  BusStatus PassOutgoing();
  void PullIncoming();

  Bus& bus_;
  FaultOptions options_;
  std::mt19937_64 random_;
  Line outgoing_;
  Line incoming_;
  FaultCounters counters_{};
  std::int64_t now_us_{0};
};

}  // namespace mantle::firmware_sim
