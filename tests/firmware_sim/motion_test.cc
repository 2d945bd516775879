#include "firmware_sim/drive/motion.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/firmware_sim/drive_bench.h"

namespace mantle::firmware_sim {
namespace {

using test::DriveBench;
using test::Targets;

/// A drum without a cable: what the motor does alone.
DriveConfig NoCable() {
  DriveConfig config;
  config.cable = {0.0, 0.0, 0.0};
  return config;
}
/// A cable already taut: tension grows from the first count.
DriveConfig TautCable() {
  DriveConfig config;
  config.cable = {0.0, 500.0, 0.0};
  return config;
}

Targets Enabled(int mode) {
  Targets t;
  t.mode = static_cast<std::int8_t>(mode);
  t.controlword = controlword::kEnableOperation;
  return t;
}

TEST(Motion, TorqueModeGivesTheTorqueAsked) {
  DriveBench bench(TautCable());
  Targets t = Enabled(10);
  bench.Enable(t);
  for (const int torque : {200, 500, 100, 333}) {
    t.torque = static_cast<std::int16_t>(torque);
    bench.Run(t, 100);
    EXPECT_NEAR(static_cast<double>(bench.Number(Slot(0x6077))), torque, 1.0);
    // 6075 is rounded to mA: 261 for 260.87.
    EXPECT_NEAR(static_cast<double>(bench.Number(Slot(0x6078))), torque, 2.0);
  }
}

TEST(Motion, TensionFollowsTheTorqueWithinFriction) {
  DriveBench bench(TautCable());
  Targets t = Enabled(10);
  bench.Enable(t);
  t.torque = 400;
  bench.Run(t, 300);
  const Winch& winch = bench.drive.winch();
  const double torque_nm = 0.4 * 1e-3 * kRatedTorque_mnm;
  const double band_nm = MotorData{}.friction_torque_nm * MotorData{}.stiction_ratio +
                         0.14 * winch.metres_per_rad() * winch.tension_n();
  EXPECT_NEAR(winch.HoldingTorque_nm(winch.tension_n()), torque_nm, band_nm);
  EXPECT_GT(winch.tension_n(), 0.7);
}

TEST(Motion, TorqueOffsetAdds) {
  DriveBench bench(TautCable());
  Targets t = Enabled(10);
  bench.Enable(t);
  t.torque = 100;
  t.torque_offset = 150;
  bench.Run(t, 100);
  EXPECT_NEAR(static_cast<double>(bench.Number(Slot(0x6077))), 250.0, 1.0);
}

TEST(Motion, VelocityModeHoldsItsSpeed) {
  DriveBench bench(NoCable());
  Targets t = Enabled(9);
  bench.Enable(t);
  for (const std::int32_t velocity : {20000, -20000, 60000, 0}) {
    t.velocity = velocity;
    bench.Run(t, 50);
    const std::int64_t before = bench.Number(Slot(0x6064));
    bench.Run(t, 100);
    const auto travelled = static_cast<double>(bench.Number(Slot(0x6064)) - before);
    // Over one second the mean speed is exact to two counts.
    EXPECT_NEAR(travelled, velocity, 2.0);
  }
}

TEST(Motion, VelocityModeKeepsReelingAgainstACable) {
  DriveBench bench(TautCable());
  Targets t = Enabled(9);
  bench.Enable(t);
  t.velocity = 1000;  // 3.8 mm/s into 500 N/m
  bench.Run(t, 10);
  const std::int64_t before = bench.Number(Slot(0x6064));
  bench.Run(t, 30);
  const auto travelled = static_cast<double>(bench.Number(Slot(0x6064)) - before);
  // A load that grows steadily leaves the observer 3 / w = 6 ms of it behind, which the velocity
  // loop makes up with speed: v = demand / (1 + k s^2 (3 / w) / (J w_v)) = 0.71 demand; stiction on
  // top.
  EXPECT_GT(travelled, 0.55 * 300.0);
  EXPECT_LT(travelled, 300.0);
  EXPECT_GT(bench.drive.winch().tension_n(), 0.4);
}

TEST(Motion, PositionModeFollowsARampAndArrives) {
  DriveBench bench(NoCable());
  Targets t = Enabled(8);
  bench.Enable(t);
  double worst = 0.0;
  for (int i = 1; i <= 200; ++i) {
    t.position = 100 * i;
    bench.Run(t, 1);
    if (i < 20) continue;
    worst = std::max(worst, std::abs(static_cast<double>(bench.Number(Slot(0x6064)) - t.position)));
  }
  // At 10000 counts/s with the velocity fed forward: a fiftieth of a drum turn.
  EXPECT_LT(worst, 160.0);
  bench.Run(t, 100);
  EXPECT_NEAR(static_cast<double>(bench.Number(Slot(0x6064))), 20000.0, 3.0);
}

TEST(Motion, PositionModeHoldsAgainstACable) {
  DriveBench bench(TautCable());
  Targets t = Enabled(8);
  bench.Enable(t);
  for (int i = 1; i <= 100; ++i) {
    t.position = 4 * i;
    bench.Run(t, 1);
  }
  bench.Run(t, 200);
  EXPECT_NEAR(static_cast<double>(bench.Number(Slot(0x6064))), 400.0, 16.0);
  EXPECT_GT(bench.drive.winch().tension_n(), 0.7);
}

TEST(Motion, DemandIsInterpolatedOverTheInterpolationPeriod) {
  ObjectDictionary objects(1);
  objects.Store(Slot(0x60C2, 1), 4);  // 4 ms
  objects.Store(Slot(0x607A), 400);
  Motion motion;
  motion.Start(OperationMode::kCyclicPosition, {}, 0.0);
  motion.OnTargets(objects);
  // The drum is held at zero, so that the following error is the demand.
  const double expected[] = {100.0, 200.0, 300.0, 400.0, 400.0};
  for (const double demand : expected) {
    motion.Tick(objects, {}, StopKind::kNone);
    EXPECT_NEAR(motion.following_error(), demand, 1e-9);
  }
}

TEST(Motion, MaxTorqueLimitsEveryModeAndSetsBit11) {
  for (const int mode : {8, 9, 10}) {
    DriveBench bench(TautCable());
    bench.Download(0x6072, 0, 2, 300);
    bench.Download(0x6065, 0, 4, 0xFFFFFFFF);
    Targets t = Enabled(mode);
    bench.Enable(t);
    t.torque = 900;
    t.velocity = 20000;
    t.position = 5000;
    for (int i = 0; i < 100; ++i) {
      bench.Run(t, 1);
      EXPECT_LE(std::abs(bench.drive.demanded_torque()), 300.0) << mode;
    }
    EXPECT_NEAR(static_cast<double>(bench.Number(Slot(0x6077))), 300.0, 1.0) << mode;
    EXPECT_NE(bench.statusword() & statusword::kInternalLimit, 0) << mode;
    EXPECT_EQ(bench.statusword() & statusword::kFollowsCommand, 0) << mode;
    EXPECT_EQ(bench.drive.state(), DriveState::kOperationEnabled);
  }
}

TEST(Motion, PositionLimitsHoldInEveryMode) {
  for (const int mode : {8, 9, 10}) {
    DriveBench bench(NoCable());
    bench.Download(0x607D, 1, 4, static_cast<std::uint32_t>(-3000));
    bench.Download(0x607D, 2, 4, 3000);
    Targets t = Enabled(mode);
    bench.Enable(t);
    for (const int direction : {1, -1}) {
      t.torque = static_cast<std::int16_t>(direction * 60);
      t.velocity = direction * 6000;
      for (int i = 0; i < 300; ++i) {
        t.position = std::clamp(t.position + direction * 60, -5000, 5000);
        bench.Run(t, 1);
      }
      const auto x = static_cast<double>(bench.Number(Slot(0x6064)));
      // Mode 10 without a load only stops pushing: the drum coasts to friction's stop.
      const double coast = mode == 10 ? 20000.0 : 120.0;
      EXPECT_LE(direction * x, 3000.0 + coast) << mode;
      EXPECT_GT(direction * x, 2800.0) << mode;
      EXPECT_NE(bench.statusword() & statusword::kInternalLimit, 0) << mode;
      EXPECT_EQ(bench.drive.state(), DriveState::kOperationEnabled) << mode;
    }
  }
}

TEST(Motion, HaltTakesTheTorqueAwayAlongTheSlopeInModeTen) {
  for (const std::uint32_t option : {1U, 2U, 3U, 4U}) {
    DriveBench bench(TautCable());
    bench.Download(0x605D, 0, 2, option);
    bench.Download(0x6087, 0, 4, 4000);  // 400 take 100 ms
    Targets t = Enabled(10);
    t.torque = 400;
    bench.Enable(t);
    bench.Run(t, 100);
    t.controlword |= controlword::kHalt;
    bench.Run(t, 5);
    const double after_50_ms = bench.drive.demanded_torque();
    EXPECT_NEAR(after_50_ms, option <= 2 ? 200.0 : 0.0, 8.0) << option;
    bench.Run(t, 7);
    EXPECT_EQ(bench.drive.demanded_torque(), 0.0);
    EXPECT_EQ(bench.drive.state(), DriveState::kOperationEnabled);
    t.controlword = controlword::kEnableOperation;
    bench.Run(t, 100);
    EXPECT_NEAR(static_cast<double>(bench.Number(Slot(0x6077))), 400.0, 1.0);
  }
}

TEST(Motion, HaltTakesATorqueThatPaysOutAwayAlongTheSlopeToo) {
  DriveBench bench(TautCable());
  bench.Download(0x6087, 0, 4, 4000);
  Targets t = Enabled(10);
  t.torque = -400;
  bench.Enable(t);
  bench.Run(t, 10);
  ASSERT_EQ(bench.drive.demanded_torque(), -400.0);
  t.controlword |= controlword::kHalt;
  bench.Run(t, 5);
  EXPECT_NEAR(bench.drive.demanded_torque(), -200.0, 8.0);
  bench.Run(t, 7);
  EXPECT_EQ(bench.drive.demanded_torque(), 0.0);
}

TEST(Motion, HaltDeceleratesAndHoldsInModesEightAndNine) {
  const std::pair<std::uint32_t, double> options[] = {
      {1, 20000.0 / 50000.0}, {2, 20000.0 / 100000.0}, {3, 0.0}, {4, 0.0}};
  for (const auto& [option, time_s] : options) {
    for (const int mode : {8, 9}) {
      DriveBench bench(NoCable());
      bench.Download(0x605D, 0, 2, option);
      bench.Download(0x6084, 0, 4, 50000);
      bench.Download(0x6085, 0, 4, 100000);
      Targets t = Enabled(mode);
      bench.Enable(t);
      t.velocity = 20000;
      for (int i = 0; i < 100; ++i) {
        t.position += 200;
        bench.Run(t, 1);
      }
      const auto start = static_cast<double>(bench.Number(Slot(0x6064)));
      t.controlword |= controlword::kHalt;
      bench.Run(t, 100);
      const auto stop = static_cast<double>(bench.Number(Slot(0x6064)));
      // Half the speed times the time of the ramp, plus what the loops take to stop a drum.
      EXPECT_NEAR(stop - start, 0.5 * 20000.0 * time_s, 260.0) << option << " mode " << mode;
      bench.Run(t, 50);
      // Stiction hunts: an integrating loop on a drum that sticks moves by a few counts.
      EXPECT_NEAR(static_cast<double>(bench.Number(Slot(0x6064))), stop, 10.0);
      EXPECT_EQ(bench.statusword() & statusword::kFollowsCommand, 0);
      EXPECT_EQ(bench.drive.state(), DriveState::kOperationEnabled);
    }
  }
}

TEST(Motion, ChangeOfModeUnderLoadIsBumpless) {
  DriveBench bench(TautCable());
  Targets t = Enabled(10);
  t.torque = 400;
  bench.Enable(t);
  bench.Run(t, 200);
  const auto x = static_cast<double>(bench.Number(Slot(0x6064)));
  t.mode = 9;
  t.velocity = 0;
  bench.Run(t, 100);
  // A twentieth of what the cable is stretched.
  EXPECT_NEAR(static_cast<double>(bench.Number(Slot(0x6064))), x, 0.05 * x);
  EXPECT_EQ(bench.Number(Slot(0x6061)), 9);
}

TEST(EncoderTracker, FollowsAConstantSpeedWithoutLag) {
  EncoderTracker tracker;
  constexpr double kSpeed_counts_s = 12345.0;
  for (int ms = 0; ms < 500; ++ms) {
    tracker.Update(static_cast<std::int64_t>(std::floor(kSpeed_counts_s * ms * 1e-3)), 0.0);
  }
  // One count of quantisation makes 3 w^2 h = 750 counts/s.
  EXPECT_NEAR(tracker.measured().velocity_counts_s, kSpeed_counts_s, 750.0);
}

}  // namespace
}  // namespace mantle::firmware_sim
