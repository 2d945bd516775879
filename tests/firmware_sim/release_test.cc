#include "firmware_sim/drive/release.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/firmware_sim/drive_bench.h"

namespace mantle::firmware_sim {
namespace {

using test::DriveBench;
using test::Targets;

/// Taut with 400 thousandths of torque: some 0.95 N.
DriveBench Hauling(int mode = 10) {
  DriveBench bench;
  Targets t;
  t.torque = 400;
  bench.Enable(t);
  t.controlword = controlword::kEnableOperation;
  bench.Run(t, 150);
  if (mode != 10) {
    t.mode = static_cast<std::int8_t>(mode);
    t.position = static_cast<std::int32_t>(bench.Number(Slot(0x6064)));
    bench.Run(t, 20);
  }
  return bench;
}

Targets Word(std::uint16_t word, std::int16_t torque = 400, std::int8_t mode = 10) {
  Targets t;
  t.controlword = word;
  t.torque = torque;
  t.mode = mode;
  return t;
}

struct Course {
  double ramp_s{-1.0};        ///< until the demanded torque was zero
  double released_s{-1.0};    ///< until the brake closed
  double steepest{0.0};       ///< fall of the demanded torque per millisecond
  double highest_after{0.0};  ///< demanded torque after it had been zero
  double tension_n{0.0};      ///< when the brake closed
  bool brake_on_taut{false};
};

/// What happens over `limit_s` without a word from anybody.
Course Watch(DriveBench& bench, double limit_s = 4.0) {
  Course course;
  double before = bench.drive.demanded_torque();
  for (int ms = 1; ms <= static_cast<int>(limit_s * 1000.0); ++ms) {
    bench.Advance(1000);
    const double now = bench.drive.demanded_torque();
    if (course.ramp_s < 0.0) {
      course.steepest = std::max(course.steepest, before - now);
      if (now <= 0.0) course.ramp_s = 1e-3 * ms;
    } else {
      course.highest_after = std::max(course.highest_after, now);
    }
    before = now;
    if (bench.drive.brake_closed()) {
      course.released_s = 1e-3 * ms;
      course.tension_n = bench.drive.winch().tension_n();
      course.brake_on_taut = course.tension_n >= WinchData{}.slack_tension_n;
      break;
    }
  }
  return course;
}

void ExpectLetGo(const Course& course) {
  EXPECT_GT(course.released_s, 0.0);
  EXPECT_FALSE(course.brake_on_taut) << course.tension_n;
  EXPECT_LE(course.highest_after, 0.0);
}

TEST(Release, DisableOperationAndShutdownRampPayOutAndBrake) {
  for (const std::uint16_t word : {controlword::kSwitchOn, controlword::kShutdown}) {
    DriveBench bench = Hauling();
    bench.SendTargets(Word(word));
    EXPECT_EQ(bench.drive.state(), word == controlword::kSwitchOn ? DriveState::kSwitchedOn
                                                                  : DriveState::kReadyToSwitchOn);
    const Course course = Watch(bench);
    ExpectLetGo(course);
    // 6087 is 10000 a second: 400 take 40 ms, ten a millisecond.
    EXPECT_NEAR(course.ramp_s, 0.040, 0.0021);
    EXPECT_NEAR(course.steepest, 10.0, 1e-9);
  }
}

TEST(Release, DisableVoltageOpensTheWindingAtOnce) {
  DriveBench bench = Hauling();
  bench.SendTargets(Word(controlword::kDisableVoltage));
  EXPECT_EQ(bench.drive.state(), DriveState::kSwitchOnDisabled);
  bench.Advance(2000);
  EXPECT_EQ(bench.drive.demanded_torque(), 0.0);
  EXPECT_EQ(bench.drive.winch().current_a(), 0.0);
  EXPECT_FALSE(bench.drive.brake_closed());
  const Course course = Watch(bench);
  EXPECT_LT(course.tension_n, 0.12);  // what stiction holds is left to the time-out
}

TEST(Release, QuickStopInTorqueModeRampsByTheSlope) {
  for (const std::uint32_t option : {1U, 2U}) {
    DriveBench bench = Hauling();
    bench.Download(0x605A, 0, 2, option);
    bench.SendTargets(Word(controlword::kQuickStop));
    EXPECT_EQ(bench.drive.state(), DriveState::kQuickStopActive);
    const Course course = Watch(bench, 0.1);
    const DriveState state_after_ramp = bench.drive.state();
    ExpectLetGo(Watch(bench));
    EXPECT_NEAR(course.ramp_s, 0.040, 0.0021);
    EXPECT_EQ(state_after_ramp, DriveState::kSwitchOnDisabled);  // transition 12 by itself
  }
}

TEST(Release, QuickStopZeroDisablesAtOnceAndThreeCutsTheTorque) {
  DriveBench zero = Hauling();
  zero.Download(0x605A, 0, 2, 0);
  zero.SendTargets(Word(controlword::kQuickStop));
  EXPECT_EQ(zero.drive.state(), DriveState::kSwitchOnDisabled);
  zero.Advance(2000);
  EXPECT_EQ(zero.drive.winch().current_a(), 0.0);

  DriveBench three = Hauling();
  three.Download(0x605A, 0, 2, 3);
  three.SendTargets(Word(controlword::kQuickStop));
  EXPECT_EQ(three.drive.state(), DriveState::kQuickStopActive);
  const Course course = Watch(three, 0.1);
  EXPECT_LE(course.ramp_s, 0.002);
  EXPECT_EQ(three.drive.state(), DriveState::kSwitchOnDisabled);
  ExpectLetGo(Watch(three));
}

TEST(Release, QuickStopFiveToEightStaysAndComesBack) {
  for (const std::uint32_t option : {5U, 6U, 7U, 8U}) {
    DriveBench bench = Hauling();
    bench.Download(0x605A, 0, 2, option);
    bench.Run(Word(controlword::kQuickStop), 50);
    EXPECT_EQ(bench.drive.state(), DriveState::kQuickStopActive) << option;
    EXPECT_EQ(bench.drive.demanded_torque(), 0.0);
    EXPECT_FALSE(bench.drive.brake_closed());
    bench.Run(Word(controlword::kEnableOperation), 1);
    EXPECT_EQ(bench.drive.state(), DriveState::kOperationEnabled);
  }
}

TEST(Release, QuickStopInVelocityModeStopsBeforeItLetsGo) {
  for (const auto& [option, deceleration] : {std::pair{1U, 50000.0}, std::pair{2U, 100000.0}}) {
    DriveBench bench(DriveConfig{.cable = {0.0, 0.0, 0.0}});
    bench.Download(0x605A, 0, 2, option);
    bench.Download(0x6084, 0, 4, 50000);
    bench.Download(0x6085, 0, 4, 100000);
    Targets t;
    t.mode = 9;
    t.velocity = 20000;
    bench.Enable(t);
    t.controlword = controlword::kEnableOperation;
    bench.Run(t, 50);
    const auto start = static_cast<double>(bench.Number(Slot(0x6064)));
    t.controlword = controlword::kQuickStop;
    bench.Run(t, 60);
    EXPECT_EQ(bench.drive.state(), DriveState::kSwitchOnDisabled);
    const auto stop = static_cast<double>(bench.Number(Slot(0x6064)));
    EXPECT_NEAR(stop - start, 0.5 * 20000.0 * 20000.0 / deceleration, 260.0);
    ExpectLetGo(Watch(bench));
    const auto rest = static_cast<double>(bench.Number(Slot(0x6064)));
    EXPECT_NEAR(rest, stop, 2.0);  // a cable that is slack is not paid out
  }
}

TEST(Release, FaultReactionFollows605E) {
  for (const std::uint32_t option : {0U, 1U, 2U}) {
    DriveBench bench = Hauling();
    bench.Download(0x605E, 0, 2, option);
    bench.drive.SetAmbient(90.0);
    bench.Advance(1000);
    EXPECT_EQ(bench.drive.state(), DriveState::kFaultReactionActive);
    const Course course = Watch(bench);
    EXPECT_GT(course.released_s, 0.0);
    EXPECT_LE(course.highest_after, 0.0);
    if (option == 0) {
      EXPECT_LE(course.ramp_s, 0.002);
    } else {
      EXPECT_NEAR(course.ramp_s, 0.040, 0.003) << option;
      EXPECT_FALSE(course.brake_on_taut);
    }
    EXPECT_EQ(bench.drive.state(), DriveState::kFault);
  }
}

TEST(Release, FromPositionAndVelocityModeTheTorqueRampsToo) {
  for (const int mode : {8, 9}) {
    DriveBench bench = Hauling(mode);
    ASSERT_GT(bench.drive.demanded_torque(), 200.0);
    bench.drive.SetAmbient(90.0);
    const Course course = Watch(bench);
    ExpectLetGo(course);
    EXPECT_LE(course.steepest, 40.0);
    EXPECT_EQ(bench.drive.state(), DriveState::kFault);
  }
}

TEST(Release, WithoutAnEncoderItPaysOutBlindly) {
  DriveBench bench = Hauling();
  bench.drive.Disturb(Disturbance::kEncoderBroken);
  const Course course = Watch(bench);
  ExpectLetGo(course);
  EXPECT_NEAR(course.ramp_s, 0.040, 0.003);
}

TEST(Release, ACableThatNeverGoesSlackEndsInTheTimeout) {
  DriveBench bench(DriveConfig{.cable = {0.5, 0.0, 0.0}});
  Targets t;
  t.torque = 400;
  bench.Enable(t);
  bench.drive.SetAmbient(90.0);
  const Course course = Watch(bench, 6.0);
  EXPECT_NEAR(course.released_s, 1e-6 * kPayOutTimeout_us, 0.05);
  EXPECT_TRUE(bench.drive.brake_closed());
  EXPECT_EQ(bench.drive.state(), DriveState::kFault);
}

TEST(Release, HoweverFlatTheSlopeTheTorqueIsGoneAfterASecond) {
  for (const bool by_quick_stop : {false, true}) {
    DriveBench bench = Hauling();
    bench.Download(0x6087, 0, 4, 1);  // 400 would take 400 s
    if (by_quick_stop) {
      bench.SendTargets(Word(controlword::kQuickStop));
      for (int i = 0; i < 105; ++i) bench.Run(Word(controlword::kQuickStop), 1);
      EXPECT_EQ(bench.drive.state(), DriveState::kSwitchOnDisabled);
    } else {
      bench.drive.SetAmbient(90.0);
    }
    const Course course = Watch(bench);
    ExpectLetGo(course);
    EXPECT_LE(course.ramp_s, 1.01);
    EXPECT_TRUE(bench.drive.brake_closed());
  }
}

TEST(Release, ASecondFaultDoesNotHoldItUp) {
  DriveBench bench = Hauling();
  bench.drive.SetAmbient(90.0);
  bench.Advance(20'000);
  bench.drive.Disturb(Disturbance::kOverVoltage);
  bench.Advance(2'000);
  EXPECT_EQ(bench.drive.winch().current_a(), 0.0);  // the stage must not be used any more
  Watch(bench);
  EXPECT_TRUE(bench.drive.brake_closed());
  EXPECT_EQ(bench.drive.state(), DriveState::kFault);
}

TEST(Release, EnablingAgainTakesOver) {
  DriveBench bench = Hauling();
  bench.SendTargets(Word(controlword::kSwitchOn));
  bench.Advance(50'000);
  bench.Run(Word(controlword::kEnableOperation), 100);
  EXPECT_EQ(bench.drive.state(), DriveState::kOperationEnabled);
  EXPECT_FALSE(bench.drive.brake_closed());
  EXPECT_NEAR(static_cast<double>(bench.Number(Slot(0x6077))), 400.0, 1.0);
}

}  // namespace
}  // namespace mantle::firmware_sim
