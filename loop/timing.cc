#include "loop/timing.h"

#include <fmt/format.h>
#include <pthread.h>
#include <sched.h>

#include <algorithm>
#include <cmath>
#include <cstring>

#include "firmware_sim/bus/socket_time.h"

namespace mantle::loop {

void DurationHistogram::Add(std::int64_t duration_us) {
  std::size_t bin = 0;
  if (duration_us >= 1) {
    const double octaves = std::log2(static_cast<double>(duration_us));
    bin = std::min(kBins - 1, 1 + static_cast<std::size_t>(4.0 * octaves + 1e-9));
  }
  ++bins_[bin];
  ++count_;
  worst_us_ = std::max(worst_us_, duration_us);
}

double DurationHistogram::BinBegin_us(std::size_t bin) {
  return bin == 0 ? 0.0 : std::exp2(0.25 * static_cast<double>(bin - 1));
}

double DurationHistogram::Quantile_us(double share) const {
  const double rank = std::ceil(share * static_cast<double>(count_));
  double below = 0;
  for (std::size_t i = 0; i < kBins; ++i) {
    below += static_cast<double>(bins_[i]);
    if (below < rank || bins_[i] == 0) continue;
    const double worst_us = static_cast<double>(worst_us_);
    return i + 1 == kBins ? worst_us : std::min(BinBegin_us(i + 1), worst_us);
  }
  return 0.0;
}

std::string RunAtOnce(int priority) {
  sched_param parameters{};
  parameters.sched_priority = priority;
  const int error = pthread_setschedparam(pthread_self(), SCHED_FIFO, &parameters);
  if (error == 0) return {};
  return fmt::format(
      "SCHED_FIFO is not permitted ({}): a busy machine may delay the loop; allow it by `ulimit -r "
      "99` or CAP_SYS_NICE",
      std::strerror(error));
}

BareTimer::BareTimer(std::int64_t period_us) {
  thread_ = std::thread([this, period_us] {
    RunAtOnce(kTimerPriority);
    std::int64_t due_us = firmware_sim::MonotonicTime_us() + period_us;
    for (; !stopping_.load(std::memory_order_relaxed); due_us += period_us) {
      firmware_sim::SleepUntil(due_us);
      lateness_.Add(firmware_sim::MonotonicTime_us() - due_us);
    }
  });
}

void BareTimer::Stop() {
  stopping_.store(true, std::memory_order_relaxed);
  if (thread_.joinable()) thread_.join();
}

}  // namespace mantle::loop
