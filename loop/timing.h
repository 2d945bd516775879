#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <string>
#include <thread>

/// @file
/// What both sides of a loop in real time need of clocks and threads.

namespace mantle::loop {

/// How long something took, or how late it was: counts in bins of a quarter of an octave. Adding
/// allocates nothing.
class DurationHistogram {
 public:
  /// Bin i > 0 begins at 2^((i - 1) / 4) us; bin 0 holds what is below 1 us, the last one all from
  /// 2^20 us (a second) on.
  static constexpr std::size_t kBins = 82;

  void Add(std::int64_t duration_us);

  std::uint64_t count() const { return count_; }
  std::int64_t worst_us() const { return worst_us_; }
  /// Upper end of the bin that holds this share of the values, but not above the worst [us]; 0
  /// where there is none.
  double Quantile_us(double share) const;
  const std::array<std::uint64_t, kBins>& bins() const { return bins_; }
  static double BinBegin_us(std::size_t bin);

 private:
  std::array<std::uint64_t, kBins> bins_{};
  std::uint64_t count_{0};
  std::int64_t worst_us_{0};
};

/// Priorities of the threads of a loop (SCHED_FIFO): a bare timer beside it, the fast loop, who
/// hears sensor messages for it, the plant, the planner. Everything else runs as the system likes.
inline constexpr int kTimerPriority = 60, kFastLoopPriority = 50, kSensorPriority = 45,
                     kPlantPriority = 40, kPlannerPriority = 20;

/// Puts the calling thread under SCHED_FIFO. Returns why the system refused, empty where it did
/// not.
std::string RunAtOnce(int priority);

/// A thread that does nothing but wake on time, beside a loop in real time: how late it is tells
/// what the machine itself adds.
class BareTimer {
 public:
  explicit BareTimer(std::int64_t period_us);
  ~BareTimer() { Stop(); }
  BareTimer(const BareTimer&) = delete;
  BareTimer& operator=(const BareTimer&) = delete;

  void Stop();
  /// Whole once it has stopped.
  const DurationHistogram& lateness() const { return lateness_; }

 private:
  DurationHistogram lateness_;
  std::atomic<bool> stopping_{false};
  std::thread thread_;
};

}  // namespace mantle::loop
