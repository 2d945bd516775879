#include "firmware_sim/bus/log_player.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <span>
#include <stdexcept>
#include <utility>

namespace mantle::firmware_sim {

LogPlayer::LogPlayer(std::vector<CanFrame> frames, std::int64_t start_us, double speed)
    : frames_(std::move(frames)) {
  if (!(speed > 0)) {
    throw std::invalid_argument(fmt::format("replay: speed is {}, must be above 0", speed));
  }
  std::erase_if(frames_, [](const CanFrame& frame) { return frame.error; });
  due_us_.reserve(frames_.size());
  std::int64_t last_us = start_us;
  for (const CanFrame& frame : frames_) {
    const auto since_first_us = static_cast<double>(frame.time_us - frames_.front().time_us);
    last_us = std::max(last_us,
                       start_us + static_cast<std::int64_t>(std::llround(since_first_us / speed)));
    due_us_.push_back(last_us);
  }
}

std::size_t LogPlayer::Play(std::int64_t now_us, Bus& bus) {
  const auto end =
      std::upper_bound(due_us_.begin() + static_cast<std::ptrdiff_t>(next_), due_us_.end(), now_us);
  const auto due_end = static_cast<std::size_t>(end - due_us_.begin());
  if (due_end == next_) return 0;
  const std::uint64_t before = bus.counters().sent;
  bus.Send(std::span(frames_).subspan(next_, due_end - next_));
  const auto sent = static_cast<std::size_t>(bus.counters().sent - before);
  refused_ += due_end - next_ - sent;
  next_ = due_end;
  return sent;
}

}  // namespace mantle::firmware_sim
