#include "tests/loop/vehicle.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>
#include <vector>

#include "tests/loop/vehicles.h"

namespace mantle::loop {
namespace {

using firmware_sim::DriveStep;
using tests::CableMotor;
using tests::ClampedArm;
using tests::LoopRun;

MotorCommand Pull(const Vehicle& vehicle, double tension_n, double sigma) {
  return {static_cast<std::int16_t>(
      std::lround(TensionToTorque(vehicle.winch_map(), tension_n, sigma)))};
}

TEST(Vehicle, BringUpEndsWithEveryCableAtItsPretensionAndThePlantUntouched) {
  const model::Plant plant(ClampedArm());
  for (const double stiffness : {500.0, 5000.0}) {
    DriveOptions drives;
    drives.cable_stiffness_n_m = stiffness;
    Vehicle vehicle(plant, LoopRun(), {CableMotor("a", 0), CableMotor("b", 2)}, drives);
    const Status status = vehicle.BringUp();
    ASSERT_TRUE(status.ok) << status.reason;
    EXPECT_EQ(vehicle.time_us(), 0);
    EXPECT_EQ(vehicle.state().velocity.norm(), 0.0);
    // The mean of eight torques, each some 20 mN off by the loop's unsteadiness and 2.4 mN by its
    // unit; then three counts of the position loop's hunting on stiction.
    constexpr double kMean_n = 0.01;
    constexpr double kCount_m = 3.835e-6;
    const double hunting_n = 3 * kCount_m * stiffness;
    for (int i = 0; i < 2; ++i) {
      EXPECT_EQ(vehicle.report(i).step, DriveStep::kEnabled);
      EXPECT_NEAR(vehicle.drum_tension_n(i), drives.pretension_n, kMean_n + hunting_n);
      EXPECT_NEAR(vehicle.ReportedReel_m(i), vehicle.reel(i).end.reeled_m,
                  kMean_n / stiffness + kCount_m);
    }
  }
}

TEST(Vehicle, APulledCableBendsTheArmWithTheTensionThatItsTorqueSays) {
  const model::Plant plant(ClampedArm());
  Vehicle vehicle(plant, LoopRun(), {CableMotor("a", 0), CableMotor("b", 2)}, {});
  ASSERT_TRUE(vehicle.BringUp().ok);
  for (int k = 0; k < 50; ++k) {
    const double wanted_n = 0.01 * k;
    const MotorCommand commands[] = {Pull(vehicle, wanted_n, 1.0), Pull(vehicle, 0.0, -1.0)};
    const Status status = vehicle.Cycle(commands);
    ASSERT_TRUE(status.ok) << status.reason;
    // While it reels in the friction is known; half a step of the ramp and the drum's ringing on
    // its cable remain.
    constexpr double kRinging_n = 0.025;
    if (k < 10) continue;
    ASSERT_NEAR(vehicle.drum_tension_n(0), wanted_n, kRinging_n) << k;
  }
  EXPECT_EQ(vehicle.time_us(), 500'000);
  EXPECT_NEAR(vehicle.state().time_s, 0.5, 1e-12);
  const model::Sample sample = vehicle.Observe();
  const model::Vector3 straight = model::InitialState(plant).pose.back().position;
  // A cable at 6.3 mm (mean) from the centreline, shortened by 10 mm, turns the tip by 1.6 rad at
  // rest; in water it has begun to.
  constexpr double kBent_m = 0.03;
  EXPECT_GT((sample.tips[0].position - straight).norm(), kBent_m);
}

std::string Refusal(const std::vector<reduced::Actuator>& motors, const DriveOptions& drives,
                    const VehicleOptions& options = {}) {
  const model::Plant plant(ClampedArm(4));
  try {
    Vehicle(plant, LoopRun(), motors, drives, options);
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "not refused";
}

TEST(Vehicle, RefusesMotorsAndOptionsByNameValueAndBound) {
  using Kind = reduced::ActuatorTarget::Kind;
  const std::vector<reduced::Actuator> good = {CableMotor("a", 0)};
  const auto expect = [](const std::string& refusal, const char* part) {
    EXPECT_NE(refusal.find(part), std::string::npos) << refusal;
  };
  expect(Refusal({}, {}), "1 to 16 motors");
  expect(Refusal({{"idle", {}}}, {}), "motor \"idle\": drives no cable");
  expect(Refusal({{"squeeze", {{Kind::kStrip, 0, 1.0}}}}, {}), "motor \"squeeze\"");
  expect(Refusal({CableMotor("far", 9)}, {}), "cable 9 does not exist; the robot has 4");
  expect(Refusal({{"back", {{Kind::kCable, 0, -1.0}}}}, {}), "must be above 0");
  expect(Refusal({CableMotor("a", 1), CableMotor("b", 1)}, {}), "cable 1 is driven already");
  expect(Refusal(good, {.period_s = 0.0125}), "0.0125");
  expect(Refusal(good, {.period_s = 0.2}), "1 to 90 whole milliseconds");
  expect(Refusal(good, {.cable_stiffness_n_m = 0}), "cable_stiffness");
  expect(Refusal(good, {.cable_damping_n_s_m = -1}), "cable_damping");
  expect(Refusal(good, {.pretension_n = -1}), "pretension");
  expect(Refusal(good, {}, {.coupling_steps = 7}), "coupling steps per period are 7");
}

TEST(Vehicle, BringUpNamesTheDriveThatFails) {
  const model::Plant plant(ClampedArm(4));
  VehicleOptions options;
  options.supervisor.settings.max_torque_permille = 5;  // cannot even start its rotor
  Vehicle vehicle(plant, LoopRun(), {CableMotor("a", 0), CableMotor("b", 2)}, {}, options);
  const Status status = vehicle.BringUp();
  EXPECT_FALSE(status.ok);
  EXPECT_NE(status.reason.find("node 1"), std::string::npos) << status.reason;
}

TEST(Vehicle, CouplingStepsDivideThePeriodAndFollowTheStiffness) {
  int before = 0;
  for (const double stiffness : {10.0, 500.0, 5000.0, 50000.0}) {
    for (const double period : {0.001, 0.007, 0.01, 0.02}) {
      DriveOptions drives;
      drives.cable_stiffness_n_m = stiffness;
      drives.period_s = period;
      const int steps = CouplingSteps(drives);
      EXPECT_GE(steps, 1);
      EXPECT_EQ(std::lround(1e4 * period) % steps, 0) << stiffness << " " << period;
    }
    const int steps = CouplingSteps({.cable_stiffness_n_m = stiffness});
    EXPECT_GE(steps, before);
    before = steps;
  }
}

}  // namespace
}  // namespace mantle::loop
