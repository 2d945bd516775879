#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/loop/vehicle.h"
#include "tests/loop/vehicles.h"

/// How a run ends: by Stop, or by a controller that no longer talks.

namespace mantle::loop {
namespace {

using firmware_sim::DriveState;
using firmware_sim::DriveStep;
using firmware_sim::EmcyCode;
using tests::FiveMotors;
using tests::LoopRun;
using tests::SwimmingRobot;

constexpr int kBendingMotor = 0;
constexpr int kMantleMotor = 4;

/// Swimming robot with one arm cable and the mantle pulled to half a newton.
void PullHard(Vehicle& vehicle) {
  ASSERT_TRUE(vehicle.BringUp().ok);
  for (int k = 0; k < 50; ++k) {
    MotorCommand commands[5] = {};
    const auto torque =
        static_cast<std::int16_t>(std::lround(TensionToTorque(vehicle.winch_map(), 0.01 * k, 1.0)));
    commands[kBendingMotor].torque_permille = commands[kMantleMotor].torque_permille = torque;
    const Status status = vehicle.Cycle(commands);
    ASSERT_TRUE(status.ok) << status.reason;
  }
  ASSERT_GT(vehicle.drum_tension_n(kBendingMotor), 0.4);
  ASSERT_GT(vehicle.drum_tension_n(kMantleMotor), 0.4);
}

/// The brake closed on slack; what swings later may draw the cable by as much as this.
constexpr double kLeft_n = 0.08;

TEST(Stop, RampsTheTensionsLetsTheBodyStraightenAndStopsTheNodes) {
  const model::Plant plant(SwimmingRobot());
  Vehicle vehicle(plant, LoopRun(), FiveMotors(), {});
  PullHard(vehicle);
  const double before_m = vehicle.length_m(kMantleMotor);
  const Status status = vehicle.Stop();
  ASSERT_TRUE(status.ok) << status.reason;
  for (int i = 0; i < vehicle.motor_count(); ++i) {
    EXPECT_EQ(vehicle.report(i).step, DriveStep::kStopped);
    EXPECT_TRUE(vehicle.drive(i).brake_closed());
    EXPECT_LT(vehicle.drum_tension_n(i), firmware_sim::WinchData{}.slack_tension_n);
  }
  EXPECT_GT(vehicle.length_m(kMantleMotor), before_m + 0.02);  // of 28 mm drawn in
  for (int k = 0; k < 200; ++k) {
    ASSERT_TRUE(vehicle.CycleWithoutMaster().ok);
    for (int i = 0; i < vehicle.motor_count(); ++i) {
      ASSERT_LT(vehicle.drum_tension_n(i), kLeft_n) << k << " motor " << i;
    }
  }
}

TEST(Stop, AMotorNeverKeepsPullingBecauseSomebodyStoppedTalking) {
  const model::Plant plant(SwimmingRobot());
  Vehicle vehicle(plant, LoopRun(), FiveMotors(), {});
  PullHard(vehicle);
  const double pulled_m = vehicle.length_m(kMantleMotor);
  int slack_after = -1;
  double later_n = 0;
  for (int k = 0; k < 400; ++k) {
    const Status status = vehicle.CycleWithoutMaster();
    ASSERT_TRUE(status.ok) << status.reason;
    const double highest_n =
        std::max(vehicle.drum_tension_n(kBendingMotor), vehicle.drum_tension_n(kMantleMotor));
    if (slack_after >= 0) {
      later_n = std::max(later_n, highest_n);
    } else if (highest_n < kLeft_n) {
      slack_after = k;
    }
  }
  // 1400:5 is 100 ms, the ramp of 200 thousandths takes 20 ms, paying out some mm at 50 mm/s.
  EXPECT_GT(slack_after, 9);
  EXPECT_LT(slack_after, 40);
  // The straightening body draws the cable taut again and again until the drum's stiction, 83 mN,
  // is broken from outside or by the motor.
  EXPECT_LT(later_n, 0.15);
  EXPECT_EQ(vehicle.drive(kBendingMotor).state(), DriveState::kFault);
  EXPECT_TRUE(vehicle.drive(kBendingMotor).brake_closed());
  EXPECT_TRUE(vehicle.drive(kMantleMotor).brake_closed());
  // The body is as it was built, but for what the swing of the arm leaves after 4 s.
  EXPECT_GT(vehicle.length_m(kMantleMotor), pulled_m + 0.02);
  EXPECT_NEAR(vehicle.length_m(kMantleMotor), vehicle.reel(kMantleMotor).rest_length_m, 1e-4);
  EXPECT_NEAR(vehicle.length_m(kBendingMotor), vehicle.reel(kBendingMotor).rest_length_m, 3e-3);
}

TEST(Stop, AControllerThatComesBackFindsTheFaultReported) {
  const model::Plant plant(SwimmingRobot(10, 16));
  Vehicle vehicle(plant, LoopRun(), FiveMotors(), {});
  PullHard(vehicle);
  for (int k = 0; k < 100; ++k) ASSERT_TRUE(vehicle.CycleWithoutMaster().ok);
  const MotorCommand commands[5] = {};
  const Status status = vehicle.Cycle(commands);
  EXPECT_TRUE(status.ok) << status.reason;  // the plant goes on; the drives say what happened
  bool reported = false;
  for (const auto& record : vehicle.report(kBendingMotor).emcy) {
    reported = reported || record.code == EmcyCode::kRpdoTimeout;
  }
  EXPECT_TRUE(reported) << Describe(vehicle.report(kBendingMotor));
}

}  // namespace
}  // namespace mantle::loop
