#include "loop/lock_step_bus.h"

#include <gtest/gtest.h>

#include <deque>
#include <vector>

namespace mantle::loop {
namespace {

using firmware_sim::Bus;
using firmware_sim::BusCounters;
using firmware_sim::BusStatus;
using firmware_sim::CanFrame;

constexpr std::int64_t kTimeout_us = 20'000;

CanFrame Frame(std::uint32_t id) {
  CanFrame frame;
  frame.id = id;
  return frame;
}

/// A wire that delivers one frame per look, and loses what it is told to: the slowest scheduling
/// that a socket can show.
struct SlowWire {
  std::deque<CanFrame> waiting;
  bool ready{false};
};
class SlowStation final : public Bus {
 public:
  SlowStation(SlowWire& out, SlowWire& in) : out_(out), in_(in) {}
  BusStatus Send(std::span<const CanFrame> frames) override {
    for (const CanFrame& frame : frames) {
      if (frame.id != lost_id) out_.waiting.push_back(frame);
    }
    counters_.sent += frames.size();
    return BusStatus::kOk;
  }
  std::size_t Receive(std::span<CanFrame> frames) override {
    if (in_.waiting.empty() || !in_.ready || frames.empty()) return 0;
    in_.ready = false;
    frames[0] = in_.waiting.front();
    in_.waiting.pop_front();
    return 1;
  }
  BusStatus Wait(std::int64_t) override {
    in_.ready = true;
    return BusStatus::kOk;
  }
  BusCounters counters() const override { return counters_; }
  std::uint32_t lost_id{0xFFFF};

 private:
  SlowWire& out_;
  SlowWire& in_;
  BusCounters counters_{};
};

struct Pair {
  SlowWire there, back;
  SlowStation left{there, back}, right{back, there};
  LockStepBus a{left, kTimeout_us}, b{right, kTimeout_us};
  Pair() {
    a.Connect(&b);
    b.Connect(&a);
  }
};

std::vector<std::uint32_t> Ids(Bus& bus) {
  std::vector<std::uint32_t> ids;
  CanFrame batch[4];
  for (std::size_t count = 0; (count = bus.Receive(batch)) > 0;) {
    for (std::size_t i = 0; i < count; ++i) ids.push_back(batch[i].id);
  }
  return ids;
}

TEST(LockStepBus, WhatWasSentIsThereHoweverSlowTheWire) {
  Pair pair;
  const CanFrame frames[] = {Frame(1), Frame(2), Frame(3), Frame(4), Frame(5), Frame(6)};
  EXPECT_EQ(pair.a.Send(frames), BusStatus::kOk);
  EXPECT_EQ(Ids(pair.b), (std::vector<std::uint32_t>{1, 2, 3, 4, 5, 6}));
  EXPECT_FALSE(pair.b.stalled());
}

TEST(LockStepBus, NothingIsWaitedForWhereNothingWasSent) {
  Pair pair;
  EXPECT_TRUE(Ids(pair.b).empty());
  EXPECT_FALSE(pair.b.stalled());
}

TEST(LockStepBus, FramesOfOthersPassThrough) {
  Pair pair;
  pair.there.waiting.push_back(Frame(0x77));
  const CanFrame frame = Frame(1);
  pair.a.Send({&frame, 1});
  EXPECT_EQ(Ids(pair.b), (std::vector<std::uint32_t>{0x77, 1}));
}

TEST(LockStepBus, FramesCarryTheSimulatedTime) {
  Pair pair;
  pair.b.AdvanceTo(12'345);
  const CanFrame frame = Frame(1);
  pair.a.Send({&frame, 1});
  CanFrame got;
  ASSERT_EQ(pair.b.Receive({&got, 1}), 1U);
  EXPECT_EQ(got.time_us, 12'345);
}

TEST(LockStepBus, ALostFrameStallsAndIsNamed) {
  Pair pair;
  pair.left.lost_id = 0x201;
  const CanFrame frames[] = {Frame(0x201), Frame(0x80)};
  pair.a.Send(frames);
  Ids(pair.b);
  EXPECT_TRUE(pair.b.stalled());
  EXPECT_EQ(pair.b.missing().id, 0x201U);
}

TEST(LockStepBus, AStrangersFrameWithAnIdentifierOfTheRunIsCountedAndNamed) {
  Pair pair;
  const CanFrame own[] = {Frame(0x201), Frame(0x202)};
  pair.a.Send(own);
  // Before, between and after ours, and a copy of ours.
  pair.there.waiting.push_front(Frame(0x300));
  pair.there.waiting.push_back(Frame(0x201));
  EXPECT_EQ(Ids(pair.b).size(), 3U) << "it waits for the expected ones alone";
  pair.b.Wait(0);
  EXPECT_EQ(Ids(pair.b), (std::vector<std::uint32_t>{0x201}));
  EXPECT_EQ(pair.b.foreign(), 1U) << "300 is nobody's: a stranger may use it";
  EXPECT_EQ(pair.b.first_foreign().id, 0x201U);
  EXPECT_EQ(pair.a.foreign(), 0U);
  // What the station sends itself, a stranger may not send either.
  pair.there.waiting.push_back(Frame(0x181));
  const CanFrame reply[] = {Frame(0x181)};
  pair.b.Send(reply);
  pair.b.Wait(0);
  Ids(pair.b);
  EXPECT_EQ(pair.b.foreign(), 2U);
  EXPECT_FALSE(pair.b.stalled());
}

}  // namespace
}  // namespace mantle::loop
