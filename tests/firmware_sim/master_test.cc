#include "firmware_sim/master/master.h"

#include <gtest/gtest.h>

#include <cmath>
#include <iostream>
#include <stdexcept>
#include <string>

#include "firmware_sim/bus/bus_load.h"
#include "tests/firmware_sim/frames.h"
#include "tests/firmware_sim/rig.h"

namespace mantle::firmware_sim {
namespace {

constexpr std::int64_t kSecond_us = 1'000'000;
constexpr std::int16_t kTorque_permille = 100;
// The drive's torque resolution and its current loop's settling, far below the 10 % asked for.
constexpr int kTorqueTolerance_permille = 20;

bool AllStates(Rig& rig, DriveState state) {
  for (auto& station : rig.stations) {
    if (station->drive.state() != state) return false;
  }
  return true;
}

TEST(Master, BringsEightDrivesToOperationEnabled) {
  Rig rig(8);
  rig.master.Enable(0);
  ASSERT_TRUE(rig.RunUntilEnabled()) << Describe(rig.master);
  EXPECT_TRUE(AllStates(rig, DriveState::kOperationEnabled));
  EXPECT_LT(rig.now_us, kSecond_us);
  for (std::size_t i = 0; i < 8; ++i) {
    EXPECT_EQ(rig.master.drive(i).identity.device_type, kDeviceType);
    EXPECT_EQ(rig.master.drive(i).problem, DriveProblem::kNone);
    EXPECT_EQ(rig.master.drive(i).reboots, 0U);
  }
}

TEST(Master, ConfiguresSixteenDrives) {
  Rig rig(16);
  rig.master.Enable(0);
  EXPECT_TRUE(rig.RunUntilEnabled()) << Describe(rig.master);
}

TEST(Master, WithoutEnableTheDrivesWaitReadyToSwitchOn) {
  Rig rig(2);
  ASSERT_TRUE(rig.RunUntil([&] { return rig.master.AllIn(DriveStep::kReady); }, kSecond_us));
  rig.Run(kSecond_us);
  EXPECT_TRUE(AllStates(rig, DriveState::kReadyToSwitchOn));
  rig.master.Enable(rig.now_us);
  EXPECT_TRUE(rig.RunUntilEnabled());
}

TEST(Master, EveryCycleBringsEveryTpdoAndTheDrivesFollow) {
  Rig rig(8);
  rig.master.Enable(0);
  ASSERT_TRUE(rig.RunUntilEnabled());
  for (std::size_t i = 0; i < 8; ++i) {
    rig.master.SetTarget(i, {.torque_permille = kTorque_permille});
  }
  rig.Run(kSecond_us / 2);
  for (std::size_t i = 0; i < 8; ++i) {
    EXPECT_NEAR(rig.master.drive(i).torque_permille, kTorque_permille, kTorqueTolerance_permille);
    EXPECT_GT(rig.drive(i).output().tension_n, 0);
    EXPECT_EQ(rig.master.drive(i).tpdo1_late, 0U);
    EXPECT_EQ(rig.master.drive(i).tpdo1_count, rig.master.drive(i).tpdo2_count);
    EXPECT_EQ(rig.master.drive(i).mode_display, 10);
  }
  EXPECT_EQ(rig.master.counters().send_failures, 0U);
}

TEST(Master, FollowsPositionsWhereTheModeIsPosition) {
  MasterOptions options = NodesOneTo(1);
  options.supervisor.settings.mode = OperationMode::kCyclicPosition;
  Rig rig(1, options);
  rig.master.Enable(0);
  ASSERT_TRUE(rig.RunUntilEnabled());
  // Reels in slowly, within the drive's following error.
  std::int32_t target_counts = rig.master.drive(0).position_counts;
  const std::int32_t start_counts = target_counts;
  rig.before_cycle = [&] {
    target_counts += 50;
    rig.master.SetTarget(0, {.position_counts = target_counts});
  };
  rig.Run(kSecond_us);
  EXPECT_EQ(rig.master.drive(0).step, DriveStep::kEnabled) << Describe(rig.master);
  constexpr int kTrackingError_counts = 500;  // a tenth of the way in this second
  EXPECT_NEAR(rig.master.drive(0).position_counts - start_counts, 5000, kTrackingError_counts);
}

TEST(Master, AMissingDriveIsNamedWithItsStepAndTheOthersRun) {
  Rig rig(3, NodesOneTo(4));
  rig.master.Enable(0);
  rig.Run(kSecond_us);
  EXPECT_EQ(rig.master.drive(3).step, DriveStep::kFailed);
  EXPECT_EQ(Describe(rig.master.drive(3)),
            "node 4: failed; no answer to SDO 1000:00 while identifying");
  for (std::size_t i = 0; i < 3; ++i) EXPECT_EQ(rig.master.drive(i).step, DriveStep::kEnabled);
  // It is plugged in later: its boot-up message brings it in.
  rig.AddDrive(4);
  EXPECT_TRUE(rig.RunUntilEnabled());
}

TEST(Master, ADriveThatRebootsIsConfiguredAndEnabledAgain) {
  Rig rig(3);
  rig.master.Enable(0);
  ASSERT_TRUE(rig.RunUntilEnabled());
  rig.master.SetTarget(1, {.torque_permille = kTorque_permille});
  rig.Run(kSecond_us / 5);
  rig.stations[1]->Reboot(rig.now_us);
  rig.Tick();
  rig.Tick();
  EXPECT_NE(rig.master.drive(1).step, DriveStep::kEnabled);
  ASSERT_TRUE(rig.RunUntilEnabled());
  EXPECT_EQ(rig.master.drive(1).reboots, 1U);
  EXPECT_EQ(rig.master.drive(0).reboots, 0U);
  // At rest until somebody gives it a target again.
  rig.Run(kSecond_us / 5);
  EXPECT_NEAR(rig.master.drive(1).torque_permille, 0, kTorqueTolerance_permille);
}

TEST(Master, ARebootWhoseBootUpMessageWasLostIsNoticedByTheHeartbeat) {
  Rig rig(2);
  rig.master.Enable(0);
  ASSERT_TRUE(rig.RunUntilEnabled());
  rig.stations[0]->Reboot(rig.now_us);
  CanFrame boot_up;
  ASSERT_TRUE(rig.drive(0).TakeFrame(boot_up));
  ASSERT_EQ(boot_up.id, CobHeartbeat(1));
  ASSERT_TRUE(rig.RunUntil([&] { return rig.master.drive(0).reboots == 1; }, kSecond_us));
  EXPECT_TRUE(rig.RunUntilEnabled());
}

TEST(Master, AFaultStopsOneDriveAndEnableResetsIt) {
  Rig rig(2);
  rig.master.Enable(0);
  ASSERT_TRUE(rig.RunUntilEnabled());
  rig.drive(0).Disturb(Disturbance::kOverVoltage);
  ASSERT_TRUE(
      rig.RunUntil([&] { return rig.master.drive(0).step == DriveStep::kFaulted; }, kSecond_us));
  rig.Run(kSecond_us / 10);
  EXPECT_EQ(rig.master.drive(0).emcy[0].code, EmcyCode::kOverVoltage);
  EXPECT_NE(Describe(rig.master.drive(0)).find("fault 0x3210 over-voltage while enabled"),
            std::string::npos)
      << Describe(rig.master.drive(0));
  EXPECT_EQ(rig.master.drive(1).step, DriveStep::kEnabled);
  // While the cause lasts it cannot come back ...
  rig.master.Enable(0, rig.now_us);
  rig.Run(3 * kSecond_us);
  EXPECT_EQ(rig.master.drive(0).step, DriveStep::kFaulted);
  EXPECT_NE(rig.drive(0).state(), DriveState::kOperationEnabled);
  // ... then it can.
  rig.drive(0).Disturb(Disturbance::kNone);
  rig.Run(kSecond_us);
  EXPECT_EQ(rig.master.drive(0).step, DriveStep::kFaulted);  // not by itself
  rig.master.Enable(0, rig.now_us);
  EXPECT_TRUE(rig.RunUntilEnabled()) << Describe(rig.master);
  EXPECT_EQ(rig.master.drive(0).emcy[0].code, EmcyCode::kNoError);
  EXPECT_EQ(rig.master.drive(0).emcy[1].code, EmcyCode::kOverVoltage) << "newest first";
  EXPECT_LT(rig.master.drive(0).emcy[1].time_us, rig.master.drive(0).emcy[0].time_us);
}

TEST(Master, ASilentMasterIsForgivenOnlyAfterEnable) {
  Rig rig(3);
  rig.master.Enable(0);
  ASSERT_TRUE(rig.RunUntilEnabled());
  for (std::size_t i = 0; i < 3; ++i) {
    rig.master.SetTarget(i, {.torque_permille = kTorque_permille});
  }
  rig.Run(kSecond_us / 5);
  rig.master_alive = false;
  rig.Run(kSecond_us);
  rig.master_alive = true;
  rig.Run(kSecond_us);
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(rig.master.drive(i).step, DriveStep::kFaulted) << Describe(rig.master.drive(i));
    EXPECT_NE(rig.drive(i).state(), DriveState::kOperationEnabled);
  }
  rig.master.Enable(rig.now_us);
  EXPECT_TRUE(rig.RunUntilEnabled()) << Describe(rig.master);
}

TEST(Master, ADeadDriveIsLostAndComesBackAfterPowerOn) {
  Rig rig(2);
  rig.master.Enable(0);
  ASSERT_TRUE(rig.RunUntilEnabled());
  rig.stations[1]->powered = false;
  ASSERT_TRUE(
      rig.RunUntil([&] { return rig.master.drive(1).step == DriveStep::kLost; }, kSecond_us));
  EXPECT_EQ(Describe(rig.master.drive(1)).substr(0, 12), "node 2: lost");
  EXPECT_GT(rig.master.drive(1).tpdo1_late, 0U);
  rig.stations[1]->powered = true;
  rig.stations[1]->Reboot(rig.now_us);
  EXPECT_TRUE(rig.RunUntilEnabled()) << Describe(rig.master);
}

TEST(Master, StopRampsTheTorqueThenDisablesThenStops) {
  Rig rig(4);
  rig.master.Enable(0);
  ASSERT_TRUE(rig.RunUntilEnabled());
  for (std::size_t i = 0; i < 4; ++i) {
    rig.master.SetTarget(i, {.torque_permille = kTorque_permille});
  }
  rig.Run(kSecond_us);
  ASSERT_GT(rig.drive(0).output().tension_n, 0);
  rig.master.Stop(rig.now_us);
  int ramping = 0;
  ASSERT_TRUE(rig.RunUntil(
      [&] {
        for (std::size_t i = 0; i < 4; ++i) {
          const DriveReport& report = rig.master.drive(i);
          if (report.torque_permille < kTorque_permille / 2) continue;
          EXPECT_EQ(report.step, DriveStep::kStopRamp) << "enabled until the torque is gone";
          ++ramping;
        }
        return rig.master.stopped();
      },
      5 * kSecond_us))
      << Describe(rig.master);
  EXPECT_GT(ramping, 0);
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_EQ(rig.master.drive(i).step, DriveStep::kStopped) << Describe(rig.master.drive(i));
    EXPECT_EQ(rig.drive(i).nmt_state(), NmtState::kStopped);
    EXPECT_EQ(rig.drive(i).state(), DriveState::kSwitchOnDisabled);
    EXPECT_EQ(rig.master.drive(i).emcy_count, 0U);
  }
  rig.master.Enable(rig.now_us);
  EXPECT_TRUE(rig.RunUntilEnabled()) << Describe(rig.master);
}

