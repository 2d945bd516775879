#include <gtest/gtest.h>

#include "tests/firmware_sim/drive_bench.h"
#include "tests/support/allocation_counter.h"

/// The cyclic path of a drive allocates nothing: every call of the allocator is counted.

namespace mantle::firmware_sim {
namespace {

using test::Frame;

TEST(NoAllocation, TheCounterCounts) {
  const long before = tests::allocation_count;
  int* volatile memory = new int(3);  // volatile: not optimised away
  delete memory;
  EXPECT_EQ(tests::allocation_count, before + 1);
}

TEST(NoAllocation, CyclesFaultsSdoAndResets) {
  Drive drive({}, 0);
  CanFrame out;
  long long frames = 0;
  std::int64_t now_us = 0;
  const CanFrame start = Frame(0x000, {1, 0});
  const CanFrame reset = Frame(0x000, {129, 0});
  const CanFrame sync = Frame(0x080, {});
  const CanFrame heartbeat = Frame(0x77F, {5});
  const CanFrame upload = Frame(0x601, {0x40, 0x41, 0x60, 0, 0, 0, 0, 0});
  const CanFrame bad = Frame(0x601, {0x40, 0x42, 0x60, 0, 0, 0, 0, 0});
  const CanFrame remap = Frame(0x601, {0x23, 0x00, 0x18, 1, 0x81, 1, 0, 0x80});
  CanFrame target = Frame(0x201, {0, 0, 100, 0, 0, 0, 0, 0});
  const long before = tests::allocation_count;
  drive.OnFrame(start, now_us);
  for (int cycle = 0; cycle < 500; ++cycle) {
    target.data[0] = static_cast<std::uint8_t>(cycle < 2 ? 6 : cycle < 4 ? 7 : 15);
    drive.OnFrame(heartbeat, now_us);
    drive.OnFrame(target, now_us);
    drive.OnFrame(sync, now_us);
    drive.OnFrame(upload, now_us);
    drive.OnFrame(bad, now_us);
    now_us += 10'000;
    drive.AdvanceTo(now_us);
    if (cycle == 200) drive.Disturb(Disturbance::kEncoderBroken);
    if (cycle == 300) drive.OnFrame(reset, now_us);
    if (cycle == 400) drive.OnFrame(remap, now_us);
    while (drive.TakeFrame(out)) ++frames;
  }
  EXPECT_EQ(tests::allocation_count, before);
  EXPECT_GT(frames, 1000);
}

}  // namespace
}  // namespace mantle::firmware_sim
