#pragma once

#include <gtest/gtest.h>

#include <cstdint>
#include <initializer_list>
#include <string>
#include <vector>

#include "firmware_sim/bus/bus.h"
#include "firmware_sim/bus/can_frame.h"

/// Short ways to write frames and to read a bus in the tests of firmware_sim.

namespace mantle::firmware_sim {

inline CanFrame DataFrame(std::uint32_t id, std::initializer_list<int> bytes,
                          std::int64_t time_us = 0) {
  CanFrame frame;
  frame.id = id;
  frame.time_us = time_us;
  for (const int byte : bytes) frame.data[frame.size++] = static_cast<std::uint8_t>(byte);
  return frame;
}

inline CanFrame ExtendedFrame(std::uint32_t id, std::initializer_list<int> bytes) {
  CanFrame frame = DataFrame(id, bytes);
  frame.extended = true;
  return frame;
}

inline CanFrame RemoteFrame(std::uint32_t id, int size) {
  CanFrame frame;
  frame.id = id;
  frame.remote = true;
  frame.size = static_cast<std::uint8_t>(size);
  return frame;
}

inline CanFrame ErrorFrame(std::uint32_t error_class) {
  CanFrame frame;
  frame.id = error_class;
  frame.error = true;
  frame.size = 8;
  return frame;
}

/// What a frame says, whenever it was.
inline void ExpectSameFrame(const CanFrame& actual, const CanFrame& expected) {
  EXPECT_EQ(actual.id, expected.id);
  EXPECT_EQ(actual.size, expected.size);
  EXPECT_EQ(actual.extended, expected.extended);
  EXPECT_EQ(actual.remote, expected.remote);
  EXPECT_EQ(actual.error, expected.error);
  EXPECT_EQ(actual.data, expected.data);
}

/// Every frame that waits on `bus`.
inline std::vector<CanFrame> Drain(Bus& bus) {
  std::vector<CanFrame> frames;
  CanFrame batch[32];
  for (std::size_t count = 0; (count = bus.Receive(batch)) > 0;) {
    frames.insert(frames.end(), batch, batch + count);
  }
  return frames;
}

/// Waits on the wall clock for `count` frames, for the transports that have one.
inline std::vector<CanFrame> DrainUntil(Bus& bus, std::size_t count,
                                        std::int64_t limit_us = 2'000'000) {
  constexpr std::int64_t kSlice_us = 10'000;
  std::vector<CanFrame> frames = Drain(bus);
  for (std::int64_t waited_us = 0; frames.size() < count && waited_us < limit_us;
       waited_us += kSlice_us) {
    bus.Wait(kSlice_us);
    for (const CanFrame& frame : Drain(bus)) frames.push_back(frame);
  }
  return frames;
}

inline std::vector<std::uint32_t> Ids(const std::vector<CanFrame>& frames) {
  std::vector<std::uint32_t> ids;
  for (const CanFrame& frame : frames) ids.push_back(frame.id);
  return ids;
}

}  // namespace mantle::firmware_sim
