#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "tests/firmware_sim/drive_bench.h"

/// Faults, the silence watchdog, recovery (drive_supervision.cc).

namespace mantle::firmware_sim {
namespace {

using test::DriveBench;
using test::Frame;
using test::Targets;

Targets Hauling() {
  Targets t;
  t.torque = 400;
  return t;
}

/// Cycles until the drive is in fault, a second at most.
void RunIntoFault(DriveBench& bench, Targets t) {
  t.controlword = controlword::kEnableOperation;
  for (int i = 0; i < 300 && bench.drive.state() != DriveState::kFault; ++i) bench.Run(t, 1);
}

void TryReset(DriveBench& bench, Targets t) {
  t.controlword = 0;
  bench.Run(t, 2);
  t.controlword = controlword::kFaultReset;
  bench.Run(t, 2);
  t.controlword = 0;
  bench.Run(t, 1);
}

struct Cause {
  EmcyCode code;
  Disturbance disturbance;
  std::uint8_t error_register;
};
constexpr Cause kCauses[] = {
    {EmcyCode::kOverCurrent, Disturbance::kWindingShort, 0x03},
    {EmcyCode::kEncoder, Disturbance::kEncoderBroken, 0x21},
    {EmcyCode::kOverVoltage, Disturbance::kOverVoltage, 0x05},
    {EmcyCode::kUnderVoltage, Disturbance::kUnderVoltage, 0x05},
    {EmcyCode::kOverTemperatureDevice, Disturbance::kHotSurroundings, 0x09},
};

TEST(DriveSupervision, EveryDisturbanceFaultsAndResetWaitsForItsEnd) {
  for (const Cause& cause : kCauses) {
    DriveBench bench;
    const Targets t = Hauling();
    bench.Enable(t);
    Targets enabled = t;
    enabled.controlword = controlword::kEnableOperation;
    bench.Run(enabled, 100);
    ASSERT_EQ(bench.drive.state(), DriveState::kOperationEnabled);
    bench.Download(object::kDisturbance, 0, 1, static_cast<std::uint32_t>(cause.disturbance));
    RunIntoFault(bench, t);
    ASSERT_EQ(bench.drive.state(), DriveState::kFault) << Name(cause.code);
    EXPECT_EQ(bench.Emergencies(), (std::vector<EmcyCode>{cause.code})) << Name(cause.code);
    EXPECT_EQ(bench.WithId(CobEmcy(1))[0].data[2], cause.error_register);
    EXPECT_EQ(bench.Number(Slot(0x603F)), static_cast<std::int64_t>(cause.code));
    EXPECT_TRUE(bench.drive.brake_closed());
    EXPECT_EQ(bench.drive.winch().current_a(), 0.0);

    TryReset(bench, t);
    EXPECT_EQ(bench.drive.state(), DriveState::kFault) << "cause lasts: " << Name(cause.code);
    EXPECT_EQ(bench.Emergencies().size(), 1U);

    bench.Download(object::kDisturbance, 0, 1, 0);
    bench.Run(t, 5);
    EXPECT_EQ(bench.drive.state(), DriveState::kFault) << "no reset edge came";
    TryReset(bench, t);
    EXPECT_EQ(bench.drive.state(), DriveState::kSwitchOnDisabled) << Name(cause.code);
    EXPECT_EQ(bench.Emergencies(), (std::vector<EmcyCode>{cause.code, EmcyCode::kNoError}));
    EXPECT_EQ(bench.Number(Slot(0x1001)), 0);
    bench.Enable(t);
    bench.Run(enabled, 20);
    EXPECT_EQ(bench.drive.state(), DriveState::kOperationEnabled) << Name(cause.code);
  }
}

TEST(DriveSupervision, AResetBitHeldHighIsNoEdge) {
  DriveBench bench;
  bench.Enable({});
  bench.drive.Disturb(Disturbance::kEncoderBroken);
  Targets t;
  t.controlword = controlword::kEnableOperation | controlword::kFaultReset;
  bench.Run(t, 100);
  ASSERT_EQ(bench.drive.state(), DriveState::kFault);
  bench.drive.Disturb(Disturbance::kNone);
  bench.Run(t, 100);
  EXPECT_EQ(bench.drive.state(), DriveState::kFault);
}

TEST(DriveSupervision, MotorOverTemperatureComesFromItsOwnHeat) {
  DriveBench bench(DriveConfig{.cable = {0.0, 2000.0, 0.0}});
  bench.Download(0x6072, 0, 2, 2000);
  Targets t;
  t.torque = 2000;
  bench.Enable(t);
  t.controlword = controlword::kEnableOperation;
  bool warned = false;
  int cycles = 0;
  for (; cycles < 30000 && bench.drive.state() == DriveState::kOperationEnabled; ++cycles) {
    bench.Run(t, 1);
    warned = warned || (bench.statusword() & statusword::kWarning) != 0;
  }
  // Twice the rated current heats four times as much: a minute or two.
  EXPECT_TRUE(warned);
  EXPECT_GT(cycles, 300);
  ASSERT_FALSE(bench.Emergencies().empty());
  EXPECT_EQ(bench.Emergencies()[0], EmcyCode::kOverTemperatureMotor);
  RunIntoFault(bench, t);
  TryReset(bench, t);
  EXPECT_EQ(bench.drive.state(), DriveState::kFault);
  t.controlword = 0;
  for (int i = 0; i < 20000 && bench.drive.winch().winding_c() > 99.0; ++i) bench.Run(t, 1);
  TryReset(bench, t);
  EXPECT_EQ(bench.drive.state(), DriveState::kSwitchOnDisabled);
}

TEST(DriveSupervision, FollowingErrorFaultsAndSetsBit13) {
  for (const bool jammed : {true, false}) {
    DriveBench bench;
    Targets t;
    t.mode = 8;
    bench.Enable(t);
    t.controlword = controlword::kEnableOperation;
    bench.Run(t, 5);
    if (jammed) bench.drive.Disturb(Disturbance::kJammed);
    for (int i = 0; i < 60 && bench.drive.state() == DriveState::kOperationEnabled; ++i) {
      t.position += jammed ? 100 : 5000;  // too fast for any motor
      bench.Run(t, 1);
    }
    EXPECT_EQ(bench.Emergencies(), (std::vector<EmcyCode>{EmcyCode::kFollowingError}));
    EXPECT_NE(bench.statusword() & statusword::kFollowingError, 0);
    RunIntoFault(bench, t);
    TryReset(bench, t);
    EXPECT_EQ(bench.drive.state(), DriveState::kSwitchOnDisabled);
    EXPECT_EQ(bench.statusword() & statusword::kFollowingError, 0);
  }
}

TEST(DriveSupervision, FollowingErrorWindowCanBeOpened) {
  DriveBench bench;
  bench.Download(0x6065, 0, 4, 0xFFFFFFFF);
  Targets t;
  t.mode = 8;
  bench.Enable(t);
  bench.drive.Disturb(Disturbance::kJammed);
  t.controlword = controlword::kEnableOperation;
  t.position = 100'000;
  bench.Run(t, 50);
  EXPECT_EQ(bench.drive.state(), DriveState::kOperationEnabled);
}

TEST(DriveSupervision, ShortRpdoIsReportedOnceAndNotProcessed) {
  DriveBench bench;
  bench.Nmt(NmtCommand::kStart);
  for (int i = 0; i < 5; ++i) {
    bench.Send(Frame(0x201, {0x06, 0x00, 0x01}));
    bench.Sync();
  }
  EXPECT_EQ(bench.drive.state(), DriveState::kSwitchOnDisabled);
  EXPECT_EQ(bench.Emergencies(), (std::vector<EmcyCode>{EmcyCode::kPdoLength}));
  EXPECT_EQ(bench.WithId(CobEmcy(1))[0].data,
            (std::array<std::uint8_t, 8>{0x10, 0x82, 0x11, 0, 0, 0, 0, 0}));
  bench.Advance(1000);
  EXPECT_NE(bench.statusword() & statusword::kWarning, 0);
  bench.Run({}, 1);
  EXPECT_EQ(bench.Emergencies(), (std::vector<EmcyCode>{EmcyCode::kPdoLength, EmcyCode::kNoError}));
}

TEST(DriveSupervision, AMasterThatOnlySendsShortRpdosTimesOut) {
  DriveBench bench;
  bench.Enable(Hauling());
  for (int i = 0; i < 50; ++i) {
    bench.Heartbeat();
    bench.Send(Frame(0x201, {0x0F, 0x00, 0x01}));
    bench.Sync();
    bench.Advance(10'000);
  }
  EXPECT_EQ(bench.drive.state(), DriveState::kFault);
  EXPECT_EQ(bench.Emergencies(),
            (std::vector<EmcyCode>{EmcyCode::kPdoLength, EmcyCode::kRpdoTimeout}));
}

TEST(DriveSupervision, MissingRpdoOrSyncFaultsWith8250) {
  for (const bool with_sync : {true, false}) {
    DriveBench bench;
    bench.Enable(Hauling());
    const std::int64_t start_us = bench.now_us;
    std::int64_t reported_us = 0;
    for (int i = 0; i < 60; ++i) {
      bench.Heartbeat();
      if (with_sync) {
        bench.Sync();
      } else {
        bench.Send(Frame(0x201, {0x0F, 0, 0x90, 0x01, 0, 0, 0, 0}));
      }
      bench.Advance(10'000);
      if (reported_us == 0 && !bench.Emergencies().empty()) reported_us = bench.now_us;
    }
    EXPECT_EQ(bench.Emergencies(), (std::vector<EmcyCode>{EmcyCode::kRpdoTimeout}));
    // 100 ms after the last one, which came one cycle before `start_us`.
    EXPECT_LE(reported_us - start_us, 100'000);
    EXPECT_GE(reported_us - start_us, 90'000);
    EXPECT_EQ(bench.drive.state(), DriveState::kFault);
    // The reset's own RPDO is not yet at SYNC when nothing else comes: both must be back.
    TryReset(bench, {});
    EXPECT_EQ(bench.drive.state(), DriveState::kSwitchOnDisabled);
  }
}

TEST(DriveSupervision, AnSdoCannotResetAnRpdoTimeoutWhileRpdosStayAway) {
  DriveBench bench;
  bench.Enable({});
  for (int i = 0; i < 30; ++i) {
    bench.Heartbeat();
    bench.Advance(10'000);
  }
  ASSERT_EQ(bench.drive.state(), DriveState::kFault);
  bench.Download(0x6040, 0, 2, 0x00);
  bench.Download(0x6040, 0, 2, 0x80);
  EXPECT_EQ(bench.drive.state(), DriveState::kFault);
}

TEST(DriveSupervision, PreOperationalWhileEnabledIsAMissingRpdo) {
  DriveBench bench;
  bench.Enable(Hauling());
  bench.Nmt(NmtCommand::kPreOperational);
  bench.Run(Hauling(), 30);
  EXPECT_EQ(bench.drive.state(), DriveState::kFault);
  EXPECT_EQ(bench.Emergencies(), (std::vector<EmcyCode>{EmcyCode::kRpdoTimeout}));
}

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

TEST(DriveSupervision, SilentMasterHundredOfHundredWithSyncContinuing) {
  std::mt19937 random(8130);
  std::uniform_int_distribution<int> phase(0, 9'999);
  for (int i = 0; i < 100; ++i) {
    SCOPED_TRACE(i);
    SilenceIsSurvived(phase(random), true, i % 2 == 0 ? 200 : 55);
    if (HasFatalFailure() || HasNonfatalFailure()) return;
  }
}

TEST(DriveSupervision, SilentMasterHundredOfHundredWithSyncStopped) {
  std::mt19937 random(8250);
  std::uniform_int_distribution<int> phase(0, 9'999);
  for (int i = 0; i < 100; ++i) {
    SCOPED_TRACE(i);
    SilenceIsSurvived(phase(random), false, i % 2 == 0 ? 200 : 55);
    if (HasFatalFailure() || HasNonfatalFailure()) return;
  }
}

TEST(DriveSupervision, NmtStopLetsGoWithoutEmergencyAndStaysStopped) {
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

TEST(DriveSupervision, NmtResetRampsThenBoots) {
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