TEST(Master, StopBeforeAnythingAnsweredEndsToo) {
  Rig rig(0, NodesOneTo(2));
  rig.master.Stop(0);
  EXPECT_TRUE(rig.RunUntil([&] { return rig.master.stopped(); }, 5 * kSecond_us));
}

TEST(Master, TwoDrivesWithOneNodeNumberAreFoundAndTakenDown) {
  Rig rig(3);
  rig.AddDrive(2);
  rig.master.Enable(0);
  rig.Run(5 * kSecond_us);
  EXPECT_EQ(rig.master.drive(1).problem, DriveProblem::kDuplicateNode)
      << Describe(rig.master.drive(1));
  EXPECT_NE(rig.drive(1).state(), DriveState::kOperationEnabled);
  EXPECT_NE(rig.drive(3).state(), DriveState::kOperationEnabled);
  EXPECT_EQ(rig.master.drive(0).step, DriveStep::kEnabled);
  EXPECT_EQ(rig.master.drive(2).step, DriveStep::kEnabled);
}

TEST(Master, TenPercentLossDelayAndReorderingAreSurvived) {
  Rig rig(8, NodesOneTo(8),
          {.loss = 0.1, .reorder = 0.05, .delay_us = 500, .jitter_us = 500, .seed = 4});
  rig.master.Enable(0);
  ASSERT_TRUE(rig.RunUntilEnabled(20 * kSecond_us)) << Describe(rig.master);
  int enabled_ticks = 0;
  constexpr int kTicks = 5000;
  for (int i = 0; i < kTicks; ++i) {
    rig.Tick();
    if (rig.master.enabled()) ++enabled_ticks;
  }
  // A lost heartbeat or RPDO costs nothing: both come several times within their time-outs.
  EXPECT_EQ(enabled_ticks, kTicks) << Describe(rig.master);
  EXPECT_GT(rig.master.drive(0).tpdo1_late, 0U);
}

