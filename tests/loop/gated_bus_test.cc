#include "loop/plant_side/gated_bus.h"

#include <gtest/gtest.h>

#include <array>

#include "firmware_sim/bus/pair_bus.h"
#include "firmware_sim/bus/socket_time.h"

namespace mantle::loop {
namespace {

using firmware_sim::CanFrame;
using firmware_sim::MonotonicTime_us;
using firmware_sim::SleepFor;

CanFrame WithId(std::uint32_t id) {
  CanFrame frame;
  frame.id = id;
  return frame;
}

TEST(GatedBus, AFrameComesAtTheInstantAtWhichItWasOnTheBus) {
  firmware_sim::PairBus pair;
  auto master = pair.MakeStation(0), drives = pair.MakeStation(1);
  GatedBus gate(*drives);
  const auto send = [&](std::uint32_t id) {
    const CanFrame frame = WithId(id);
    const std::int64_t before_us = MonotonicTime_us();
    master->Send({&frame, 1});
    SleepFor(5'000);
    return before_us;
  };
  const std::int64_t rpdo_us = send(0x201), sync_us = send(0x080);
  std::array<CanFrame, 8> batch;
  gate.Open(rpdo_us - 1'000);  // the plant is held up: its time is before either
  EXPECT_EQ(gate.Receive(batch), 0U);
  EXPECT_FALSE(gate.FindSync(0));
  gate.Open(rpdo_us + 3'000);
  ASSERT_EQ(gate.Receive(batch), 1U);
  EXPECT_EQ(batch[0].id, 0x201U);
  gate.Open(sync_us + 3'000);
  const auto sync = gate.FindSync(rpdo_us);
  ASSERT_TRUE(sync);
  EXPECT_NEAR(static_cast<double>(*sync), static_cast<double>(sync_us), 2'000.0);
  EXPECT_FALSE(gate.FindSync(sync_us + 4'000)) << "an older one does not count";
  ASSERT_EQ(gate.Receive(batch), 1U);
  EXPECT_EQ(gate.syncs(), 1U);
}

TEST(GatedBus, AStampThatLiesAheadCountsAsOfNow) {
  struct Ahead final : firmware_sim::Bus {
    firmware_sim::BusStatus Send(std::span<const CanFrame>) override { return {}; }
    std::size_t Receive(std::span<CanFrame> frames) override {
      if (given) return 0;
      given = true;
      frames[0] = WithId(0x201);
      frames[0].time_us = firmware_sim::RealTime_us() + 3'600'000'000;  // the clock was set back
      return 1;
    }
    firmware_sim::BusStatus Wait(std::int64_t) override { return {}; }
    firmware_sim::BusCounters counters() const override { return {}; }
    bool given{false};
  } bus;
  GatedBus gate(bus);
  gate.Open(MonotonicTime_us() + 1'000);
  CanFrame frame;
  EXPECT_EQ(gate.Receive({&frame, 1}), 1U);
}

}  // namespace
}  // namespace mantle::loop
