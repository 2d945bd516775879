#include <gtest/gtest.h>

#include <fstream>

#include "firmware_sim/bus/candump_log.h"
#include "firmware_sim/canopen/canopen.h"
#include "tests/firmware_sim/vcan.h"
#include "tests/tools/program.h"

/// The steering scene on a real vcan (tools/vcan_run), until it has passed its first waypoint.

namespace mantle::testing_tools {
namespace {

using firmware_sim::CanFrame;

const std::string kSteer = "run " + Scene("steer") + " --set time.duration=11";
constexpr double kTolerance_m = 0.0266;                           // 5 % of body length, the scene's
constexpr std::size_t kPeriods = 1100, kFramesPerPeriod = 1 + 5;  // SYNC, five drives' RPDOs

std::vector<CanFrame> ReadLog(const std::filesystem::path& path) {
  std::ifstream in(path);
  return firmware_sim::ReadCandumpLog(in).frames;
}

// What the master says: NMT, SYNC, RPDOs, SDO requests, its heartbeat.
std::vector<CanFrame> Commands(const std::vector<CanFrame>& frames) {
  std::vector<CanFrame> commands;
  for (const CanFrame& f : frames) {
    const std::uint32_t function = f.id & 0x780U;
    const bool ours = f.id == 0x000 || f.id == 0x080 || function == 0x200 || function == 0x300 ||
                      function == 0x600 ||
                      f.id == firmware_sim::CobHeartbeat(firmware_sim::kMasterNode);
    if (ours) commands.push_back(f);
  }
  return commands;
}

bool SameFrame(const CanFrame& a, const CanFrame& b) {
  return a.id == b.id && a.size == b.size &&
         std::equal(a.data.begin(), a.data.begin() + a.size, b.data.begin());
}

TEST(VcanClosedLoop, EveryCommandFrameHasTheBitsOfTheInProcessRun) {
  if (!firmware_sim::HasVcan()) GTEST_SKIP() << "no vcan0: run it through tools/vcan_run";
  const auto folder = FreshFolder("vcan_control");
  const Outcome in_process = Mantle(folder, kSteer + " --out loop --record loop.log");
  ASSERT_EQ(in_process.status, 0) << in_process.err;
  // A bystander sees what really was on the wire, and goes when it has been quiet for 3 s.
  const std::string wire = (folder / "wire.log").string();
  firmware_sim::Process candump({"candump", "-L", "-r", "8388608", "-T", "3000", "vcan0"}, wire);
  const Outcome on_vcan = Mantle(folder, kSteer + " --out vcan --record vcan.log --bus can:vcan0");
  EXPECT_EQ(candump.Wait(), 0);
  ASSERT_EQ(on_vcan.status, 0) << on_vcan.err;

  const auto expected = Commands(ReadLog(folder / "loop.log"));
  const auto seen = Commands(ReadLog(wire));
  ASSERT_GT(expected.size(), kPeriods * kFramesPerPeriod);
  ASSERT_EQ(seen.size(), expected.size());
  for (std::size_t i = 0; i < expected.size(); ++i) {
    ASSERT_TRUE(SameFrame(seen[i], expected[i])) << "command frame " << i;
  }
  EXPECT_EQ(ReadFile(folder / "vcan.log"), ReadFile(folder / "loop.log"));
  EXPECT_EQ(ReadFile(folder / "vcan/trajectory.csv"), ReadFile(folder / "loop/trajectory.csv"));
  const auto waypoint = ReadJson(folder / "vcan/summary.json")["control"]["waypoints"][0];
  EXPECT_TRUE(waypoint["passed"].get<bool>());
  EXPECT_LT(waypoint["distance_m"].get<double>(), kTolerance_m);
  EXPECT_EQ(ReadFile(folder / "vcan/telemetry.lcmlog"), ReadFile(folder / "loop/telemetry.lcmlog"));
}

}  // namespace
}  // namespace mantle::testing_tools
