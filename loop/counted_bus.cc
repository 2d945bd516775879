#include "loop/counted_bus.h"

#include "firmware_sim/bus/socket_time.h"

namespace mantle::loop {

using firmware_sim::CanFrame;

std::size_t CountedBus::Receive(std::span<CanFrame> frames) {
  std::size_t count = 0;
  std::int64_t deadline_us = 0;
  while (count < frames.size()) {
    const std::size_t more = bus_.Receive(frames.subspan(count));
    for (std::size_t i = count; i < count + more; ++i) {
      frames[i].time_us = now_us_;
      last_ = frames[i];
    }
    count += more;
    received_ += static_cast<std::int64_t>(more);
    if (received_ >= expected_ || stalled_) break;
    const std::int64_t now_us = firmware_sim::MonotonicTime_us();
    if (deadline_us == 0) deadline_us = now_us + timeout_us_;
    if (now_us >= deadline_us) {
      stalled_ = true;
      break;
    }
    bus_.Wait(deadline_us - now_us);
  }
  if (received_ > expected_) foreign_ = static_cast<std::uint64_t>(received_ - expected_);
  return count;
}

}  // namespace mantle::loop
