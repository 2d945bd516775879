#include "tools/mantle/run_checkpoint.h"

#include <gtest/gtest.h>

#include "tests/support/paths.h"
#include "tests/tools/program.h"
#include "tools/mantle/bad_input.h"

namespace mantle::testing_tools {
namespace {

namespace fs = std::filesystem;
using namespace tools;

constexpr std::uint64_t kFingerprint = 0x0123456789ABCDEF;

RunCheckpoint Sample() {
  RunCheckpoint c;
  c.fingerprint = kFingerprint;
  c.trajectory_bytes = 9;
  c.trajectory_hash = scene::Hash("time_s\n0\n");
  c.shape_every = 2;
  c.log_bytes = 5;
  c.log_hash = scene::Hash("event");
  c.volume = {0.1, 0.09, 0.12, true};
  c.simulation = "rod 3\n0.25 1e-3\n";
  return c;
}

bool IsRefused(const std::string& text) {
  try {
    ParseCheckpoint(text, "the/checkpoint", kFingerprint);
  } catch (const BadInput& error) {
    EXPECT_NE(std::string(error.what()).find("the/checkpoint"), std::string::npos);
    return true;
  }
  return false;
}

TEST(RunCheckpoint, IsReadBackAsItWasWritten) {
  const fs::path file = FreshFolder("checkpoint_back") / "checkpoint";
  std::ofstream(file, std::ios::binary) << CheckpointText(Sample());
  const RunCheckpoint c = ReadCheckpoint(file, kFingerprint);
  EXPECT_EQ(c.trajectory_bytes, 9);
  EXPECT_EQ(c.trajectory_hash, Sample().trajectory_hash);
  EXPECT_EQ(c.shape_every, 2);
  EXPECT_EQ(c.log_bytes, 5);
  EXPECT_EQ(c.log_hash, Sample().log_hash);
  EXPECT_EQ(c.volume.min_m3, 0.09);
  EXPECT_TRUE(c.volume.started);
  EXPECT_EQ(c.simulation, Sample().simulation);
  EXPECT_THROW(ReadCheckpoint(file, kFingerprint + 1), BadInput);
}

TEST(RunCheckpoint, EveryChangedByteEveryTruncationAndEveryAddedByteIsRefused) {
  const std::string whole = CheckpointText(Sample());
  ASSERT_FALSE(IsRefused(whole));
  for (std::size_t at = 0; at < whole.size(); ++at) {
    for (int flip = 1; flip < 256; ++flip) {
      std::string text = whole;
      text[at] = static_cast<char>(text[at] ^ flip);
      ASSERT_TRUE(IsRefused(text)) << "byte " << at << " xor " << flip;
    }
    ASSERT_TRUE(IsRefused(whole.substr(0, at))) << "cut to " << at << " bytes";
    ASSERT_TRUE(IsRefused(std::string(whole).insert(at, 1, '0'))) << "a byte more at " << at;
    ASSERT_TRUE(IsRefused(std::string(whole).erase(at, 1))) << "a byte less at " << at;
  }
}

TEST(RunCheckpoint, GoesOnOnlyWithItsOwnTrajectory) {
  const auto folder = FreshFolder("checkpoint_trajectory");
  const auto before = [&](const std::string& trajectory) {
    std::ofstream(folder / "trajectory.csv", std::ios::binary) << trajectory;
    return TrajectoryBefore(folder / "checkpoint", Sample());
  };
  EXPECT_EQ(before("time_s\n0\n"), "time_s\n0\n");
  EXPECT_EQ(before("time_s\n0\n0.1\n"), "time_s\n0\n") << "rows after the checkpoint do not count";
  EXPECT_THROW(before("time_s\n1\n0.1\n"), BadInput);
  EXPECT_THROW(before("time_s\n"), BadInput);
  fs::remove(folder / "trajectory.csv");
  EXPECT_THROW(TrajectoryBefore(folder / "checkpoint", Sample()), BadInput);
}

TEST(RunCheckpoint, GoesOnOnlyWithItsOwnLog) {
  const auto folder = FreshFolder("checkpoint_log");
  const auto before = [&](const std::string& log) {
    std::ofstream(folder / "telemetry.lcmlog", std::ios::binary) << log;
    return LogBefore(folder / "checkpoint", Sample());
  };
  EXPECT_EQ(before("event"), "event");
  EXPECT_EQ(before("event, and more"), "event");
  EXPECT_THROW(before("evens"), BadInput);
  EXPECT_THROW(before("even"), BadInput);
  RunCheckpoint without = Sample();
  without.shape_every = 0;
  EXPECT_EQ(LogBefore(folder / "nowhere" / "checkpoint", without), "");
}

TEST(RunCheckpoint, BelongsToEveryFileThatTheSceneReads) {
  const auto folder = FreshFolder("checkpoint_files");
  const auto put = [&](const char* name, const std::string& text) {
    std::ofstream(folder / name) << text;
  };
  std::string robot = ReadFile(tests::SourcePath("scenes/arm_dynamic.toml"));
  const std::string schedule = "{ type = \"intervals\", on = [0], off = [1.5] }";
  ASSERT_NE(robot.find(schedule), std::string::npos);
  robot.replace(robot.find(schedule), schedule.size(), "{ type = \"table\", file = \"pull.csv\" }");
  put("robot.toml", robot);
  const std::string base = "extends = \"robot.toml\"\n[time]\nduration = 0.1\n";
  put("middle.toml", base);
  put("scene.toml", "extends = \"middle.toml\"\n");
  put("pull.csv", "0,0\n0.1,1\n");
  const std::string run = "run scene.toml --out out ";
  const Outcome stopped = Mantle(folder, run + "--stop-at 0.03");
  ASSERT_EQ(stopped.status, 0) << stopped.err;
  const fs::path kept = folder / "kept";
  fs::create_directory(kept);
  for (const char* name : {"checkpoint", "trajectory.csv", "telemetry.lcmlog"}) {
    fs::copy_file(folder / "out.partial" / name, kept / name);
  }
  const auto expect_refused = [&](const char* what) {
    const Outcome outcome = Mantle(folder, run + "--resume kept/checkpoint");
    EXPECT_EQ(outcome.status, 2) << what << outcome.err;
    EXPECT_NE(outcome.err.find("a file that it reads or its --set have changed"), std::string::npos)
        << what << outcome.err;
  };
  put("middle.toml", base + "[output]\ninterval = 0.02\n");
  expect_refused("in what it extends");
  put("middle.toml", base);
  put("pull.csv", "0,0\n0.1,2\n");
  expect_refused("in a table's file");
  put("pull.csv", "0,0\n0.1,1\n");
  put("middle.toml", "# only a comment\n" + base);
  const Outcome resumed = Mantle(folder, run + "--resume kept/checkpoint");
  EXPECT_EQ(resumed.status, 0) << resumed.err;
}

}  // namespace
}  // namespace mantle::testing_tools
