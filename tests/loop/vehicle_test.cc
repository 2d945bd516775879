#include "tools/loop/vehicle.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
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
    model::DriveOptions drives;
    drives.cable_stiffness_n_m = stiffness;
    Vehicle vehicle(plant, LoopRun(), {CableMotor("a", 0), CableMotor("b", 2)}, drives);
    const model::StepStatus status = vehicle.BringUp();
    ASSERT_TRUE(status.ok) << status.reason;
    EXPECT_EQ(vehicle.time_us(), 0);
    EXPECT_EQ(vehicle.state().velocity.norm(), 0.0);
    // Torque is reported in steps of 2.4 mN, and creeping adds half a pretension per period.
    constexpr double kTension_n = 0.015;
    // As a length on the softer cable, with two counts for the encoder.
    constexpr double kZero_m = kTension_n / 500.0 + 2 * 3.8e-6;
    for (int i = 0; i < 2; ++i) {
      EXPECT_EQ(vehicle.report(i).step, DriveStep::kEnabled);
      EXPECT_NEAR(vehicle.drum_tension_n(i), drives.pretension_n, kTension_n);
      EXPECT_NEAR(vehicle.ReportedReel_m(i), vehicle.reel(i).end.reeled_m, kZero_m);
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
    const model::StepStatus status = vehicle.Cycle(commands);
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

}  // namespace
}  // namespace mantle::loop
