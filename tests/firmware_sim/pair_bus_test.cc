#include "firmware_sim/bus/pair_bus.h"

#include <gtest/gtest.h>

#include <array>
#include <thread>

#include "firmware_sim/bus/socket_time.h"

namespace mantle::firmware_sim {
namespace {

CanFrame Numbered(std::uint32_t number) {
  CanFrame frame;
  frame.id = 0x181;
  frame.size = 4;
  for (int i = 0; i < 4; ++i) {
    frame.data[static_cast<std::size_t>(i)] = static_cast<std::uint8_t>(number >> 8 * i);
  }
  return frame;
}

std::uint32_t NumberOf(const CanFrame& frame) {
  std::uint32_t number = 0;
  for (int i = 3; i >= 0; --i) number = number << 8 | frame.data[static_cast<std::size_t>(i)];
  return number;
}

TEST(PairBus, TwoThreadsGetEachOthersFramesWholeAndInOrder) {
  constexpr std::uint32_t kFrames = 20'000;
  PairBus bus(kFrames);  // none is lost, whoever is slower
  const auto exchange = [](Bus& station) {
    std::uint32_t received = 0, wrong = 0;
    std::array<CanFrame, 32> batch;
    for (std::uint32_t sent = 0; received < kFrames || sent < kFrames;) {
      if (sent < kFrames) {
        const CanFrame frame = Numbered(sent++);
        station.Send({&frame, 1});
      } else {
        station.Wait(100'000);
      }
      const std::size_t count = station.Receive(batch);
      for (std::size_t i = 0; i < count; ++i) wrong += NumberOf(batch[i]) == received++ ? 0 : 1;
    }
    return wrong;
  };
  auto one = bus.MakeStation(0), other = bus.MakeStation(1);
  std::uint32_t wrong_there = 0;
  std::thread there([&] { wrong_there = exchange(*other); });
  EXPECT_EQ(exchange(*one), 0U);
  there.join();
  EXPECT_EQ(wrong_there, 0U);
  EXPECT_EQ(one->counters().receive_dropped, 0U);
}

TEST(PairBus, WaitEndsWithAFrameOrItsTimeOut) {
  PairBus bus;
  auto one = bus.MakeStation(0), other = bus.MakeStation(1);
  const std::int64_t begin_us = MonotonicTime_us();
  one->Wait(20'000);
  EXPECT_GE(MonotonicTime_us() - begin_us, 19'000);
  std::thread sender([&] {
    SleepFor(20'000);
    const CanFrame frame = Numbered(1);
    other->Send({&frame, 1});
  });
  constexpr std::int64_t kLong_us = 20'000'000;
  one->Wait(kLong_us);
  EXPECT_LT(MonotonicTime_us() - begin_us, kLong_us / 2);
  CanFrame frame;
  EXPECT_EQ(one->Receive({&frame, 1}), 1U);
  sender.join();
}

TEST(PairBus, WhatFindsNoRoomIsCountedAtTheReceiverAndFiltersHold) {
  PairBus bus(4);
  const CanFilter only{0x200, 0x780};
  auto one = bus.MakeStation(0), other = bus.MakeStation(1, {&only, 1});
  for (std::uint32_t i = 0; i < 6; ++i) {
    CanFrame frame = Numbered(i);
    frame.id = i == 1 ? 0x201 : 0x181;
    one->Send({&frame, 1});
  }
  EXPECT_EQ(other->counters().receive_dropped, 2U);
  std::array<CanFrame, 8> batch;
  ASSERT_EQ(other->Receive(batch), 1U);
  EXPECT_EQ(NumberOf(batch[0]), 1U);
  EXPECT_EQ(one->Receive(batch), 0U) << "a station does not hear itself";
}

}  // namespace
}  // namespace mantle::firmware_sim
