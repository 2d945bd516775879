#include "loop/watching_bus.h"

namespace mantle::loop {

using firmware_sim::BusStatus;
using firmware_sim::CanFrame;

BusStatus WatchingBus::Send(std::span<const CanFrame> frames) {
  for (const CanFrame& frame : frames) {
    if (!frame.extended && !frame.error && frame.id < owned_.size()) owned_.set(frame.id);
  }
  return bus_.Send(frames);
}

std::size_t WatchingBus::Receive(std::span<CanFrame> frames) {
  const std::size_t count = bus_.Receive(frames);
  for (const CanFrame& frame : frames.first(count)) {
    if (frame.extended || frame.error || frame.id >= owned_.size() || !owned_.test(frame.id)) {
      continue;
    }
    if (foreign_.load(std::memory_order_relaxed) == 0) {
      first_.store(frame.id, std::memory_order_relaxed);
    }
    foreign_.fetch_add(1, std::memory_order_relaxed);
  }
  return count;
}

}  // namespace mantle::loop
