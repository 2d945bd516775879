#include "firmware_sim/bus/loop_bus.h"

#include <gtest/gtest.h>

#include <stdexcept>
#include <vector>

#include "firmware_sim/bus/bus_load.h"
#include "tests/firmware_sim/frames.h"

namespace mantle::firmware_sim {
namespace {

using Ids_ = std::vector<std::uint32_t>;

TEST(LoopBus, EveryOtherStationReceivesAndTheSenderDoesNot) {
  LoopMedium medium;
  auto a = medium.MakeStation();
  auto b = medium.MakeStation();
  auto c = medium.MakeStation();
  medium.AdvanceTo(1234);
  const CanFrame frame = DataFrame(0x123, {1, 2, 3});
  EXPECT_EQ(a->Send({&frame, 1}), BusStatus::kOk);
  EXPECT_TRUE(Drain(*a).empty());
  for (Bus* other : {b.get(), c.get()}) {
    const auto got = Drain(*other);
    ASSERT_EQ(got.size(), 1U);
    ExpectSameFrame(got[0], frame);
    EXPECT_EQ(got[0].time_us, 1234);
  }
}

TEST(LoopBus, KeepsTheOrderOfTheCalls) {
  LoopMedium medium;
  auto a = medium.MakeStation();
  auto b = medium.MakeStation();
  auto listener = medium.MakeStation();
  for (int i = 0; i < 10; ++i) {
    const CanFrame frame = DataFrame(static_cast<std::uint32_t>(0x700 - i), {});
    (i % 2 == 0 ? a : b)->Send({&frame, 1});
  }
  EXPECT_EQ(Ids(Drain(*listener)),
            (Ids_{0x700, 0x6FF, 0x6FE, 0x6FD, 0x6FC, 0x6FB, 0x6FA, 0x6F9, 0x6F8, 0x6F7}));
}

TEST(LoopBus, FiltersAsSocketCanDoes) {
  LoopMedium medium;
  auto sender = medium.MakeStation();
  const CanFilter filters[] = {{0x080, 0x7FF}, {0x200, 0x780}};
  auto station = medium.MakeStation(filters);
  for (const std::uint32_t id : {0x000U, 0x080U, 0x200U, 0x27FU, 0x280U}) {
    const CanFrame frame = DataFrame(id, {});
    sender->Send({&frame, 1});
  }
  EXPECT_EQ(Ids(Drain(*station)), (Ids_{0x080, 0x200, 0x27F}));
}

TEST(LoopBus, ASlowReaderLosesTheNewestAndCountsThem) {
  LoopMedium medium({.receive_capacity = 4});
  auto sender = medium.MakeStation();
  auto reader = medium.MakeStation();
  for (std::uint32_t id = 1; id <= 6; ++id) {
    const CanFrame frame = DataFrame(id, {});
    sender->Send({&frame, 1});
  }
  EXPECT_EQ(Ids(Drain(*reader)), (Ids_{1, 2, 3, 4}));
  EXPECT_EQ(reader->counters().receive_dropped, 2U);
  EXPECT_EQ(reader->counters().received, 4U);
  EXPECT_EQ(sender->counters().sent, 6U);
}

TEST(LoopBus, LinkDownRefusesAndLinkUpRecovers) {
  LoopMedium medium;
  auto a = medium.MakeStation();
  auto b = medium.MakeStation();
  const CanFrame frame = DataFrame(1, {});
  medium.SetUp(false);
  EXPECT_EQ(a->Send({&frame, 1}), BusStatus::kDown);
  EXPECT_EQ(a->Wait(0), BusStatus::kDown);
  EXPECT_EQ(a->counters().send_dropped, 1U);
  medium.SetUp(true);
  EXPECT_EQ(a->Send({&frame, 1}), BusStatus::kOk);
  EXPECT_EQ(Drain(*b).size(), 1U);
  EXPECT_EQ(b->counters().recoveries, 1U);
}

TEST(LoopBus, WithABitRateAFrameTakesItsBits) {
  LoopMedium medium({.bit_rate = 1'000'000});
  auto a = medium.MakeStation();
  auto b = medium.MakeStation();
  const CanFrame frame = DataFrame(0x123, {0x55, 0xAA});
  const int bits = ActualFrameBits(frame);
  medium.AdvanceTo(1000);
  a->Send({&frame, 1});
  medium.AdvanceTo(1000 + bits - 1);
  EXPECT_TRUE(Drain(*b).empty());
  medium.AdvanceTo(1000 + bits);
  const auto got = Drain(*b);
  ASSERT_EQ(got.size(), 1U);
  EXPECT_EQ(got[0].time_us, 1000 + bits);
  EXPECT_EQ(medium.bits_carried(), static_cast<std::uint64_t>(bits));
}

TEST(LoopBus, TheLowestIdentifierWinsTheWire) {
  LoopMedium medium({.bit_rate = 1'000'000});
  auto a = medium.MakeStation();
  auto b = medium.MakeStation();
  auto listener = medium.MakeStation();
  const CanFrame from_a[] = {DataFrame(0x300, {}), DataFrame(0x100, {})};
  const CanFrame from_b[] = {DataFrame(0x200, {}), DataFrame(0x400, {})};
  a->Send(from_a);
  b->Send(from_b);
  medium.AdvanceTo(1000);
  // 0x100 stands behind 0x300 in its station's queue, as in a controller with one mailbox.
  EXPECT_EQ(Ids(Drain(*listener)), (Ids_{0x200, 0x300, 0x100, 0x400}));
}

TEST(LoopBus, AFloodOfTheHighestPriorityStarvesTheRest) {
  LoopMedium medium({.bit_rate = 1'000'000});
  auto babbler = medium.MakeStation();
  auto station = medium.MakeStation();
  auto listener = medium.MakeStation();
  const CanFrame late = DataFrame(0x701, {5});
  const CanFrame flood = DataFrame(0x000, {});
  babbler->Send({&flood, 1});
  station->Send({&late, 1});
  for (std::int64_t now_us = 10; now_us <= 20'000; now_us += 10) {
    babbler->Send({&flood, 1});
    medium.AdvanceTo(now_us);
  }
  for (const CanFrame& frame : Drain(*listener)) EXPECT_EQ(frame.id, 0U);
  EXPECT_GT(babbler->counters().send_dropped, 0U);  // the queue is full
  for (std::int64_t now_us = 20'000; now_us <= 60'000; now_us += 10) medium.AdvanceTo(now_us);
  const auto got = Drain(*listener);
  ASSERT_FALSE(got.empty());
  EXPECT_EQ(got.back().id, 0x701U);
}

TEST(LoopBus, AFrameSentLaterStartsLater) {
  LoopMedium medium({.bit_rate = 1'000'000});
  auto a = medium.MakeStation();
  auto b = medium.MakeStation();
  const CanFrame frame = DataFrame(0x10, {});
  medium.AdvanceTo(5000);
  a->Send({&frame, 1});
  medium.AdvanceTo(100'000);
  medium.AdvanceTo(200'000);
  a->Send({&frame, 1});
  medium.AdvanceTo(300'000);
  const auto got = Drain(*b);
  ASSERT_EQ(got.size(), 2U);
  EXPECT_EQ(got[0].time_us, 5000 + ActualFrameBits(frame));
  EXPECT_EQ(got[1].time_us, 200'000 + ActualFrameBits(frame));
}

TEST(LoopBus, RefusesImpossibleOptions) {
  EXPECT_THROW(LoopMedium({.bit_rate = -1}), std::invalid_argument);
  EXPECT_THROW(LoopMedium({.receive_capacity = 0}), std::invalid_argument);
  EXPECT_THROW(LoopMedium({.transmit_capacity = 0}), std::invalid_argument);
}

}  // namespace
}  // namespace mantle::firmware_sim
