#include <gtest/gtest.h>

#include <cmath>

#include "tests/firmware_sim/drive_bench.h"

/// Faults and recovery (drive_supervision.cc).

namespace mantle::firmware_sim {
namespace {

using test::DriveBench;
using test::Frame;
using test::Hauling;
using test::Targets;
using test::TryReset;

/// Cycles until the drive is in fault, a second at most.
void RunIntoFault(DriveBench& bench, Targets t) {
  t.controlword = controlword::kEnableOperation;
  for (int i = 0; i < 300 && bench.drive.state() != DriveState::kFault; ++i) bench.Run(t, 1);
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

TEST(DriveSupervision, SupplyIsWatchedAtItsBounds) {
  const PowerStageData stage;
  constexpr double kMargin_v = 0.01;
  const std::pair<double, EmcyCode> cases[] = {
      {stage.under_voltage_v + kMargin_v, EmcyCode::kNoError},
      {stage.under_voltage_v - kMargin_v, EmcyCode::kUnderVoltage},
      {stage.over_voltage_v - kMargin_v, EmcyCode::kNoError},
      {stage.over_voltage_v + kMargin_v, EmcyCode::kOverVoltage},
  };
  for (const auto& [supply_v, code] : cases) {
    DriveBench bench;
    bench.Enable({});
    bench.drive.SetSupply(supply_v);
    bench.Advance(2'000);
    if (code == EmcyCode::kNoError) {
      EXPECT_EQ(bench.drive.state(), DriveState::kOperationEnabled) << supply_v;
    } else {
      EXPECT_EQ(bench.Emergencies(), (std::vector<EmcyCode>{code})) << supply_v;
    }
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
  for (int i = 0; i < 100; ++i) {
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
    for (int i = 0; i < 100; ++i) {
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
  for (int i = 0; i < 100; ++i) {
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
  bench.Run(Hauling(), 100);
  EXPECT_EQ(bench.drive.state(), DriveState::kFault);
  EXPECT_EQ(bench.Emergencies(), (std::vector<EmcyCode>{EmcyCode::kRpdoTimeout}));
}

}  // namespace
}  // namespace mantle::firmware_sim
