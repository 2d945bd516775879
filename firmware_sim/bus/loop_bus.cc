#include "firmware_sim/bus/loop_bus.h"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>
#include <stdexcept>
#include <utility>

#include "firmware_sim/bus/bus_load.h"

namespace mantle::firmware_sim {

class LoopStation final : public Bus {
 public:
  LoopStation(LoopMedium* medium, std::span<const CanFilter> filters)
      : medium_(medium),
        filters_(filters.begin(), filters.end()),
        received_(medium->options_.receive_capacity),
        waiting_(medium->options_.bit_rate > 0 ? medium->options_.transmit_capacity : 1) {}

  ~LoopStation() override {
    std::erase(medium_->stations_, this);
    if (medium_->sending_ == this) medium_->sending_ = nullptr;
  }

  BusStatus Send(std::span<const CanFrame> frames) override {
    if (!medium_->up_) {
      counters_.send_dropped += frames.size();
      return BusStatus::kDown;
    }
    for (std::size_t i = 0; i < frames.size(); ++i) {
      if (medium_->options_.bit_rate == 0) {
        medium_->Deliver(this, frames[i]);
      } else {
        CanFrame frame = frames[i];
        frame.time_us = medium_->now_us_;
        if (!waiting_.Push(frame)) {
          counters_.send_dropped += frames.size() - i;
          return BusStatus::kFull;
        }
      }
      ++counters_.sent;
    }
    return BusStatus::kOk;
  }

  std::size_t Receive(std::span<CanFrame> frames) override {
    std::size_t count = 0;
    while (count < frames.size() && !received_.empty()) frames[count++] = received_.Pop();
    return count;
  }

  BusStatus Wait(std::int64_t /*timeout_us*/) override {
    return medium_->up_ ? BusStatus::kOk : BusStatus::kDown;
  }

  BusCounters counters() const override { return counters_; }

 private:
  friend class LoopMedium;

  LoopMedium* medium_;
  std::vector<CanFilter> filters_;
  FrameRing received_;
  FrameRing waiting_;
  BusCounters counters_{};
};

LoopMedium::LoopMedium(LoopOptions options) : options_(options) {
  if (options.bit_rate < 0) {
    throw std::invalid_argument(
        fmt::format("loop: bit_rate is {} bit/s, must be 0 or more", options.bit_rate));
  }
  if (options.receive_capacity == 0 || options.transmit_capacity == 0) {
    throw std::invalid_argument("loop: a queue capacity is 0 frames, must be 1 or more");
  }
}

LoopMedium::~LoopMedium() { assert(stations_.empty()); }

std::unique_ptr<Bus> LoopMedium::MakeStation(std::span<const CanFilter> filters) {
  auto station = std::make_unique<LoopStation>(this, filters);
  stations_.push_back(station.get());
  return station;
}

void LoopMedium::Deliver(const LoopStation* from, const CanFrame& frame) {
  CanFrame stamped = frame;
  if (options_.bit_rate == 0) stamped.time_us = now_us_;
  ++frames_carried_;
  bits_carried_ += static_cast<std::uint64_t>(ActualFrameBits(frame));
  for (LoopStation* station : stations_) {
    if (station == from || !Passes(station->filters_, stamped)) continue;
    if (station->received_.Push(stamped)) {
      ++station->counters_.received;
      if (stamped.error) ++station->counters_.error_frames;
    } else {
      ++station->counters_.receive_dropped;
    }
  }
}

LoopStation* LoopMedium::NextToSend() {
  LoopStation* winner = nullptr;
  for (LoopStation* station : stations_) {
    if (station->waiting_.empty()) continue;
    if (!winner ||
        ArbitrationField(station->waiting_.Front()) < ArbitrationField(winner->waiting_.Front())) {
      winner = station;
    }
  }
  return winner;
}

void LoopMedium::AdvanceTo(std::int64_t now_us) {
  if (now_us <= now_us_) return;
  const std::int64_t previous_ns = now_us_ * 1000;
  now_us_ = now_us;
  if (options_.bit_rate == 0) return;
  // Frames wait only since the previous call at the latest: an idle wire starts there.
  if (!sending_) wire_free_ns_ = std::max(wire_free_ns_, previous_ns);
  const std::int64_t now_ns = now_us * 1000;
  for (;;) {
    if (!sending_) {
      LoopStation* winner = NextToSend();
      if (!winner) return;
      frame_on_wire_ = winner->waiting_.Pop();
      const std::int64_t start_ns = std::max(wire_free_ns_, frame_on_wire_.time_us * 1000);
      wire_free_ns_ = start_ns + std::int64_t{ActualFrameBits(frame_on_wire_)} * 1'000'000'000 /
                                     options_.bit_rate;
      sending_ = winner;
    }
    if (wire_free_ns_ > now_ns) return;
    frame_on_wire_.time_us = wire_free_ns_ / 1000;
    Deliver(std::exchange(sending_, nullptr), frame_on_wire_);
  }
}

void LoopMedium::SetUp(bool up) {
  if (up == up_) return;
  up_ = up;
  for (LoopStation* station : stations_) {
    if (up) {
      ++station->counters_.recoveries;
    } else {
      station->counters_.send_dropped += station->waiting_.size();
      station->waiting_.Clear();
    }
  }
  sending_ = nullptr;
}

}  // namespace mantle::firmware_sim
