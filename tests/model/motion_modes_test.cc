#include "model/motion_modes.h"

#include <gtest/gtest.h>

#include <cmath>

#include "model/modes.h"
#include "model/static_newton.h"
#include "model/static_problem.h"
#include "tests/support/paper_robot.h"
#include "tests/support/runs.h"

namespace mantle::model {
namespace {

// Both iterate to nine digits or better.
constexpr double kIterated = 1e-7;

struct AtRest {
  explicit AtRest(const Robot& robot, double load_factor = 0.0)
      : plant(robot), problem(plant, 0.0), work(plant), state(problem.Reference()) {
    EXPECT_FALSE(problem.Evaluate(load_factor, &state, &inputs, &work));
  }
  Plant plant;
  StaticProblem problem;
  PlantWork work;
  PlantInputs inputs;
  StaticState state;
};

Robot Clamped(bool mantle) {
  Robot robot = tests::PaperRobot(12, 24);
  robot.root = ClampedRoot{};
  if (!mantle) robot.mantle.reset();
  robot.rigid_body.reset();
  robot.effects.added_mass = true;
  return robot;
}

TEST(MotionModes, WithoutLossesAreTheVibrationModes) {
  for (bool mantle : {false, true}) {
    AtRest at(Clamped(mantle));
    const auto motions = MotionModes(at.plant, at.state, at.inputs, 6);
    const auto vibrations = VibrationModes(at.plant, at.state, at.inputs, 6);
    ASSERT_EQ(motions.size(), 6u);
    for (int k = 0; k < 6; ++k) {
      const double expected = vibrations[k].angular_frequency_rad_s;
      EXPECT_NEAR(motions[k].rate_1_s.imag(), expected, kIterated * expected) << k;
      EXPECT_NEAR(motions[k].rate_1_s.real(), 0.0, kIterated * expected) << k;
      EXPECT_FALSE(motions[k].unstable());
    }
  }
}

TEST(MotionModes, KelvinVoigtDampingIsThatOfTheMaterial) {
  // Where Upsilon = tau Sigma every mode has lambda^2 + tau omega^2 lambda + omega^2 = 0.
  constexpr double kTau = 2e-3;
  Robot robot = Clamped(false);
  const Vector6 stiffness = SectionStiffness(robot.arms[0].material, 1.0, 0.01);
  robot.arms[0].stiffness = stiffness;
  AtRest without(robot);
  const auto vibrations = VibrationModes(without.plant, without.state, without.inputs, 4);
  robot.arms[0].viscosity = Vector6(kTau * stiffness);
  robot.effects.viscosity = true;
  AtRest with(robot);
  const auto motions = MotionModes(with.plant, with.state, with.inputs, 4);
  for (int k = 0; k < 4; ++k) {
    const double w = vibrations[k].angular_frequency_rad_s;
    EXPECT_NEAR(motions[k].damping_ratio(), 0.5 * kTau * w, 1e-6) << k;
    EXPECT_NEAR(std::abs(motions[k].rate_1_s), w, 1e-6 * w) << k;
  }
}

TEST(MotionModes, WhatGoesWithTheSquareOfVelocityDampsNothingAboutRest) {
  Robot robot = Clamped(true);
  robot.effects.drag = true;
  robot.effects.jet_thrust = JetThrust{FluxReading::kVolume, ThrustPlace::kDome};
  AtRest at(robot);
  for (const MotionMode& mode : MotionModes(at.plant, at.state, at.inputs, 6)) {
    const double frequency = mode.rate_1_s.imag();
    EXPECT_GT(frequency, 1.0);
    // Round-off of forces at a velocity of 1e-4; a probe of that size alone would leave 1e-5.
    constexpr double kRoundOff = 1e-8;
    EXPECT_NEAR(mode.damping_ratio(), 0.0, kRoundOff) << frequency;
  }
}

TEST(MotionModes, AnUnstableStateGrowsAndSaysSo) {
  // A straight rod under 1.5 times Euler's load: omega^2 < 0 in two planes. The state must be the
  // equilibrium under that load: with the load but without the compression that carries it, the
  // tangent is not symmetric and the rod has no modes.
  Robot robot = tests::ClampedRod(1.0, (Vector6() << 1, 1, 1, 1e6, 1e6, 1e6).finished(), 20);
  robot.arms[0].points = {tests::TipLoad(robot.arms[0], Vector3::Zero(),
                                         {-1.5 * M_PI * M_PI / 4, 0, 0}, LoadFrame::kWorld)};
  AtRest at(robot);
  StaticNewton newton(at.problem, 1e-10, 20);
  newton.state = at.state;
  ASSERT_EQ(newton.AtLoad(1.0), StaticNewton::Outcome::kConverged) << newton.reason();
  at.state = newton.state;
  ASSERT_FALSE(at.problem.Evaluate(1.0, &at.state, &at.inputs, &at.work));
  const auto vibrations = VibrationModes(at.plant, at.state, at.inputs, 3);
  EXPECT_EQ(vibrations[0].angular_frequency_rad_s, 0.0);
  // The beam's: EI w'''' + P w'' + rho A g^2 w = 0, w = w' = 0 at the base, w'' = 0 and
  // EI w''' + P w' = 0 at the tip has its only root at rho A g^2 L^4 / EI = 7.05802 for P = 1.5
  // Euler loads. Twenty elements and the rotary inertia of the section leave less than one percent.
  const double beam = std::sqrt(7.05802 / (M_PI * 1e-4));
  EXPECT_NEAR(vibrations[0].growth_rate_1_s, beam, 0.01 * beam);
  EXPECT_EQ(vibrations[2].growth_rate_1_s, 0.0);
  int growing = 0;
  for (const MotionMode& mode : MotionModes(at.plant, at.state, at.inputs, 8)) {
    if (!mode.unstable()) continue;
    ++growing;
    EXPECT_EQ(mode.frequency_hz(), 0.0);
    EXPECT_NEAR(mode.rate_1_s.real(), vibrations[0].growth_rate_1_s,
                1e-5 * vibrations[0].growth_rate_1_s);
  }
  EXPECT_EQ(growing, 2);
}

TEST(MotionModes, AFreeRobotHasSixRigidMotionsFirst) {
  Robot robot = tests::PaperRobot(8, 16);
  const Plant plant(robot);
  PlantState state = InitialState(plant);
  PlantInputs inputs;
  EvaluateInputs(plant, 0.0, false, &inputs);
  const auto motions = MotionModes(plant, state, inputs, 20);
  int rigid = 0;
  for (const MotionMode& mode : motions) rigid += std::abs(mode.rate_1_s) < 0.05 ? 1 : 0;
  EXPECT_GE(rigid, 6);
  EXPECT_LT(rigid, 13);
}

}  // namespace
}  // namespace mantle::model
