#include "loop/pacer.h"

#include <gtest/gtest.h>

#include "firmware_sim/bus/socket_time.h"

namespace mantle::loop {
namespace {

using firmware_sim::MonotonicTime_us;
using firmware_sim::SleepFor;

constexpr std::int64_t kPeriod_us = 5'000;

TEST(Pacer, TurnsNeverBeginEarly) {
  Pacer pacer(kPeriod_us);
  pacer.WaitForTurn();
  const std::int64_t start_us = MonotonicTime_us();
  for (int k = 1; k <= 20; ++k) {
    pacer.WaitForTurn();
    // The first turn's own reading of the clock lies before `start_us`, by the call's time.
    constexpr std::int64_t kCall_us = 1'000;
    EXPECT_GE(MonotonicTime_us() - start_us, k * kPeriod_us - kCall_us);
  }
  EXPECT_EQ(pacer.turns(), 21);
}

TEST(Pacer, ALateTurnIsCountedAndTheNextOnesKeepTheirTimes) {
  Pacer pacer(kPeriod_us);
  pacer.WaitForTurn();
  const std::int64_t start_us = MonotonicTime_us();
  SleepFor(4 * kPeriod_us);
  pacer.WaitForTurn();
  EXPECT_GE(pacer.late_turns(), 1);
  EXPECT_GE(pacer.worst_lateness_us(), 3 * kPeriod_us - 1'000);
  // Turns 2 to 4 are overdue and begin at once; a turn that lies ahead is waited for.
  for (int k = 2; k <= 40; ++k) pacer.WaitForTurn();
  EXPECT_GE(MonotonicTime_us() - start_us, 40 * kPeriod_us - 1'000);
}

}  // namespace
}  // namespace mantle::loop
