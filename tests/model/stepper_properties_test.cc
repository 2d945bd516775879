#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "model/stepper.h"
#include "tests/support/paper_robot.h"

// What every Stepper promises (model/stepper.h), over all integrators: the same suite whatever the
// method. Order and accuracy of each have tests of their own (validation_time_test.cc).

namespace mantle::model {
namespace {

constexpr double kStep_s = 5e-5;  // within the stability limit of RK4 for this arm
// A body under gravity alone moves with a polynomial of degree 2, which every method of order 2 and
// above integrates exactly, and BDF to its tolerance.
constexpr double kFall_m = 1e-9;
// Strains are zero to 1e-16; the stiffness over the mass of an element makes speeds of 1e-14 of
// that.
constexpr double kRestRoundOff = 1e-13;

struct Method {
  const char* name;
  Integrator integrator;
};
void PrintTo(const Method& method, std::ostream* out) { *out << method.name; }

Robot Arm4() {
  Robot robot;
  robot.name = "arm";
  robot.arms = {tests::PaperArm(4)};
  robot.body_length_m = 0.42;
  robot.effects.viscosity = true;
  return robot;
}

class StepperProperties : public ::testing::TestWithParam<Method> {
 protected:
  StepperSettings Settings() const {
    StepperSettings settings;
    settings.integrator = GetParam().integrator;
    settings.relative_tolerance = 1e-8;
    settings.absolute_tolerance = 1e-11;
    return settings;
  }
  // The arm clamped and bent by its own weight from straight: everything moves.
  static Robot Drooping() {
    Robot robot = Arm4();
    robot.root = ClampedRoot{};
    robot.effects.weight = true;
    robot.effects.gravity_m_s2 = {9.81, 0, 0};
    return robot;
  }
  static double Distance(const PlantState& a, const PlantState& b) {
    double worst = (a.velocity - b.velocity).cwiseAbs().maxCoeff();
    for (std::size_t i = 0; i < a.pose.size(); ++i) {
      worst = std::max(worst, (a.pose[i].position - b.pose[i].position).norm());
      worst = std::max(worst, a.pose[i].rotation.angularDistance(b.pose[i].rotation));
    }
    return worst;
  }
};

TEST_P(StepperProperties, WhatRestsStaysAtRest) {
  Robot robot = Arm4();
  const Plant plant(robot);
  PlantState state = InitialState(plant);
  const PlantState start = state;
  const auto stepper = MakeStepper(plant, Settings());
  for (int i = 0; i < 10; ++i) ASSERT_TRUE(stepper->Step(kStep_s, &state, nullptr).ok);
  EXPECT_LT(Distance(state, start), kRestRoundOff);
}

TEST_P(StepperProperties, TimeAdvancesByTheStepAndTheCountersCount) {
  const Plant plant(Drooping());
  PlantState state = InitialState(plant);
  const auto stepper = MakeStepper(plant, Settings());
  for (int i = 0; i < 8; ++i) ASSERT_TRUE(stepper->Step(kStep_s, &state, nullptr).ok);
  EXPECT_NEAR(state.time_s, 8 * kStep_s, 1e-15);
  EXPECT_GE(stepper->counters().steps, 8);
  EXPECT_GT(stepper->counters().evaluations, 0);
}

TEST_P(StepperProperties, AFreeBodyFallsAsGalileoSays) {
  Robot robot = Arm4();
  robot.effects.weight = true;
  const Plant plant(robot);
  PlantState state = InitialState(plant);
  const Vector3 start = state.pose[0].position;
  const auto stepper = MakeStepper(plant, Settings());
  constexpr int kSteps = 40;
  for (int i = 0; i < kSteps; ++i) ASSERT_TRUE(stepper->Step(kStep_s, &state, nullptr).ok);
  const double t = kSteps * kStep_s;
  const Vector3 fall = 0.5 * t * t * robot.effects.gravity_m_s2;
  // Backward Euler adds half a step: 1/2 g t h.
  const double own_error =
      GetParam().integrator == Integrator::kBackwardEuler ? 0.5 * 9.81 * t * kStep_s : 0.0;
  EXPECT_LT((state.pose[0].position - start - fall).norm(), own_error + kFall_m);
}

TEST_P(StepperProperties, SmallStepsAgreeWithTheReference) {
  const Plant plant(Drooping());
  constexpr double kTime_s = 0.01;
  PlantState state = InitialState(plant), truth = state;
  const auto stepper = MakeStepper(plant, Settings());
  for (int i = 0; i < 200; ++i) ASSERT_TRUE(stepper->Step(kTime_s / 200, &state, nullptr).ok);
  StepperSettings reference = Settings();
  reference.integrator = Integrator::kSdirk3;
  reference.newton_tolerance = 1e-12;
  const auto fine = MakeStepper(plant, reference);
  for (int i = 0; i < 400; ++i) ASSERT_TRUE(fine->Step(kTime_s / 400, &truth, nullptr).ok);
  // Of the largest speed. Backward Euler errs by the share h / t = 0.5 %, twice over.
  const double speed = truth.velocity.cwiseAbs().maxCoeff();
  const double tolerance = GetParam().integrator == Integrator::kBackwardEuler ? 1e-2 : 1e-5;
  EXPECT_LT(Distance(state, truth), tolerance * speed);
  EXPECT_GT(Distance(truth, InitialState(plant)), 0.05);  // it does move
}

TEST_P(StepperProperties, ARestartFromItsMemoryGivesTheSameBits) {
  if (GetParam().integrator == Integrator::kCvode) GTEST_SKIP() << "keeps a history of its own";
  const Plant plant(Drooping());
  PlantState state = InitialState(plant);
  const auto stepper = MakeStepper(plant, Settings());
  for (int i = 0; i < 5; ++i) ASSERT_TRUE(stepper->Step(kStep_s, &state, nullptr).ok);
  const std::string memory = stepper->SaveMemory();
  PlantState resumed = state;
  const auto other = MakeStepper(plant, Settings());
  other->RestoreMemory(memory);
  for (int i = 0; i < 5; ++i) {
    ASSERT_TRUE(stepper->Step(kStep_s, &state, nullptr).ok);
    ASSERT_TRUE(other->Step(kStep_s, &resumed, nullptr).ok);
  }
  EXPECT_EQ(Distance(state, resumed), 0.0);
}

TEST_P(StepperProperties, AStepThatFailsChangesNothingAndSaysWhere) {
  const Plant plant(Drooping());
  PlantState state = InitialState(plant);
  // An element that turns by more than a half turn in a step: no method follows.
  state.velocity.segment<3>(plant.ArmVelocity(0, 2)).setConstant(1e12);
  const PlantState start = state;
  const auto stepper = MakeStepper(plant, Settings());
  const StepStatus status = stepper->Step(0.01, &state, nullptr);
  ASSERT_FALSE(status.ok);
  EXPECT_FALSE(status.reason.empty());
  EXPECT_EQ(Distance(state, start), 0.0);
  EXPECT_EQ(state.time_s, start.time_s);
}

INSTANTIATE_TEST_SUITE_P(EveryIntegrator, StepperProperties,
                         ::testing::Values(Method{"Sdirk2", Integrator::kSdirk2},
                                           Method{"Sdirk3", Integrator::kSdirk3},
                                           Method{"BackwardEuler", Integrator::kBackwardEuler},
                                           Method{"Rk4", Integrator::kRk4},
                                           Method{"Cvode", Integrator::kCvode}),
                         [](const auto& info) { return std::string(info.param.name); });

}  // namespace
}  // namespace mantle::model
