#include "loop/metered_bus.h"

#include <gtest/gtest.h>

#include <vector>

#include "firmware_sim/bus/bus_load.h"
#include "firmware_sim/bus/loop_bus.h"

namespace mantle::loop {
namespace {

using firmware_sim::CanFrame;

CanFrame Frame(std::uint32_t id, std::uint8_t size, std::uint8_t fill) {
  CanFrame frame;
  frame.id = id;
  frame.size = size;
  for (std::uint8_t i = 0; i < size; ++i) frame.data[i] = fill;
  return frame;
}

TEST(MeteredBus, CountsFramesBothWaysWithTheirBits) {
  firmware_sim::LoopMedium medium;
  const auto station = medium.MakeStation({});
  const auto other = medium.MakeStation({});
  MeteredBus meter(*station);
  const std::vector<CanFrame> out = {Frame(0x080, 0, 0), Frame(0x201, 8, 0x00)};
  const std::vector<CanFrame> in = {Frame(0x181, 8, 0x55)};
  EXPECT_EQ(meter.Send(out), firmware_sim::BusStatus::kOk);
  other->Send(in);
  std::vector<CanFrame> received(4);
  EXPECT_EQ(meter.Receive(received), in.size());
  EXPECT_EQ(other->Receive(received), out.size()) << "what is metered also arrives";
  EXPECT_EQ(meter.traffic().frames, out.size() + in.size());
  // Zeros are stuffed, 0x55 is not.
  std::uint64_t bits = 0;
  for (const auto& frames : {out, in}) {
    for (const CanFrame& f : frames) bits += firmware_sim::ActualFrameBits(f);
  }
  EXPECT_EQ(meter.traffic().bits, bits);
  EXPECT_EQ(meter.traffic().worst_bits,
            firmware_sim::WorstFrameBits(0, false) + 2U * firmware_sim::WorstFrameBits(8, false));
  EXPECT_LT(meter.traffic().bits, meter.traffic().worst_bits);
}

TEST(MeteredBus, WhatTheBusDidNotTakeIsNotCounted) {
  firmware_sim::LoopMedium medium;
  const auto station = medium.MakeStation({});
  const auto deaf = medium.MakeStation({});  // never reads, so that its queue fills
  MeteredBus meter(*station);
  const std::vector<CanFrame> batch(1000, Frame(0x201, 8, 0xFF));
  for (int k = 0; k < 100; ++k) meter.Send(batch);
  EXPECT_EQ(meter.traffic().frames, meter.counters().sent);
}

}  // namespace
}  // namespace mantle::loop
