#include "loop/plant_side/gated_bus.h"

#include <algorithm>
#include <array>

#include "firmware_sim/bus/socket_time.h"
#include "firmware_sim/canopen/canopen.h"

namespace mantle::loop {

using firmware_sim::CanFrame;

namespace {

constexpr std::size_t kMostWaiting = 4096;
// A bus in flood must not keep the plant from its clock.
constexpr std::size_t kMostFramesALook = 4096;

bool IsSync(const CanFrame& frame) {
  return frame.id == firmware_sim::kCobSync && !frame.extended && !frame.remote && !frame.error;
}

}  // namespace

GatedBus::GatedBus(firmware_sim::Bus& bus) : bus_(bus), waiting_(kMostWaiting) {}

void GatedBus::Open(std::int64_t until_us) {
  until_us_ = until_us;
  std::array<CanFrame, 64> batch;
  for (std::size_t looked = 0; looked < kMostFramesALook; looked += batch.size()) {
    const std::size_t count = bus_.Receive(batch);
    if (count == 0) break;
    const std::int64_t now_us = firmware_sim::MonotonicTime_us();
    const std::int64_t offset_us = now_us - firmware_sim::RealTime_us();
    for (std::size_t i = 0; i < count; ++i) {
      CanFrame frame = batch[i];
      frame.time_us = std::min(frame.time_us + offset_us, now_us);
      if (!waiting_.Push(frame)) ++lost_;
    }
  }
}

std::optional<std::int64_t> GatedBus::FindSync(std::int64_t from_us) const {
  for (std::size_t i = 0; i < waiting_.size(); ++i) {
    const CanFrame& frame = waiting_.At(i);
    if (frame.time_us > until_us_) break;
    if (IsSync(frame) && frame.time_us >= from_us) return frame.time_us;
  }
  return std::nullopt;
}

std::size_t GatedBus::Receive(std::span<CanFrame> frames) {
  std::size_t count = 0;
  while (count < frames.size() && !waiting_.empty() && waiting_.Front().time_us <= until_us_) {
    frames[count] = waiting_.Pop();
    if (IsSync(frames[count])) ++syncs_;
    ++count;
  }
  return count;
}

}  // namespace mantle::loop
