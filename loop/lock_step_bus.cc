#include "loop/lock_step_bus.h"

#include <algorithm>

#include "firmware_sim/bus/socket_time.h"

namespace mantle::loop {

using firmware_sim::BusStatus;
using firmware_sim::CanFrame;

namespace {

// Frames between two looks of a station: 16 drives' configuration, PDOs, EMCYs and heartbeats.
constexpr std::size_t kMostExpected = 1024;

bool Same(const CanFrame& a, const CanFrame& b) {
  return a.id == b.id && a.size == b.size && a.extended == b.extended && a.remote == b.remote &&
         std::equal(a.data.begin(), a.data.begin() + a.size, b.data.begin());
}

}  // namespace

LockStepBus::LockStepBus(firmware_sim::Bus& bus, std::int64_t timeout_us)
    : bus_(bus), expected_(kMostExpected), timeout_us_(timeout_us) {}

BusStatus LockStepBus::Send(std::span<const CanFrame> frames) {
  const std::uint64_t before = bus_.counters().sent;
  const BusStatus status = bus_.Send(frames);
  const auto taken = static_cast<std::size_t>(bus_.counters().sent - before);
  if (peer_ != nullptr) {
    Own(frames.first(taken));
    peer_->Own(frames.first(taken));
    for (const CanFrame& frame : frames.first(taken)) peer_->expected_.Push(frame);
  }
  return status;
}

void LockStepBus::Own(std::span<const CanFrame> frames) {
  for (const CanFrame& frame : frames) {
    if (!frame.extended && !frame.error && frame.id < owned_.size()) owned_.set(frame.id);
  }
}

void LockStepBus::CheckSender(const CanFrame& frame) {
  if (!expected_.empty() && Same(frame, expected_.Front())) {
    expected_.Pop();
    return;
  }
  // What had been given up may still come.
  if (stalled_ || frame.extended || frame.error || frame.id >= owned_.size()) return;
  if (!owned_.test(frame.id)) return;
  if (foreign_ == 0) first_foreign_ = frame;
  ++foreign_;
}

std::size_t LockStepBus::Receive(std::span<CanFrame> frames) {
  std::size_t count = 0;
  std::int64_t deadline_us = 0;
  for (;;) {
    const std::size_t more = bus_.Receive(frames.subspan(count));
    for (std::size_t i = count; i < count + more; ++i) {
      frames[i].time_us = now_us_;
      CheckSender(frames[i]);
    }
    count += more;
    if (expected_.empty() || count == frames.size()) return count;
    const std::int64_t now_us = firmware_sim::MonotonicTime_us();
    if (deadline_us == 0) deadline_us = now_us + timeout_us_;
    if (now_us >= deadline_us) {
      if (!stalled_) missing_ = expected_.Front();
      stalled_ = true;
      expected_.Clear();
      return count;
    }
    bus_.Wait(deadline_us - now_us);
  }
}

}  // namespace mantle::loop
