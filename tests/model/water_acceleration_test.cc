#include "model/water_acceleration.h"

#include <gtest/gtest.h>

#include <cmath>

#include "model/inputs.h"
#include "model/root_motion.h"
#include "model/simulation.h"
#include "reduced/build/simulation.h"
#include "tests/support/paper_robot.h"
#include "tests/support/runs.h"

namespace mantle::model {
namespace {

// Water that turns and swells; integrals by the schedules themselves (schedule_test.cc).
UnsteadyCurrent Swell() {
  return {SineSchedule{0.3, 0.8, 0.4, 0.05, 0.0}, CubicSchedule{{0.0, 0.3, 1.0}, {0.0, 0.2, -0.1}},
          TableSchedule{{0.1, 0.5}, {-0.1, 0.15}}};
}
Vector3 Drift(const UnsteadyCurrent& c, double t) {
  return {Integral(c.x_m_s, t), Integral(c.y_m_s, t), Integral(c.z_m_s, t)};
}
Vector3 VelocityOf(const UnsteadyCurrent& c, double t) {
  return {Value(c.x_m_s, t), Value(c.y_m_s, t), Value(c.z_m_s, t)};
}

Robot Ball(double mass, double volume) {
  Robot robot;
  robot.name = "ball";
  robot.rigid_body = RigidBody{
      "ball", GivenInertia{mass, Vector3(0.01, 0, 0.02), 1e-4 * Matrix3::Identity(), volume}};
  robot.effects.unsteady_current = Swell();
  return robot;
}

TEST(WaterAcceleration, NeutralBodyDriftsWithTheWater) {
  constexpr double kRoundOff = 1e-12;
  Robot ball = Ball(1022 * 1e-4, 1e-4);
  Robot vehicle = tests::PaperRobot(6, 24);  // every body is as dense as water
  vehicle.effects = tests::EveryEffect();
  vehicle.effects.unsteady_current = Swell();
  for (Robot robot : {ball, vehicle}) {
    robot.root_twist.tail<3>() = VelocityOf(Swell(), 0.0);
    for (const Integrator integrator : {Integrator::kSdirk2, Integrator::kCvode}) {
      const RunResult r = tests::CompleteRun(robot, tests::Settings(integrator, 0.05, 0.8));
      EXPECT_LT((r.last.root.position - Drift(Swell(), 0.8)).norm(), kRoundOff) << robot.name;
      EXPECT_LT((r.last.root_twist.tail<3>() - VelocityOf(Swell(), 0.8)).norm(), kRoundOff);
      EXPECT_LT(r.energy_drift, 1e-2);
    }
  }
}

TEST(WaterAcceleration, HeavyBodyFollowsInTheRatioOfTheMasses) {
  // m v' = rho_w V a without drag or added mass; no force has a moment about the centre.
  Robot robot = Ball(1022 * 2.5e-4, 1e-4);
  const RunResult r = tests::CompleteRun(robot, tests::Settings(Integrator::kSdirk2, 0.01, 0.8));
  const Vector3 expected =
      0.4 * (Drift(Swell(), 0.8) - 0.8 * VelocityOf(Swell(), 0.0));  // from rest in the earth
  constexpr double kSecondOrder = 2e-5;
  EXPECT_LT((r.last.root.position - expected).norm(), kSecondOrder);
  EXPECT_LT(LogSO3(r.last.root.rotation).norm(), 1e-10);
  EXPECT_GT(expected.norm(), 0.01);
  ASSERT_EQ(r.work_names, std::vector<std::string>{"water_acceleration"});
  EXPECT_NEAR(r.work_j[0], r.last.energies.total(), 1e-3 * r.last.energies.total());
}

TEST(WaterAcceleration, HeldArmFeelsMorisonsInertiaForce) {  // (rho_w A + added mass) a per length
  Robot robot;
  robot.name = "held";
  robot.root = ClampedRoot{};
  robot.arms = {tests::PaperArm(10)};
  robot.arms[0].mount = Pose::Identity();
  robot.arms[0].material.density_kg_m3 = 1900;
  robot.effects.added_mass = true;
  robot.effects.unsteady_current =
      UnsteadyCurrent{ConstantSchedule{0}, TableSchedule{{0, 1}, {0, 0.7}}, ConstantSchedule{0}};
  const Plant plant(robot);
  PlantInputs inputs;
  EvaluateInputs(plant, 0.0, false, &inputs);
  PlantWork work(plant);
  ASSERT_FALSE(EvaluateForces(plant, InitialState(plant), inputs, &work));
  VectorX held = VectorX::Zero(plant.velocity_size()), image = held;
  double displaced = 0, added = 0;
  for (const auto* places : {&plant.rods[0].nodes, &plant.rods[0].middles}) {
    for (const RodNode& n : *places) {
      displaced += 1022 * n.weight_m * n.section.area_m2;
      added += n.added_mass_kg;
    }
  }
  held.head<6>() = inputs.root_acceleration;
  for (int i = 1; i <= 10; ++i) held(plant.ArmVelocity(0, i) + 4) = inputs.root_acceleration(4);
  ApplyMass(plant, work, held, &image);
  image -= work.force;
  double force = image(4);
  for (int i = 1; i <= 10; ++i) force += image(plant.ArmVelocity(0, i) + 4);
  EXPECT_NEAR(-force, 0.7 * (displaced + added), 1e-12);
}

TEST(WaterAcceleration, NeutralArmTowedAgainstArmInTheOpposedCurrent) {
  Robot towed;
  towed.name = "towed";
  towed.arms = {tests::PaperArm(12)};
  towed.arms[0].mount = Pose::Identity();
  towed.effects.drag = towed.effects.added_mass = towed.effects.viscosity = true;
  Robot held = towed;
  const double amplitude = 0.03, frequency = 1.3, w = 2 * M_PI * frequency;
  PrescribedRoot motion;
  motion.y_m = SineSchedule{amplitude, frequency, 0.0, 0.0, 0.0};
  towed.root = motion;
  held.root = ClampedRoot{};
  held.effects.unsteady_current = UnsteadyCurrent{
      ConstantSchedule{0}, SineSchedule{-amplitude * w, frequency, M_PI / 2, 0.0, 0.0},
      ConstantSchedule{0}};
  // The towed arm starts with the root's velocity, the held one at rest while the water moves.
  const RunSettings settings = tests::Settings(Integrator::kSdirk3, 0.005, 0.7);
  const RunResult a = tests::CompleteRun(towed, settings), b = tests::CompleteRun(held, settings);
  const Vector3 shape_a = a.last.tips[0].position - a.last.root.position;
  const Vector3 shape_b = b.last.tips[0].position - b.last.root.position;
  EXPECT_LT((shape_a - shape_b).norm(), 1e-9);
  EXPECT_GT((shape_a - Vector3(0.42, 0, 0)).norm(), 0.01);
  EXPECT_LT(b.power_balance_residual, 1e-10);
  EXPECT_LT(b.energy_drift, 1e-3);
  reduced::Reduction reduction;
  reduction.arms[0].segments = 8;
  reduced::ReducedRunSettings reduced_settings;
  reduced_settings.duration_s = 0.7;
  reduced_settings.step_s = 0.01;
  const reduced::ReducedPlant model(held, reduction);
  reduced::ReducedSimulation run(model, reduced_settings);
  const RunResult c = run.Run();
  ASSERT_TRUE(c.ok) << c.reason;
  // Eight segments are 0.9 % from the plant's limit; its own mesh of 12 adds 0.2 %, on the other
  // side.
  held.arms[0].elements = 24;
  const RunResult fine = tests::CompleteRun(held, settings);
  EXPECT_LT((c.last.tips[0].position - fine.last.tips[0].position).norm(), 0.01 * 0.42);
}

TEST(WaterAcceleration, OutputsAreTheEarths) {
  Robot robot = Ball(1022 * 2.5e-4, 1e-4);
  robot.root_twist << 0.5, -0.3, 0.8, 0.1, 0, 0.2;
  const Plant plant(robot);
  Simulation run(plant, tests::Settings(Integrator::kSdirk3, 0.005, 0.8));
  constexpr double kStep = 1e-3;
  ASSERT_TRUE(run.AdvanceTo(0.35 - kStep).ok);
  const Sample before = run.Observe();
  ASSERT_TRUE(run.AdvanceTo(0.35).ok);
  const Sample now = run.Observe();
  ASSERT_TRUE(run.AdvanceTo(0.35 + kStep).ok);
  const Sample after = run.Observe();
  constexpr double kDifferences = 1e-5;  // h^2, on velocities and accelerations of order 1
  const Vector3 velocity = (after.root.position - before.root.position) / (2 * kStep);
  EXPECT_LT((now.root.rotation * now.root_twist.tail<3>() - velocity).norm(), kDifferences);
  const Vector6 rate = (after.root_twist - before.root_twist) / (2 * kStep);
  EXPECT_LT((now.root_acceleration - rate).norm(), 10 * kDifferences);
  const Vector3 centre = (after.centre_of_mass_m - before.centre_of_mass_m) / (2 * kStep);
  EXPECT_LT((now.momentum.tail<3>() / (1022 * 2.5e-4) - centre).norm(), kDifferences);
}

TEST(WaterAcceleration, ACurrentThatJumpsIsRefused) {
  Robot robot = Ball(0.1, 1e-4);
  robot.effects.unsteady_current->y_m_s = IntervalSchedule{0.2, {0.1}, {0.4}};
  try {
    const Plant plant(robot);
    FAIL();
  } catch (const BadRobot& error) {
    EXPECT_EQ(std::string(error.what()).find("effects.current.y: jumps by 0.2 m/s at t = 0.1 s"),
              0u);
  }
}

}  // namespace
}  // namespace mantle::model