TEST(Master, ABreakOfTheLinkEndsInFaultNotInStaleTorqueAndIsRecovered) {
  Rig rig(2);
  rig.master.Enable(0);
  ASSERT_TRUE(rig.RunUntilEnabled());
  for (std::size_t i = 0; i < 2; ++i) {
    rig.master.SetTarget(i, {.torque_permille = kTorque_permille});
  }
  rig.Run(kSecond_us / 2);
  rig.medium.SetUp(false);
  rig.Run(2 * kSecond_us);
  for (std::size_t i = 0; i < 2; ++i) EXPECT_EQ(rig.drive(i).state(), DriveState::kFault);
  EXPECT_GT(rig.master.counters().send_failures, 0U);
  rig.medium.SetUp(true);
  rig.Run(kSecond_us);
  EXPECT_FALSE(rig.master.enabled());
  rig.master.Enable(rig.now_us);
  EXPECT_TRUE(rig.RunUntilEnabled()) << Describe(rig.master);
}

TEST(Master, OnAWireOfOneMegabitTheLoadIsThatOfTheHandCount) {
  Rig rig(8, NodesOneTo(8), {}, {.bit_rate = kBitRate});
  rig.master.Enable(0);
  ASSERT_TRUE(rig.RunUntilEnabled()) << Describe(rig.master);
  const std::uint64_t bits_before = rig.medium.bits_carried();
  constexpr int kCycles = 100;
  rig.Run(kCycles * rig.period_us);
  const double bits = static_cast<double>(rig.medium.bits_carried() - bits_before) / kCycles;
  EXPECT_TRUE(rig.master.enabled());
  // Drives beat every 100 ms and the master every 50 ms: between nobody and all every 50 ms.
  EXPECT_GT(bits, LoadOfScene({}).least_bits);
  EXPECT_LT(bits, LoadOfScene({.heartbeat_us = 50'000}).worst_bits);
  std::cout << "measured " << LoadPercent(bits, rig.period_us) << " % of 1 Mbit/s\n";
}

TEST(Master, AWireThatIsTooSlowIsToldByLateAnswersNotByACrash) {
  MasterOptions options = NodesOneTo(8);
  options.supervisor.settings.period_us = 2000;  // 4295 bits do not fit into 2 ms
  Rig rig(8, options, {}, {.bit_rate = kBitRate});
  rig.master.Enable(0);
  rig.Run(3 * kSecond_us);
  std::uint64_t late = 0;
  for (std::size_t i = 0; i < 8; ++i) late += rig.master.drive(i).tpdo1_late;
  EXPECT_GT(late + rig.master.counters().send_failures, 0U);
}

TEST(Master, StaysOutOfTheWayOfForeignAndBrokenFrames) {
  Rig rig(2);
  auto stranger = rig.medium.MakeStation();
  rig.master.Enable(0);
  ASSERT_TRUE(rig.RunUntilEnabled());
  const CanFrame frames[] = {DataFrame(0x181, {0x27}),
                             DataFrame(0x701, {}),
                             DataFrame(0x081, {1}),
                             DataFrame(0x581, {0x80}),
                             DataFrame(0x1B0, {1, 2, 3, 4, 5, 6, 7, 8}),
                             RemoteFrame(0x701, 1),
                             ExtendedFrame(0x701, {0})};
  stranger->Send(frames);
  rig.Run(kSecond_us / 10);
  EXPECT_TRUE(rig.master.enabled());
  EXPECT_EQ(rig.master.drive(0).short_frames, 3U);
  EXPECT_EQ(rig.master.counters().foreign_frames, 1U);
}

TEST(Master, RefusesImpossibleOptionsWithValueAndBound) {
  LoopMedium medium;
  auto bus = medium.MakeStation();
  const auto refusal = [&](const MasterOptions& options) -> std::string {
    try {
      Master master(*bus, options);
    } catch (const std::invalid_argument& error) {
      return error.what();
    }
    return "not refused";
  };
  EXPECT_EQ(refusal({}), "master: number of drives is 0, must be 1 to 16");
  EXPECT_EQ(refusal(NodesOneTo(17)), "master: number of drives is 17, must be 1 to 16");
  EXPECT_EQ(refusal({.nodes = {3, 3}}), "master: node 3 is named twice");
  EXPECT_EQ(refusal({.nodes = {127}}), "master: node is 127, must be 1 to 126");
  MasterOptions options = NodesOneTo(1);
  options.supervisor.settings.master_silence_us = 100'000;
  EXPECT_EQ(refusal(options), "master: master silence is 100000 us, must be 150000 to 65535000");
}

}  // namespace
}  // namespace mantle::firmware_sim
