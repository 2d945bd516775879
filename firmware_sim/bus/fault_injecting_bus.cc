#include "firmware_sim/bus/fault_injecting_bus.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <stdexcept>
#include <string_view>

namespace mantle::firmware_sim {

namespace {

constexpr std::size_t kMostFramesAPull = 4096;  // a bus in flood must not hold up the caller

void CheckShare(std::string_view name, double share) {
  if (!(share >= 0 && share <= 1)) {
    throw std::invalid_argument(
        fmt::format("fault injection: {} is {}, must be 0 to 1", name, share));
  }
}

void CheckTime(std::string_view name, std::int64_t time_us) {
  if (time_us < 0) {
    throw std::invalid_argument(
        fmt::format("fault injection: {} is {} us, must be 0 or more", name, time_us));
  }
}

void Check(const FaultOptions& options) {
  CheckShare("loss", options.loss);
  CheckShare("duplicate", options.duplicate);
  CheckShare("reorder", options.reorder);
  CheckTime("reorder_window_us", options.reorder_window_us);
  CheckTime("delay_us", options.delay_us);
  CheckTime("jitter_us", options.jitter_us);
}

}  // namespace

FaultInjectingBus::FaultInjectingBus(Bus& bus, const FaultOptions& options)
    : bus_(bus), options_(options), random_(options.seed) {
  Check(options);
  if (options.capacity == 0) {
    throw std::invalid_argument("fault injection: capacity is 0 frames, must be 1 or more");
  }
  outgoing_.reserve(options.capacity);
  incoming_.reserve(options.capacity);
}

void FaultInjectingBus::SetOptions(const FaultOptions& options) {
  Check(options);
  const std::size_t capacity = options_.capacity;
  options_ = options;
  options_.capacity = capacity;
}

double FaultInjectingBus::Uniform() { return static_cast<double>(random_() >> 11U) * 0x1p-53; }

void FaultInjectingBus::Schedule(const CanFrame& frame, Line& line) {
  if (line.size() == options_.capacity) {
    ++counters_.overflowed;
    return;
  }
  double delay_us =
      static_cast<double>(options_.delay_us) + Uniform() * static_cast<double>(options_.jitter_us);
  if (Uniform() < options_.reorder) {
    ++counters_.held_back;
    delay_us += Uniform() * static_cast<double>(options_.reorder_window_us);
  }
  const Pending pending{now_us_ + static_cast<std::int64_t>(delay_us), frame};
  const auto at = std::upper_bound(
      line.begin(), line.end(), pending.due_us,
      [](std::int64_t due_us, const Pending& other) { return due_us < other.due_us; });
  line.insert(at, pending);  // within the reserved capacity
  ++counters_.passed;
}

void FaultInjectingBus::Disturb(const CanFrame& frame, Line& line) {
  if (Uniform() < options_.loss) {
    ++counters_.lost;
    return;
  }
  Schedule(frame, line);
  if (Uniform() < options_.duplicate) {
    ++counters_.duplicated;
    Schedule(frame, line);
  }
}

BusStatus FaultInjectingBus::PassOutgoing() {
  BusStatus status = BusStatus::kOk;
  std::size_t due = 0;
  while (due < outgoing_.size() && outgoing_[due].due_us <= now_us_) {
    const BusStatus sent = bus_.Send({&outgoing_[due].frame, 1});
    if (sent != BusStatus::kOk) status = sent;
    ++due;
  }
  outgoing_.erase(outgoing_.begin(), outgoing_.begin() + static_cast<std::ptrdiff_t>(due));
  return status;
}

void FaultInjectingBus::PullIncoming() {
  std::array<CanFrame, 32> batch;
  for (std::size_t looked = 0; looked < kMostFramesAPull; looked += batch.size()) {
    const std::size_t count = bus_.Receive(batch);
    for (std::size_t i = 0; i < count; ++i) Disturb(batch[i], incoming_);
    if (count < batch.size()) break;
  }
}

void FaultInjectingBus::AdvanceTo(std::int64_t now_us) {
  now_us_ = std::max(now_us_, now_us);
  PassOutgoing();
  PullIncoming();
}

BusStatus FaultInjectingBus::Send(std::span<const CanFrame> frames) {
  for (const CanFrame& frame : frames) Disturb(frame, outgoing_);
  return PassOutgoing();
}

std::size_t FaultInjectingBus::Receive(std::span<CanFrame> frames) {
  PullIncoming();
  std::size_t count = 0;
  while (count < frames.size() && count < incoming_.size() && incoming_[count].due_us <= now_us_) {
    frames[count] = incoming_[count].frame;
    ++count;
  }
  incoming_.erase(incoming_.begin(), incoming_.begin() + static_cast<std::ptrdiff_t>(count));
  return count;
}

}  // namespace mantle::firmware_sim
