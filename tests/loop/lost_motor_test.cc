#include <gtest/gtest.h>

#include "loop/closed_loop.h"
#include "loop/control_side/simulated_winch.h"
#include "loop/scene/scene.h"
#include "tests/support/paths.h"

// A motor that fails: what the drives report is believed, and the others do without it.

namespace mantle::loop {
namespace {

using firmware_sim::DriveReport;
using firmware_sim::DriveStep;

constexpr double kPeriod_s = 0.01;

scene::Scene Steer(const std::string& duration) {
  return scene::LoadScene(
      tests::SourcePath("scenes/steer.toml"),
      {"time.duration=" + duration, "mantle.elements=16", "arms.arm.elements=8"});
}

/// One motor with a range of 1 N.
struct One {
  One() { report.step = DriveStep::kEnabled; }
  /// A period with a command and the tension that the drive holds with the friction half way.
  void Period(double command_n, double pulled_n) {
    report.torque_permille =
        static_cast<std::int16_t>(std::lround(TensionToTorque(map, pulled_n, 0.0)));
    const MotorEvidence evidence{&report, command_n, pulled_n};
    health.Update({&evidence, 1});
  }

  controller::WinchMap map = SimulatedWinch();
  DriveReport report;
  MotorHealth health{map, {{0.0, 1.0, 2.0, false}}, {1.0}, kPeriod_s};
};

TEST(MotorHealth, WhatAgreesWithTheReportsIsBelievedToTheBit) {
  One one;
  for (int i = 0; i < 100; ++i) {
    const double u = 0.5 + 0.4 * std::sin(0.1 * i);
    one.Period(u, u + 0.03 * std::cos(i));
    EXPECT_EQ(one.health.missing_n()(0), 0.0) << i;
  }
  EXPECT_FALSE(one.health.lost(0));
}

TEST(MotorHealth, WhatIsNotPulledIsMissingAndInTimeTheMotorIsLost) {
  One one;
  double t = 0;
  for (; t < MotorHealth::kDead_s; t += kPeriod_s) {
    one.Period(0.6, 0.0);
    EXPECT_FALSE(one.health.lost(0)) << t;
  }
  EXPECT_LT(one.health.missing_n()(0), -0.4);
  bool changed = false;
  for (; t < 2 * MotorHealth::kDead_s; t += kPeriod_s) {
    one.Period(0.6, 0.0);
    changed = changed || one.health.changed();
  }
  EXPECT_TRUE(one.health.lost(0));
  EXPECT_TRUE(changed);
  EXPECT_EQ(one.health.limits()[0].max_tension_n, 0.0);
  EXPECT_EQ(one.health.limits()[0].max_rate_n_s, 2.0);
}

TEST(MotorHealth, AMotorThatIsNotAskedForMuchIsNotJudged) {
  One one;
  for (int i = 0; i < 1000; ++i) one.Period(0.05, 0.0);
  EXPECT_FALSE(one.health.lost(0));
}

TEST(MotorHealth, ADriveThatIsNotEnabledGetsNothingUntilItIsAgain) {
  One one;
  one.Period(0.5, 0.5);
  one.report.step = DriveStep::kFaulted;
  one.Period(0.5, 0.0);
  EXPECT_TRUE(one.health.lost(0));
  EXPECT_DOUBLE_EQ(one.health.missing_n()(0), -0.5);
  one.report.step = DriveStep::kEnabled;
  one.Period(0.0, 0.0);
  EXPECT_FALSE(one.health.lost(0));
  EXPECT_EQ(one.health.limits()[0].max_tension_n, 1.0);
}

TEST(MotorHealth, ABiasThatStaysAtItsBoundIsAMotorThatDoesNotPull) {
  One one;
  const model::VectorX bias = model::VectorX::Constant(1, -0.5);
  for (double t = 0; t < 1.1 * MotorHealth::kSaturated_s; t += kPeriod_s) {
    one.Period(0.6, 0.6);  // as far as its drive can tell: the cable may be torn
    EXPECT_EQ(one.health.lost(0), t > MotorHealth::kSaturated_s) << t;
    one.health.UpdateBias(bias, 0.5);
  }
  EXPECT_TRUE(one.health.lost(0));
}

TEST(LostMotor, SoundOnesAreBelieved) {
  ClosedLoop loop(Steer("1.5"));
  const LoopResult r = loop.Run([&](const LoopStep&) {
    EXPECT_EQ(loop.control_side().health().missing_n().cwiseAbs().maxCoeff(), 0.0);
    return true;
  });
  ASSERT_TRUE(r.ok) << r.reason;
  EXPECT_TRUE(r.lost_motors.empty());
  EXPECT_EQ(r.ended, "");
}

TEST(LostMotor, ADriveInFaultGetsNothingPlansCountWithoutItAndTheRunSaysSo) {
  constexpr int kMotor = 1;  // a cable of the arm
  constexpr double kFault_s = 1.0;
  ClosedLoop loop(Steer("2.5"));
  double asked_n = 0, planned_n = 0, others_n = 0;
  const LoopResult r = loop.Run([&](const LoopStep& step) {
    if (std::abs(step.time_s - kFault_s) < 1e-9) {
      loop.plant_side().drive(kMotor).Disturb(firmware_sim::Disturbance::kOverVoltage);
    }
    if (step.time_s > kFault_s + 0.1) {
      asked_n = std::max(asked_n, step.command_n(kMotor));
      if (step.planned) {
        planned_n = std::max(planned_n, step.plan->tensions.row(kMotor).maxCoeff());
        others_n = std::max(others_n, step.plan->tensions.maxCoeff());
      }
    }
    return true;
  });
  ASSERT_TRUE(r.ok) << r.reason;
  EXPECT_EQ(asked_n, 0.0);
  EXPECT_EQ(planned_n, 0.0);
  EXPECT_GT(others_n, 0.1);
  EXPECT_EQ(r.counters.shifted + r.counters.safe, 0U) << "plans go on";
  EXPECT_EQ(r.lost_motors, std::set<int>{kMotor});
  EXPECT_NE(r.ended.find("does not work"), std::string::npos) << r.ended;
  EXPECT_NE(r.ended.find("in fault"), std::string::npos) << r.ended;
}

}  // namespace
}  // namespace mantle::loop
