#pragma once

#include <gtest/gtest.h>

#include <functional>
#include <memory>
#include <vector>

#include "tests/firmware_sim/frames.h"

/// What every Bus promises (firmware_sim/bus/bus.h), as one suite that runs over each
/// implementation: a test program instantiates it with a function that makes two stations on one
/// wire.

namespace mantle::firmware_sim::test {

/// Two stations on one wire, and whatever must outlive them.
class Wire {
 public:
  virtual ~Wire() = default;
  virtual Bus& a() = 0;
  virtual Bus& b() = 0;
};

struct BusCase {
  const char* name;
  std::function<std::unique_ptr<Wire>()> make;
};
inline void PrintTo(const BusCase& bus, std::ostream* out) { *out << bus.name; }

class BusProperties : public ::testing::TestWithParam<BusCase> {
 protected:
  void SetUp() override { wire_ = GetParam().make(); }
  Bus& a() { return wire_->a(); }
  Bus& b() { return wire_->b(); }

  std::unique_ptr<Wire> wire_;
};

TEST_P(BusProperties, WhatOneSendsTheOtherReceivesInOrderAndWhole) {
  const CanFrame frames[] = {DataFrame(0x181, {1, 2, 3, 4, 5, 6, 7, 8}), DataFrame(0x080, {}),
                             ExtendedFrame(0x1ABCDEF, {0xFF}), RemoteFrame(0x701, 1)};
  EXPECT_EQ(a().Send(frames), BusStatus::kOk);
  const auto got = DrainUntil(b(), std::size(frames));
  ASSERT_EQ(got.size(), std::size(frames));
  for (std::size_t i = 0; i < got.size(); ++i) ExpectSameFrame(got[i], frames[i]);
}

TEST_P(BusProperties, NobodyHearsHimself) {
  const CanFrame from_a = DataFrame(0x101, {1}), from_b = DataFrame(0x102, {2});
  a().Send({&from_a, 1});
  b().Send({&from_b, 1});
  EXPECT_EQ(Ids(DrainUntil(b(), 1)), (std::vector<std::uint32_t>{0x101}));
  EXPECT_EQ(Ids(DrainUntil(a(), 1)), (std::vector<std::uint32_t>{0x102}));
  EXPECT_TRUE(Drain(a()).empty());
  EXPECT_TRUE(Drain(b()).empty());
}

TEST_P(BusProperties, AFrameIsReceivedOnce) {
  const CanFrame frame = DataFrame(0x123, {7});
  a().Send({&frame, 1});
  EXPECT_EQ(DrainUntil(b(), 1).size(), 1U);
  EXPECT_TRUE(Drain(b()).empty());
}

TEST_P(BusProperties, AShortBufferTakesTheOldestAndLeavesTheRest) {
  std::vector<CanFrame> frames;
  for (std::uint32_t i = 0; i < 5; ++i)
    frames.push_back(DataFrame(0x200 + i, {static_cast<int>(i)}));
  a().Send(frames);
  std::vector<std::uint32_t> ids;
  for (int tries = 0; ids.size() < 5 && tries < 1000; ++tries) {
    CanFrame two[2];
    const std::size_t count = b().Receive(two);
    ASSERT_LE(count, 2U);
    for (std::size_t i = 0; i < count; ++i) ids.push_back(two[i].id);
    if (count == 0) b().Wait(1000);
  }
  EXPECT_EQ(ids, (std::vector<std::uint32_t>{0x200, 0x201, 0x202, 0x203, 0x204}));
}

TEST_P(BusProperties, CountersSayWhatPassed) {
  const BusCounters a_before = a().counters(), b_before = b().counters();
  std::vector<CanFrame> frames(7, DataFrame(0x300, {1}));
  a().Send(frames);
  ASSERT_EQ(DrainUntil(b(), 7).size(), 7U);
  EXPECT_EQ(a().counters().sent - a_before.sent, 7U);
  EXPECT_EQ(a().counters().received, a_before.received);
  EXPECT_EQ(b().counters().received - b_before.received, 7U);
  EXPECT_EQ(b().counters().sent, b_before.sent);
  EXPECT_EQ(a().counters().send_dropped, a_before.send_dropped);
  EXPECT_EQ(b().counters().receive_dropped, b_before.receive_dropped);
}

TEST_P(BusProperties, NothingToSendOrReceiveIsNoError) {
  EXPECT_EQ(a().Send({}), BusStatus::kOk);
  EXPECT_EQ(b().Receive({}), 0U);
  EXPECT_TRUE(Drain(b()).empty());
  EXPECT_EQ(b().Wait(0), BusStatus::kOk);
}

}  // namespace mantle::firmware_sim::test
