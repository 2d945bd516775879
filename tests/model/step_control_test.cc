#include "model/step_control.h"

#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "model/simulation.h"
#include "model/step_cap.h"
#include "tests/support/paper_robot.h"
#include "tests/support/runs.h"

// Error-controlled steps, and steps that failed.

namespace mantle::model {
namespace {

TEST(StepCap, GrowsAgainAfterAFailureAndWaitsLongerEachTimeThatItDoesNotHold) {
  StepCap cap(1.0);
  int failures = 0;
  constexpr int kSteps = 300;
  for (int i = 0; i < kSteps; ++i) {  // nothing above 0.3 holds
    if (cap.now_s() > 0.3) {
      cap.Fail(cap.now_s());
      ++failures;
    } else {
      cap.Hold();
    }
  }
  EXPECT_LE(failures, 12);
  for (int i = 0; i < 200; ++i) cap.Hold();
  EXPECT_EQ(cap.now_s(), 1.0);
}

TEST(StepControl, FindsTheStepWhoseErrorIsTheTolerance) {
  StepControl control(1.0, 2);
  double h = 1.0;
  int refused = 0;
  for (int i = 0; i < 60; ++i) {  // an error (h / 0.1)^3 of the tolerance
    h = control.now_s();
    const double ratio = std::pow(h / 0.1, 3);
    if (ratio > 1.0) {
      control.Refuse(h, ratio);
      ++refused;
    } else {
      control.Accept(h, ratio);
    }
  }
  EXPECT_LE(h, 0.1);
  EXPECT_GT(h, 0.07);
  EXPECT_LE(refused, 3);
}

TEST(StepControl, AStepShortenedToLandSaysNothingAgainstLongOnes) {
  StepControl control(0.1, 2);
  control.Accept(0.1, 0.5);
  const double before = control.now_s();
  control.Accept(1e-6, 1e-4);
  EXPECT_EQ(control.now_s(), before);
}

Robot Pulsed() {
  Robot robot;
  robot.name = "arm";
  robot.root = ClampedRoot{};
  robot.arms = {tests::PaperArm(8)};
  robot.effects.added_mass = robot.effects.drag = robot.effects.viscosity = true;
  Vector6 load = Vector6::Zero();
  load(4) = 0.3;
  robot.arms[0].points = {
      {"tip", 0.42, load, LoadFrame::kWorld, IntervalSchedule{1.0, {0.2031}, {0.6017}}}};
  return robot;
}

RunSettings Controlled(Integrator integrator, double tolerance) {
  RunSettings settings;
  settings.stepper.integrator = integrator;
  settings.stepper.step_tolerance = tolerance;
  settings.duration_s = 1.2;
  settings.step_s = 0.1;
  settings.output_interval_s = 0.1;
  return settings;
}

Vector3 TipAfter(const RunSettings& settings, StepCounters* counters) {
  const Plant plant(Pulsed());
  Simulation simulation(plant, settings);
  EXPECT_TRUE(simulation.AdvanceTo(settings.duration_s).ok);
  *counters = simulation.counters();
  return AbsolutePose(plant, simulation.state(), 0, 8).position;
}

TEST(ErrorControlledSteps, ATighterToleranceIsAsMuchCloserToTheTruth) {
  StepCounters counters;
  RunSettings reference = Controlled(Integrator::kSdirk3, 0.0);
  reference.step_s = 2.5e-4;
  const Vector3 exact = TipAfter(reference, &counters);
  for (Integrator integrator : {Integrator::kSdirk2, Integrator::kSdirk3}) {
    double before = 0;
    long steps = 0;
    for (double tolerance : {1e-2, 1e-4, 1e-6}) {
      const double error = (TipAfter(Controlled(integrator, tolerance), &counters) - exact).norm();
      EXPECT_LT(error, 2.0 * tolerance) << tolerance;
      if (before > 0) {
        EXPECT_LT(error, 0.3 * before) << tolerance;
        EXPECT_GT(counters.steps, steps);
      }
      before = error;
      steps = counters.steps;
    }
  }
}

TEST(ErrorControlledSteps, LandOnBreakPointsAndRestartWithTheSameBits) {
  const Plant plant(Pulsed());
  const RunSettings settings = Controlled(Integrator::kSdirk2, 1e-4);
  Simulation whole(plant, settings), resumed(plant, settings);
  ASSERT_TRUE(whole.AdvanceTo(0.5).ok);
  const std::string saved = whole.Checkpoint();
  ASSERT_TRUE(whole.AdvanceTo(1.1).ok);
  resumed.Restore(saved);
  ASSERT_TRUE(resumed.AdvanceTo(1.1).ok);
  EXPECT_EQ(whole.Checkpoint(), resumed.Checkpoint());
  // A load that is on for 0.3986 s does the work of that time: a step over its end would not show
  // it.
  StepCounters counters;
  RunSettings fine = Controlled(Integrator::kSdirk3, 0.0);
  fine.step_s = 2.5e-4;
  const Vector3 exact = TipAfter(fine, &counters);
  EXPECT_LT((AbsolutePose(
                 plant,
                 [&] {
                   Simulation s(plant, settings);
                   EXPECT_TRUE(s.AdvanceTo(1.2).ok);
                   return s.state();
                 }(),
                 0, 8)
                 .position -
             exact)
                .norm(),
            2e-4);
}

TEST(ErrorControlledSteps, AreRefusedWhereTheyMeanNothing) {
  const Plant plant(Pulsed());
  for (Integrator integrator : {Integrator::kCvode, Integrator::kRk4}) {
    RunSettings settings = Controlled(integrator, 1e-4);
    settings.step_s = 1e-6;
    try {
      Simulation refused(plant, settings);
      FAIL() << "accepted";
    } catch (const BadRobot& error) {
      EXPECT_NE(std::string(error.what()).find("time.tolerance"), std::string::npos);
    }
  }
}

}  // namespace
}  // namespace mantle::model
