#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "tests/firmware_sim/drive_bench.h"

/// The silence watchdog, and what NMT stop and reset do to a drive that hauls
/// (drive_supervision.cc, drive_commands.cc).

namespace mantle::firmware_sim {
namespace {

using test::DriveBench;
using test::Hauling;
using test::Targets;
using test::TryReset;

/// One silence: where in the cycle it begins, whether SYNC and RPDOs go on without the master's
/// heartbeat.
void SilenceIsSurvived(int phase_us, bool sync_continues, std::uint32_t consumer_ms) {
  DriveBench bench;
  bench.Download(0x1016, 1, 4, kMasterNode << 16U | consumer_ms);
  Targets t = Hauling();
  bench.Enable(t);
  t.controlword = controlword::kEnableOperation;
  bench.Run(t, 60);
  bench.Advance(phase_us % 10'000);
  bench.Heartbeat();
  const std::int64_t silent_us = bench.now_us;
  bench.Advance(phase_us % 1'000);
  ASSERT_EQ(bench.drive.state(), DriveState::kOperationEnabled);
  const double last_torque = bench.drive.demanded_torque();
  ASSERT_EQ(last_torque, 400.0);

  std::int64_t reported_us = 0;
  double before = last_torque;
  bool has_been_zero = false;
  for (int i = 0; i < 300; ++i) {
    if (sync_continues) bench.SendTargets(t);
    for (int ms = 0; ms < 10; ++ms) {
      bench.Advance(1'000);
      const double now = bench.drive.demanded_torque();
      EXPECT_LE(before - now, 10.0 + 150.0 * has_been_zero) << "steeper than 6087";
      has_been_zero = has_been_zero || now <= 0.0;
      EXPECT_TRUE(!has_been_zero || now <= 0.0) << "torque came back";
      before = now;
      const auto codes = bench.Emergencies();
      const bool reported =
          std::find(codes.begin(), codes.end(), EmcyCode::kHeartbeatLost) != codes.end();
      if (reported && reported_us == 0) reported_us = bench.now_us;
    }
    if (reported_us != 0 && bench.drive.state() == DriveState::kFault) break;
  }
  bench.Advance(1'000);
  EXPECT_NE(reported_us, 0);
  // The time in 1016 plus one SYNC period.
  EXPECT_LE(reported_us - silent_us, 1000 * consumer_ms + DriveBench::kCycle_us);
  EXPECT_EQ(bench.drive.state(), DriveState::kFault);
  EXPECT_EQ(bench.drive.nmt_state(), NmtState::kPreOperational);
  EXPECT_TRUE(bench.drive.brake_closed());
  EXPECT_LT(bench.drive.winch().tension_n(), WinchData{}.slack_tension_n);
  EXPECT_EQ(bench.drive.winch().current_a(), 0.0);

  // Each of the three alone does not bring it back.
  const auto reset_by_sdo = [&] {
    bench.Download(0x6040, 0, 2, 0x00);
    bench.Download(0x6040, 0, 2, 0x80);
  };
  reset_by_sdo();
  EXPECT_EQ(bench.drive.state(), DriveState::kFault) << "no heartbeat, no start";
  bench.Heartbeat();
  reset_by_sdo();
  EXPECT_EQ(bench.drive.state(), DriveState::kFault) << "no start";
  bench.Nmt(NmtCommand::kStart);
  bench.Run(t, 5);
  EXPECT_EQ(bench.drive.state(), DriveState::kFault) << "no edge";
  TryReset(bench, t);
  EXPECT_EQ(bench.drive.state(), DriveState::kSwitchOnDisabled);
  EXPECT_EQ(bench.Emergencies().back(), EmcyCode::kNoError);
}

TEST(DriveWatchdog, SilentMasterHundredOfHundredWithSyncContinuing) {
  std::mt19937 random(8130);
  std::uniform_int_distribution<int> phase(0, 9'999);
  for (int i = 0; i < 100; ++i) {
    SCOPED_TRACE(i);
    SilenceIsSurvived(phase(random), true, i % 2 == 0 ? 200 : 55);
    if (HasFatalFailure() || HasNonfatalFailure()) return;
  }
}

TEST(DriveWatchdog, SilentMasterHundredOfHundredWithSyncStopped) {
  std::mt19937 random(8250);
  std::uniform_int_distribution<int> phase(0, 9'999);
  for (int i = 0; i < 100; ++i) {
    SCOPED_TRACE(i);
    SilenceIsSurvived(phase(random), false, i % 2 == 0 ? 200 : 55);
    if (HasFatalFailure() || HasNonfatalFailure()) return;
  }
}

TEST(DriveWatchdog, NmtStopLetsGoWithoutEmergencyAndStaysStopped) {
  DriveBench bench;
  Targets t = Hauling();
  bench.Enable(t);
  t.controlword = controlword::kEnableOperation;
  bench.Run(t, 100);
  bench.Nmt(NmtCommand::kStop);
  bench.Advance(20'000);
  EXPECT_NEAR(bench.drive.demanded_torque(), 200.0, 11.0);  // half of the ramp of 40 ms
  for (int i = 0; i < 100; ++i) {
    bench.Heartbeat();
    bench.Sync();
    bench.Advance(10'000);
  }
  EXPECT_TRUE(bench.Emergencies().empty());
  EXPECT_EQ(bench.drive.nmt_state(), NmtState::kStopped);
  EXPECT_EQ(bench.drive.state(), DriveState::kSwitchOnDisabled);
  EXPECT_TRUE(bench.drive.brake_closed());
  EXPECT_LT(bench.drive.winch().tension_n(), WinchData{}.slack_tension_n);
}

TEST(DriveWatchdog, NmtResetRampsThenBoots) {
  for (const NmtCommand command : {NmtCommand::kResetNode, NmtCommand::kResetCommunication}) {
    DriveBench bench;
    Targets t = Hauling();
    bench.Enable(t);
    t.controlword = controlword::kEnableOperation;
    bench.Run(t, 100);
    bench.frames.clear();
    bench.Nmt(command);
    bench.Advance(30'000);
    EXPECT_TRUE(bench.frames.empty()) << "deaf and mute while the torque ramps";
    EXPECT_NEAR(bench.drive.demanded_torque(), 100.0, 11.0);
    bench.Advance(20'000);
    ASSERT_EQ(bench.frames.size(), 1U);
    EXPECT_EQ(bench.frames[0].id, 0x701U);
    EXPECT_EQ(bench.frames[0].data[0], 0);
    EXPECT_LE(bench.drive.demanded_torque(), 0.0);
    bench.Advance(3'000'000);
    EXPECT_TRUE(bench.drive.brake_closed());
    EXPECT_LT(bench.drive.winch().tension_n(), WinchData{}.slack_tension_n);
    EXPECT_EQ(bench.drive.state(), DriveState::kSwitchOnDisabled);
    EXPECT_TRUE(bench.Emergencies().empty());
  }
}

}  // namespace
}  // namespace mantle::firmware_sim
