#include "model/start_state.h"

#include <gtest/gtest.h>

#include <cmath>

#include "model/modes.h"
#include "model/simulation.h"
#include "reduced/build/simulation.h"
#include "tests/support/paper_robot.h"
#include "tests/support/rich_robot.h"
#include "tests/support/runs.h"

namespace mantle::model {
namespace {

// A heavy arm with a pulled cable, a muscle and a payload, clamped, in a current.
Robot Loaded() {
  Robot robot;
  robot.name = "loaded";
  robot.root = ClampedRoot{};
  robot.initial = InitialShape::kEquilibrium;
  robot.arms = {tests::PaperArm(16)};
  Arm& arm = robot.arms[0];
  arm.material.density_kg_m3 = 1060;
  arm.mount.rotation = Eigen::Quaterniond::Identity();
  robot.effects.weight = robot.effects.buoyancy = robot.effects.drag = true;
  robot.effects.added_mass = robot.effects.viscosity = true;
  robot.effects.current_m_s = Vector3(0.05, 0.15, 0.0);
  MuscleWave wave = tests::Wave("bend", {0, 1, 0});
  wave.frequency_hz = ConstantSchedule{0};
  arm.muscles = {wave};
  Payload p;
  p.name = "stone";
  p.at_m = 0.42;
  p.mass_kg = 0.01;
  p.volume_m3 = 4e-6;
  arm.payloads = {p};
  ArmCable cable;
  cable.name = "cable";
  cable.end_m = 0.42;
  cable.drive = GivenTension{ConstantSchedule{0.1}};
  arm.cables = {cable};
  return robot;
}

// How far the tip strays from where it starts, in lengths.
template <typename Run>
double Straying(Run* run, double* way) {
  std::vector<Vector3> tips;
  const RunResult r = run->Run([&](const Sample& s) {
    tips.push_back(s.tips[0].position);
    return true;
  });
  EXPECT_TRUE(r.ok) << r.reason;
  double farthest = 0;
  for (const Vector3& tip : tips) farthest = std::max(farthest, (tip - tips[0]).norm());
  *way = (tips[0] - Vector3(0.42, 0, -0.112)).norm();
  return farthest / 0.42;
}

TEST(StartState, ARunFromItsEquilibriumStaysThere) {
  constexpr double kStays = 1e-8;  // Newton's tolerance of the steps
  const Plant plant(Loaded());
  Simulation run(plant, tests::Settings(Integrator::kSdirk2, 0.01, 1.0));
  double way = 0;
  EXPECT_LT(Straying(&run, &way), kStays);
  EXPECT_GT(way, 0.05);  // and that is no shape at rest
  Robot at_rest = Loaded();
  at_rest.initial = InitialShape::kReference;
  const Plant other(at_rest);
  Simulation falling(other, tests::Settings(Integrator::kSdirk2, 0.01, 1.0));
  EXPECT_GT(Straying(&falling, &way), 0.05);
}

TEST(StartState, SoDoesTheReducedModelInItsOwn) {
  constexpr double kStays = 1e-7;
  reduced::Reduction reduction;
  reduction.arms[0].segments = 4;
  const reduced::ReducedPlant model(Loaded(), reduction);
  reduced::ReducedRunSettings settings;
  settings.duration_s = 1.0;
  settings.step_s = 0.02;
  reduced::ReducedSimulation run(model, settings);
  double way = 0;
  EXPECT_LT(Straying(&run, &way), kStays);
  EXPECT_GT(way, 0.05);
}

TEST(StartState, MantleStartsInItsEquilibriumToo) {
  Robot robot = tests::PaperRobot(6, 32);
  robot.root = ClampedRoot{};
  robot.mantle->strips = {{"muscle", 0.025, 0.105, ConstantSchedule{160}}};
  robot.effects.viscosity = true;
  robot.initial = InitialShape::kEquilibrium;
  const Plant plant(robot);
  Simulation run(plant, tests::Settings(Integrator::kSdirk2, 0.01, 0.3));
  const double start = run.Observe().volume_m3;
  ASSERT_TRUE(run.AdvanceTo(0.3).ok);
  EXPECT_NEAR(run.Observe().volume_m3 / start, 1.0, 1e-8);
  EXPECT_LT(start, 0.95 * plant.shell->rest_volume_m3);
}

TEST(StartState, GivenStrainsAreTheShape) {  // a helix: constant strain, exact
  Robot robot;
  robot.name = "helix";
  robot.arms = {tests::PaperArm(10)};
  robot.rigid_body = tests::PaperCone();
  robot.root_twist << 0.3, -0.2, 0.5, 0.1, 0.2, -0.1;
  Vector6 strain;
  strain << 3.0, 0.0, 8.0, 1.01, 0.0, 0.002;
  robot.arms[0].initial_strain = StrainTable{{0.0, 0.42}, {strain, strain}};
  const Plant plant(robot);
  const PlantState start = StartState(plant);
  const Pose base = start.pose[0] * robot.arms[0].mount;
  for (int i = 0; i <= 10; ++i) {
    const Pose expected = base * ExpSE3(Vector6(0.042 * i * strain));
    EXPECT_LT(LogSE3(Inverse(expected) * start.pose[plant.ArmPose(0, i)]).norm(), 1e-12);
  }
  // It moves with the root as one body: no element strains.
  PlantWork work(plant);
  PlantInputs inputs;
  EvaluateInputs(plant, 0.0, false, &inputs);
  ASSERT_FALSE(EvaluateForces(plant, start, inputs, &work));
  for (const RodElementState& e : work.rod[0]) EXPECT_LT(e.d_dot.norm(), 1e-13);
  reduced::Reduction reduction;
  reduction.arms[0].strains = reduced::kSixStrains;
  const reduced::ReducedPlant model(robot, reduction);
  const reduced::ReducedSimulation run(model, {});
  for (int k = 0; k < 4; ++k) {
    Vector6 rest = Vector6::Unit(3);
    EXPECT_LT((run.state().q.segment<6>(6 * k) - (strain - rest)).norm(), 1e-9);
  }
}

TEST(StartState, ModeByNumberIsThatMode) {  // released, the arm swings at that frequency alone
  Robot robot;
  robot.name = "bar";
  robot.root = ClampedRoot{};
  robot.arms = {tests::PaperArm(24)};
  robot.arms[0].mount = Pose::Identity();
  ArmPiece strip;  // no two frequencies alike
  strip.length_m = 0.42;
  strip.outline = RectangularOutline{{0.02, 0.014}, {0.012, 0.009}};
  strip.material = robot.arms[0].material;
  robot.arms[0].pieces = {strip};
  const Plant plain(robot);
  const std::vector<Mode> modes = VibrationModes(plain, InitialState(plain), 4);
  for (int number : {1, 2, 3}) {
    Robot moving = robot;
    moving.arms[0].initial_modes = {{number, 1e-4}};
    const Plant plant(moving);
    const double omega = modes[number - 1].angular_frequency_rad_s;
    RunSettings settings =
        tests::Settings(Integrator::kSdirk3, 2 * M_PI / omega / 200, 0.25 * 2 * M_PI / omega);
    Simulation run(plant, settings);
    const VectorX start = run.state().velocity;
    double fastest = 0;
    for (int i = 1; i <= 24; ++i) {
      fastest = std::max(fastest, start.segment<3>(plant.ArmVelocity(0, i) + 3).norm());
    }
    EXPECT_NEAR(fastest, 1e-4, 1e-12);
    ASSERT_TRUE(run.Run().ok);
    EXPECT_LT(run.state().velocity.norm(), 1e-4 * start.norm()) << number;  // a quarter period on
  }
}

TEST(StartState, TwinModesAreToldApartByTheirPlane) {
  Robot robot;
  robot.name = "round";
  robot.root = ClampedRoot{};
  robot.arms = {tests::PaperArm(12)};
  robot.arms[0].mount = Pose::Identity();
  for (int number : {1, 2, 3, 4}) {
    robot.arms[0].initial_modes = {{number, 0.1}};
    const Plant plant(robot);
    const PlantState start = StartState(plant);
    const Vector3 tip = start.velocity.segment<3>(plant.ArmVelocity(0, 12) + 3);
    const int along = number % 2 == 1 ? 1 : 2;
    EXPECT_GT(tip(along), 0.01) << number;
    EXPECT_LT(std::abs(tip(3 - along)), 1e-6 * tip(along)) << number;
  }
}

std::string WhyNot(const Robot& robot) {
  try {
    const Plant plant(robot);
    StartState(plant);
  } catch (const BadRobot& error) {
    return error.what();
  }
  return "";
}

TEST(StartState, WhatCannotStartIsRefusedByName) {
  Robot free = Loaded();
  free.root = FreeRoot{};
  free.rigid_body = tests::PaperCone();
  EXPECT_NE(WhyNot(free).find("robot.initial = \"static\": robot.root = \"free\""),
            std::string::npos);
  Robot crushed = tests::PaperRobot(4, 32);
  crushed.root = ClampedRoot{};
  crushed.mantle->strips = {{"muscle", 0.025, 0.105, ConstantSchedule{900}}};
  crushed.initial = InitialShape::kEquilibrium;
  EXPECT_NE(WhyNot(crushed).find("robot.initial = \"static\": no equilibrium"), std::string::npos);
  Robot many = Loaded();
  many.initial = InitialShape::kReference;
  many.arms[0].initial_modes = {{2000, 0.1}};
  EXPECT_NE(WhyNot(many).find("initial_modes[0].mode = 2000"), std::string::npos);
}

}  // namespace
}  // namespace mantle::model
