#include "firmware_sim/bus/recording_bus.h"

namespace mantle::firmware_sim {

BusStatus RecordingBus::Send(std::span<const CanFrame> frames) {
  const std::uint64_t before = bus_.counters().sent;
  const BusStatus status = bus_.Send(frames);
  // Frames are taken in order: what was not sent is the rest.
  const std::uint64_t taken = bus_.counters().sent - before;
  for (CanFrame frame : frames.first(static_cast<std::size_t>(taken))) {
    frame.time_us = now_us_;
    log_.Write(frame);
  }
  return status;
}

std::size_t RecordingBus::Receive(std::span<CanFrame> frames) {
  const std::size_t count = bus_.Receive(frames);
  for (const CanFrame& frame : frames.first(count)) log_.Write(frame);
  return count;
}

}  // namespace mantle::firmware_sim
