#include "loop/pacer.h"

#include <algorithm>

#include "firmware_sim/bus/socket_time.h"

namespace mantle::loop {

void Pacer::WaitForTurn() {
  const std::int64_t now_us = firmware_sim::MonotonicTime_us();
  if (turns_ == 0) next_us_ = now_us;
  if (now_us < next_us_) firmware_sim::SleepFor(next_us_ - now_us);
  const std::int64_t late_us = firmware_sim::MonotonicTime_us() - next_us_;
  worst_lateness_us_ = std::max(worst_lateness_us_, late_us);
  if (late_us > period_us_ / 10) ++late_turns_;
  next_us_ += period_us_;
  ++turns_;
}

}  // namespace mantle::loop
