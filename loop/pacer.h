#pragma once

#include <cstdint>

namespace mantle::loop {

/// Keeps a loop on the wall clock: turn k begins at t0 + k period (CLOCK_MONOTONIC, absolute, so
/// that lateness does not add up). A turn that begins late is counted; the next ones keep their
/// times.
class Pacer {
 public:
  explicit Pacer(std::int64_t period_us) : period_us_(period_us) {}

  /// Blocks until the next turn begins; the first call is t0.
  void WaitForTurn();

  std::int64_t turns() const { return turns_; }
  std::int64_t late_turns() const { return late_turns_; }  ///< by more than a tenth of the period
  std::int64_t worst_lateness_us() const { return worst_lateness_us_; }

 private:
  std::int64_t period_us_;
  std::int64_t next_us_{0};
  std::int64_t turns_{0}, late_turns_{0}, worst_lateness_us_{0};
};

}  // namespace mantle::loop
