#include "firmware_sim/bus/fault_injecting_bus.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>
#include <stdexcept>
#include <vector>

#include "firmware_sim/bus/loop_bus.h"
#include "tests/firmware_sim/frames.h"

namespace mantle::firmware_sim {
namespace {

constexpr int kFrames = 10'000;
// Five standard deviations of a binomial share of 10 % in kFrames.
constexpr double kShareTolerance = 0.015;

struct Link {
  explicit Link(const FaultOptions& options) : bad(*inner, options) {}
  LoopMedium medium{LoopOptions{.receive_capacity = 4 * kFrames}};
  std::unique_ptr<Bus> inner{medium.MakeStation()};
  std::unique_ptr<Bus> other{medium.MakeStation()};
  FaultInjectingBus bad;

  void AdvanceTo(std::int64_t now_us) {
    medium.AdvanceTo(now_us);
    bad.AdvanceTo(now_us);
  }
};

CanFrame Numbered(int i) { return DataFrame(0x100, {i & 0xFF, i >> 8}); }
int Number(const CanFrame& frame) { return frame.data[0] | frame.data[1] << 8; }

TEST(FaultInjectingBus, WithoutFaultsItIsTheBus) {
  Link link({});
  const CanFrame frame = DataFrame(0x123, {1, 2});
  EXPECT_EQ(link.bad.Send({&frame, 1}), BusStatus::kOk);
  EXPECT_EQ(Drain(*link.other).size(), 1U);
  link.other->Send({&frame, 1});
  const auto got = Drain(link.bad);
  ASSERT_EQ(got.size(), 1U);
  ExpectSameFrame(got[0], frame);
}

TEST(FaultInjectingBus, LosesTheShareInBothDirections) {
  Link link({.loss = 0.1, .seed = 3});
  for (int i = 0; i < kFrames; ++i) {
    const CanFrame frame = Numbered(i);
    link.bad.Send({&frame, 1});
    link.other->Send({&frame, 1});
    link.AdvanceTo(i);
    if (i % 100 == 0) Drain(link.bad);
  }
  const auto out = static_cast<double>(Drain(*link.other).size());
  EXPECT_NEAR(out / kFrames, 0.9, kShareTolerance);
  EXPECT_NEAR(static_cast<double>(link.bad.fault_counters().lost) / (2.0 * kFrames), 0.1,
              kShareTolerance);
  EXPECT_EQ(link.bad.fault_counters().overflowed, 0U);
}

TEST(FaultInjectingBus, TheSeedDecides) {
  const auto survivors = [](std::uint64_t seed) {
    Link link({.loss = 0.5, .seed = seed});
    for (int i = 0; i < 100; ++i) {
      const CanFrame frame = Numbered(i);
      link.bad.Send({&frame, 1});
    }
    std::vector<int> numbers;
    for (const CanFrame& frame : Drain(*link.other)) numbers.push_back(Number(frame));
    return numbers;
  };
  EXPECT_EQ(survivors(5), survivors(5));
  EXPECT_NE(survivors(5), survivors(6));
}

TEST(FaultInjectingBus, DelaysByTheTimeGiven) {
  Link link({.delay_us = 3000});
  const CanFrame frame = DataFrame(1, {});
  link.AdvanceTo(1000);
  link.bad.Send({&frame, 1});
  link.other->Send({&frame, 1});
  link.AdvanceTo(1000);
  link.AdvanceTo(3999);
  EXPECT_TRUE(Drain(*link.other).empty());
  EXPECT_TRUE(Drain(link.bad).empty());
  link.AdvanceTo(4000);
  EXPECT_EQ(Drain(*link.other).size(), 1U);
  EXPECT_EQ(Drain(link.bad).size(), 1U);
}

TEST(FaultInjectingBus, DuplicatesAndReordersButInventsNothing) {
  Link link({.duplicate = 0.1, .reorder = 0.2, .seed = 9});
  std::vector<int> arrived;
  for (int i = 0; i < kFrames; ++i) {
    link.AdvanceTo(i * 100);
    const CanFrame frame = Numbered(i);
    link.bad.Send({&frame, 1});
    for (const CanFrame& got : Drain(*link.other)) arrived.push_back(Number(got));
  }
  link.AdvanceTo(kFrames * 100 + 10'000);
  for (const CanFrame& got : Drain(*link.other)) arrived.push_back(Number(got));
  EXPECT_FALSE(std::is_sorted(arrived.begin(), arrived.end()));
  EXPECT_NEAR(static_cast<double>(arrived.size()) / kFrames, 1.1, kShareTolerance);
  EXPECT_EQ(std::set<int>(arrived.begin(), arrived.end()).size(),
            static_cast<std::size_t>(kFrames));
}

TEST(FaultInjectingBus, OptionsMayChangeUnderWay) {
  Link link({});
  const CanFrame frame = DataFrame(1, {});
  link.bad.SetOptions({.loss = 1.0});
  link.bad.Send({&frame, 1});
  EXPECT_TRUE(Drain(*link.other).empty());
  link.bad.SetOptions({});
  link.bad.Send({&frame, 1});
  EXPECT_EQ(Drain(*link.other).size(), 1U);
}

TEST(FaultInjectingBus, CountsWhatFoundNoRoom) {
  Link link({.delay_us = 1000, .capacity = 8});
  for (int i = 0; i < 10; ++i) {
    const CanFrame frame = Numbered(i);
    link.bad.Send({&frame, 1});
  }
  EXPECT_EQ(link.bad.fault_counters().overflowed, 2U);
}

TEST(FaultInjectingBus, RefusesImpossibleOptions) {
  LoopMedium medium;
  auto bus = medium.MakeStation();
  EXPECT_THROW(FaultInjectingBus(*bus, {.loss = 1.5}), std::invalid_argument);
  EXPECT_THROW(FaultInjectingBus(*bus, {.duplicate = -0.1}), std::invalid_argument);
  EXPECT_THROW(FaultInjectingBus(*bus, {.delay_us = -1}), std::invalid_argument);
  EXPECT_THROW(FaultInjectingBus(*bus, {.capacity = 0}), std::invalid_argument);
}

}  // namespace
}  // namespace mantle::firmware_sim
