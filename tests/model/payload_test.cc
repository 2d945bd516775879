#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "model/energy.h"
#include "model/modes.h"
#include "model/observation.h"
#include "model/simulation.h"
#include "model/statics.h"
#include "tests/support/paper_robot.h"
#include "tests/support/plant_state.h"
#include "tests/support/random_values.h"
#include "tests/support/reduced_runs.h"
#include "tests/support/rich_robot.h"
#include "tests/support/runs.h"

namespace mantle::model {
namespace {

using std::numbers::pi;

Robot Rod(int elements) {
  Robot robot;
  robot.name = "rod";
  robot.root = ClampedRoot{};
  robot.arms = {tests::PaperArm(elements)};
  robot.arms[0].mount = Pose::Identity();
  robot.arms[0].radius_tip_m = robot.arms[0].radius_base_m = 0.006;
  return robot;
}

Payload Ball(double at_m, double mass_kg, double volume_m3) {
  Payload p;
  p.name = "ball";
  p.at_m = at_m;
  p.mass_kg = mass_kg;
  p.volume_m3 = volume_m3;
  return p;
}

TEST(Payload, LowersTheFrequencyAsBeamTheorySays) {
  // Cantilever with tip mass m: 1 + cosh b cos b + m b / (rho A L) (sinh b cos b - cosh b sin b) =
  // 0
  Robot robot = Rod(60);
  const Arm& arm = robot.arms[0];
  const double area = pi * 3.6e-5, beam = 1022 * area * 0.42, mass = 0.7 * beam;
  robot.arms[0].payloads = {Ball(0.42, mass, 0)};
  const auto residual = [&](double b) {
    return 1 + std::cosh(b) * std::cos(b) +
           mass / beam * b * (std::sinh(b) * std::cos(b) - std::cosh(b) * std::sin(b));
  };
  double low = 0.5, high = 1.87;
  for (int i = 0; i < 60; ++i) {
    const double mid = 0.5 * (low + high);
    (residual(mid) > 0 ? low : high) = mid;
  }
  const double second = pi / 4 * std::pow(0.006, 4);
  const double omega =
      low * low / (0.42 * 0.42) * std::sqrt(arm.material.young_pa * second / (1022 * area));
  const Plant plant(robot);
  const Mode first = VibrationModes(plant, InitialState(plant), 1)[0];
  constexpr double kSlender = 1e-3;  // shear and rotary inertia, 60 elements
  EXPECT_NEAR(first.angular_frequency_rad_s / omega, 1.0, kSlender);
}

TEST(Payload, HangsWithItsWeightLessItsBuoyancy) {
  Robot robot = Rod(20);
  robot.effects.weight = robot.effects.buoyancy = true;  // the rod itself is neutral
  robot.arms[0].payloads = {Ball(0.21, 0.006, 5e-6)};
  robot.arms[0].payloads[0].offset_m = {0.003, 0.01, 0.002};
  Robot loaded = Rod(20);  // the same force by hand: moment offset x force follows the section
  const Vector3 force(0, 0, -9.81 * (0.006 - 1022 * 5e-6));
  const StaticsResult a = tests::Equilibrium(robot, 4);
  const Pose g = a.state.pose[11];  // node 10, after the root and node 0
  const Vector3 moment = (g.rotation * robot.arms[0].payloads[0].offset_m).cross(force);
  Vector6 wrench;
  wrench << moment, force;
  loaded.arms[0].points = {{"hand", 0.21, wrench, LoadFrame::kWorld, ConstantSchedule{1}}};
  const StaticsResult b = tests::Equilibrium(loaded, 4);
  EXPECT_LT((a.state.pose.back().position - b.state.pose.back().position).norm(), 1e-9);
  EXPECT_GT((a.state.pose.back().position - Vector3(0.42, 0, 0)).norm(), 0.01);
  EXPECT_TRUE(a.without_potential.empty());
  EXPECT_LT(a.residual_n, 1e-9);
}

Robot Thrower(double drop_s) {
  Robot robot;
  robot.name = "thrower";
  robot.arms = {tests::PaperArm(8)};
  robot.rigid_body = tests::PaperCone();
  robot.root_twist << 0.8, -2.0, 0.5, 0.1, 0.05, 0.2;
  tests::AddPayloads(&robot.arms[0]);
  robot.arms[0].payloads[0].drop_s = drop_s;
  return robot;
}

TEST(Payload, BalancesCloseWithEveryEffect) {
  Robot robot = tests::PaperRobot(8, 24);
  robot.effects = tests::EveryEffect();
  tests::AddRichness(&robot);
  robot.arms[0].payloads.push_back(Ball(0.0, 0.03, 1e-5));
  robot.arms[0].payloads.back().name = "base";
  const Plant plant(robot);
  for (unsigned seed : {1u, 2u, 3u}) {
    PlantState state = tests::RandomState(plant, 1.0, seed);
    PlantInputs inputs;
    EvaluateInputs(plant, state.time_s, false, &inputs);
    PlantWork work(plant);
    ASSERT_FALSE(EvaluateForces(plant, state, inputs, &work));
    VectorX acceleration = VectorX::Zero(plant.velocity_size());
    SolveAcceleration(plant, inputs, &work, &acceleration);
    EnergyAccount account(plant);
    account.EvaluatePowers(plant, state, inputs, work, acceleration);
    const auto balance = account.EvaluateBalance(plant, state, work, acceleration);
    EXPECT_LT(std::abs(balance.residual_w) / balance.scale_w, 1e-12) << seed;
    VectorX image(plant.velocity_size());
    ApplyMass(plant, work, acceleration, &image);
    EXPECT_LT((image - work.force).cwiseAbs().maxCoeff(), 1e-10 * work.force.cwiseAbs().maxCoeff());
  }
}

TEST(Payload, DroppedKeepsTheMomentumOfVehicleAndPayload) {
  for (const Integrator integrator : {Integrator::kSdirk3, Integrator::kRk4, Integrator::kCvode}) {
    const double drop = 0.05;
    Robot robot = Thrower(drop);
    const Plant plant(robot);
    RunSettings settings =
        tests::Settings(integrator, integrator == Integrator::kRk4 ? 1e-4 : 0.004, 0.1);
    settings.stepper.relative_tolerance = 1e-9;
    settings.stepper.absolute_tolerance = 1e-11;
    Simulation run(plant, settings);
    const Vector6 start = run.Observe().momentum;
    const RunResult r = run.Run();
    ASSERT_TRUE(r.ok) << r.reason;
    ASSERT_EQ(r.drops.size(), 1u);
    const PayloadDrop& d = r.drops[0];
    EXPECT_EQ(d.name, "arm.middle");
    EXPECT_NEAR(d.time_s, drop, 1e-12);
    EXPECT_GT(d.momentum_kg_m_s.norm(), 1e-3);
    // Alone it goes on with the momentum that it left with.
    const Vector3 total = r.last.momentum.tail<3>() + d.momentum_kg_m_s;
    constexpr double kSolver = 2e-7;  // of 0.06 kg m/s; steps of 4 ms, third order
    EXPECT_LT((total - start.tail<3>()).norm(), kSolver) << static_cast<int>(integrator);
    ASSERT_EQ(r.work_names.back(), "dropped.arm.middle");
    EXPECT_EQ(r.work_j.back(), -d.kinetic_energy_j);
    EXPECT_LT(r.energy_drift, 1e-4);
  }
}

TEST(Payload, DropIsTheSameAfterACheckpoint) {
  const Plant plant(Thrower(0.05));
  const RunSettings settings = tests::Settings(Integrator::kSdirk2, 0.005, 0.1);
  Simulation whole(plant, settings), first(plant, settings), second(plant, settings);
  ASSERT_TRUE(first.AdvanceTo(0.07).ok);
  second.Restore(first.Checkpoint());
  ASSERT_TRUE(whole.AdvanceTo(0.07).ok);
  ASSERT_TRUE(whole.AdvanceTo(0.1).ok);
  ASSERT_TRUE(second.AdvanceTo(0.1).ok);
  const RunResult a = whole.Result(), b = second.Result();
  ASSERT_EQ(b.drops.size(), 1u);
  EXPECT_EQ(a.drops[0].name, b.drops[0].name);
  EXPECT_EQ(a.drops[0].kinetic_energy_j, b.drops[0].kinetic_energy_j);
  EXPECT_EQ(a.last.momentum, b.last.momentum);
}

TEST(Payload, ReducedModelDropsAsThePlant) {
  Robot robot = Rod(24);
  robot.effects.weight = robot.effects.viscosity = true;
  robot.effects.gravity_m_s2 = {0, 0, -0.2};
  robot.arms[0].payloads = {Ball(0.42, 0.03, 0)};
  robot.arms[0].payloads[0].drop_s = 0.3;
  const double duration = 0.6;
  const RunResult plant =
      tests::CompleteRun(robot, tests::Settings(Integrator::kSdirk3, 0.005, duration));
  const RunResult r = tests::EightSegmentRun(robot, duration);
  constexpr double kEightSegments = 0.01;  // of the length
  EXPECT_GT((plant.last.tips[0].position - Vector3(0.42, 0, 0)).norm(), 0.01);
  EXPECT_LT((plant.last.tips[0].position - r.last.tips[0].position).norm(), kEightSegments * 0.42);
  ASSERT_EQ(r.drops.size(), 1u);
  EXPECT_NEAR(r.drops[0].momentum_kg_m_s.norm(), plant.drops[0].momentum_kg_m_s.norm(),
              0.05 * plant.drops[0].momentum_kg_m_s.norm());
}

TEST(Payload, ImpossibleOnesAreRefusedByName) {
  const auto why = [](const Payload& p, Coupling coupling = Coupling::kExact) -> std::string {
    Robot robot = Rod(8);
    robot.root = FreeRoot{};
    robot.coupling = coupling;
    robot.rigid_body = tests::PaperCone();
    robot.arms[0].payloads = {p};
    try {
      const Plant plant(robot);
    } catch (const BadRobot& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_EQ(why(Ball(0.2, 0.1, 0)), "");
  EXPECT_NE(why(Ball(0.5, 0.1, 0)).find("payloads.ball: at = 0.5 m"), std::string::npos);
  EXPECT_NE(why(Ball(0.2, 0, 0)).find("payloads.ball: mass = 0 kg"), std::string::npos);
  Payload flat = Ball(0.2, 0.1, 0);
  flat.inertia_kg_m2.diagonal() << 1e-6, 1e-6, 3e-6;
  EXPECT_NE(why(flat).find("payloads.ball: inertia"), std::string::npos);
  EXPECT_NE(why(Ball(0.2, 0.1, 0), Coupling::kFrozen).find("\"frozen\""), std::string::npos);
}

TEST(Payload, LeavesTheAccountOnceWhateverHoldsTheRoot) {
  // A prescribed root that stands still is a clamped one: the support does no work.
  const auto account = [](const RootMotion& root) {
    Robot robot = Rod(12);
    robot.root = root;
    robot.effects.weight = true;
    robot.effects.gravity_m_s2 = {0, 0, -0.2};
    robot.arms[0].payloads = {Ball(0.3, 0.02, 0)};
    robot.arms[0].payloads[0].drop_s = 0.3;
    return tests::CompleteRun(robot, tests::Settings(Integrator::kSdirk2, 0.001, 0.6));
  };
  const RunResult clamped = account(ClampedRoot{}), held = account(PrescribedRoot{});
  ASSERT_EQ(held.drops.size(), 1u);
  EXPECT_GT(held.drops[0].kinetic_energy_j, 1e-7);
  constexpr double kRoundOff = 1e-6;  // of the drift itself, which is the steps'
  EXPECT_NEAR(held.energy_drift, clamped.energy_drift, kRoundOff);
  for (std::size_t i = 0; i < held.work_names.size(); ++i) {
    if (held.work_names[i] == "root_constraint") {
      EXPECT_NEAR(held.work_j[i], 0.0, 1e-12);
    }
  }
}

}  // namespace
}  // namespace mantle::model
