#include "loop/metered_bus.h"

#include <algorithm>

#include "firmware_sim/bus/bus_load.h"

namespace mantle::loop {

using firmware_sim::BusStatus;
using firmware_sim::CanFrame;

namespace {

constexpr std::uint32_t kSync = 0x080;  // identifier

}  // namespace

BusStatus MeteredBus::Send(std::span<const CanFrame> frames) {
  const std::uint64_t before = bus_.counters().sent;
  const BusStatus status = bus_.Send(frames);
  // Frames are taken in order: what was not sent is the rest.
  const auto taken = frames.first(static_cast<std::size_t>(bus_.counters().sent - before));
  Count(taken);
  if (!taken.empty() && taken.back().id == kSync && !taken.back().extended) MarkSync();
  return status;
}

void MeteredBus::MarkSync() {
  if (synced_) peak_ = std::max(peak_, traffic_.worst_bits - at_sync_);
  at_sync_ = traffic_.worst_bits;
  synced_ = true;
}

std::size_t MeteredBus::Receive(std::span<CanFrame> frames) {
  const std::size_t count = bus_.Receive(frames);
  Count(frames.first(count));
  return count;
}

void MeteredBus::Count(std::span<const CanFrame> frames) {
  for (const CanFrame& frame : frames) {
    ++traffic_.frames;
    traffic_.bits += static_cast<std::uint64_t>(firmware_sim::ActualFrameBits(frame));
    traffic_.worst_bits +=
        static_cast<std::uint64_t>(firmware_sim::WorstFrameBits(frame.size, frame.extended));
  }
}

}  // namespace mantle::loop
