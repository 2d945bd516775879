#include "firmware_sim/bus/log_player.h"

#include <gtest/gtest.h>

#include <stdexcept>

#include "firmware_sim/bus/loop_bus.h"
#include "tests/firmware_sim/frames.h"

namespace mantle::firmware_sim {
namespace {

TEST(LogPlayer, KeepsTheTimingOfTheLog) {
  LoopMedium medium;
  auto player_bus = medium.MakeStation();
  auto listener = medium.MakeStation();
  LogPlayer player({DataFrame(1, {}, 5'000'000), DataFrame(2, {}, 5'000'100),
                    DataFrame(3, {}, 5'000'050), DataFrame(4, {}, 5'001'000)},
                   100);
  std::vector<CanFrame> got;
  for (std::int64_t now_us = 0; !player.done(); now_us += 10) {
    medium.AdvanceTo(now_us);
    player.Play(now_us, *player_bus);
    for (const CanFrame& frame : Drain(*listener)) got.push_back(frame);
  }
  ASSERT_EQ(Ids(got), (std::vector<std::uint32_t>{1, 2, 3, 4}));
  EXPECT_EQ(got[0].time_us, 100);
  EXPECT_EQ(got[1].time_us, 200);
  EXPECT_EQ(got[2].time_us, 200);  // its stamp went back: at once
  EXPECT_EQ(got[3].time_us, 1100);
}

TEST(LogPlayer, PlaysTwiceAsFast) {
  LogPlayer player({DataFrame(1, {}, 0), DataFrame(2, {}, 1000)}, 0, 2.0);
  LoopMedium medium;
  auto bus = medium.MakeStation();
  EXPECT_EQ(player.Play(0, *bus), 1U);
  EXPECT_EQ(player.next_due_us(), 500);
  EXPECT_EQ(player.Play(499, *bus), 0U);
  EXPECT_EQ(player.Play(500, *bus), 1U);
}

TEST(LogPlayer, LeavesOutErrorFramesAndCountsWhatTheBusRefused) {
  LogPlayer player({ErrorFrame(1), DataFrame(1, {}), DataFrame(2, {})}, 0);
  LoopMedium medium;
  auto bus = medium.MakeStation();
  medium.SetUp(false);
  EXPECT_EQ(player.Play(10, *bus), 0U);
  EXPECT_EQ(player.refused(), 2U);
  EXPECT_TRUE(player.done());
}

TEST(LogPlayer, RefusesASpeedThatIsNone) {
  EXPECT_THROW(LogPlayer({}, 0, 0.0), std::invalid_argument);
  EXPECT_THROW(LogPlayer({}, 0, -1.0), std::invalid_argument);
}

}  // namespace
}  // namespace mantle::firmware_sim
