#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "model/rigid_body.h"
#include "tests/support/paper_robot.h"
#include "tests/support/runs.h"

/// The whole vehicle: momenta, terminal speeds, equilibrium at rest, and the two couplings.

namespace mantle::model {
namespace {

using tests::EveryEffect;
using tests::PaperRobot;
using tests::Settings;

constexpr double kPi = std::numbers::pi;

TEST(Vehicle, ConeSinksAtItsTerminalVelocity) {
  // Weight less buoyancy against 1/2 rho_w C A v^2; the approach is a tanh with time constant
  // m / (2 sqrt(W k)) = 0.4 s, gone after 15 of them.
  Robot robot;
  robot.name = "cone";
  robot.rigid_body = RigidBody{"cone", Cone{0.015, 0.112, 2500.0}};
  robot.effects.weight = robot.effects.buoyancy = true;
  robot.effects.named.Set(RigidDrag{});
  const Plant plant(robot);
  Simulation simulation(plant, Settings(Integrator::kSdirk2, 0.01, 6.0));
  ASSERT_TRUE(simulation.AdvanceTo(6.0).ok);
  const double volume = RigidVolume(*robot.rigid_body), area = kPi * 0.015 * 0.015;
  const double speed = std::sqrt((2500 - 1022) * volume * 9.81 / (0.5 * 1022 * area));
  EXPECT_NEAR(simulation.state().velocity(5), -speed, 1e-7 * speed);
}

TEST(Vehicle, UniformArmSinksSidewaysAtItsTerminalVelocity) {
  // Per length (rho_b - rho_w) pi h^2 g = rho_w h C_y v^2; nothing bends it.
  Robot robot;
  robot.name = "arm";
  robot.arms = {tests::PaperArm(10)};
  robot.arms[0].mount = Pose::Identity();  // along x, falls along -z
  robot.arms[0].radius_base_m = robot.arms[0].radius_tip_m = 0.01;
  robot.arms[0].material.density_kg_m3 = 1500;
  robot.effects.weight = robot.effects.buoyancy = robot.effects.drag = robot.effects.added_mass =
      true;
  const Plant plant(robot);
  Simulation simulation(plant, Settings(Integrator::kSdirk2, 0.01, 4.0));
  ASSERT_TRUE(simulation.AdvanceTo(4.0).ok);
  const double speed = std::sqrt(478.0 * kPi * 0.01 * 9.81 / (1022 * 2.5));
  const Sample s = simulation.Observe();
  EXPECT_NEAR(s.root_twist(5), -speed, 1e-7 * speed);
  EXPECT_NEAR(s.tip_twists[0](5), -speed, 1e-7 * speed);
  EXPECT_LT(s.energies.elastic_arms_j, 1e-20);
}

TEST(Vehicle, MantleAndConeSinkAtTheDragOfTheirWidestSection) {
  // -1/2 rho_w C_d pi max(r)^2 V^2 on the profile as the drag deforms it; max(r) is read off. (A
  // cone of 2000 kg/m^3 sinks so fast that the mantle is turned inside out.)
  Robot robot = PaperRobot(4, 32);
  robot.arms.clear();
  robot.rigid_body->shape = Cone{0.015, 0.112, 1100.0};
  robot.effects.weight = robot.effects.buoyancy = robot.effects.drag = true;
  robot.effects.viscosity = robot.effects.added_mass = true;
  const Plant plant(robot);
  Simulation simulation(plant, Settings(Integrator::kSdirk2, 0.01, 8.0));
  const StepStatus status = simulation.AdvanceTo(8.0);
  ASSERT_TRUE(status.ok) << status.reason;
  double widest = 0;
  for (const Vector3& q : simulation.state().shape) widest = std::max(widest, q(0));
  const double weight = (1100 - 1022) * RigidVolume(*robot.rigid_body) * 9.81;
  const double speed = std::sqrt(weight / (0.5 * 1022 * 1.7 * kPi * widest * widest));
  EXPECT_NEAR(simulation.state().velocity(5), -speed, 1e-6 * speed);
}

TEST(Vehicle, NeutralBodyAtRestStaysAtRestForAMillionSteps) {
  // Every effect on, at an arbitrary pose: round-off of the reference shape is all that could move
  // it. A small mesh and backward Euler make a million steps affordable.
  Robot robot = PaperRobot(2, 8);
  robot.mantle->stations_m.clear();
  robot.effects = EveryEffect();
  robot.root_pose.rotation = ExpSO3(Vector3(0.7, -0.4, 1.1));
  robot.root_pose.position = {0.3, -0.2, 0.5};
  const Plant plant(robot);
  RunSettings settings = Settings(Integrator::kBackwardEuler, 0.01, 1e4);
  settings.account_energy = false;
  settings.stepper.newton_tolerance = 1e-9;
  Simulation simulation(plant, settings);
  const Pose tip = AbsolutePose(plant, simulation.state(), 0, 2);
  ASSERT_TRUE(simulation.AdvanceTo(1e4).ok);
  EXPECT_GE(simulation.counters().steps, 1000000);
  EXPECT_EQ(simulation.counters().rejected, 0);
  constexpr double kMoved_m = 1e-9;  // 1e4 s at 1e-13 m/s: residual stresses of 1e-16 relative
  const Pose now = AbsolutePose(plant, simulation.state(), 0, 2);
  EXPECT_LT((now.position - tip.position).norm(), kMoved_m);
  EXPECT_LT((simulation.state().pose[0].position - robot.root_pose.position).norm(), kMoved_m);
  EXPECT_LT(simulation.state().velocity.cwiseAbs().maxCoeff(), 1e-10);
}

Robot Tumbling(double stiffer, Coupling coupling) {
  Robot robot = PaperRobot(8, 16);
  robot.arms[0].material.young_pa *= stiffer;
  robot.arms[0].material.viscosity_pa_s *= std::sqrt(stiffer);
  robot.mantle->material.young_pa *= stiffer;
  robot.mantle->material.viscosity_pa_s *= std::sqrt(stiffer);
  robot.effects.viscosity = true;
  robot.effects.added_mass = true;
  robot.coupling = coupling;
  robot.root_twist << 1.0, 0.7, 2.0, 0.1, 0.05, 0.2;
  return robot;
}

TEST(Vehicle, ExactCouplingTendsToFrozenInTheStiffLimit) {
  // A rigid star is where both say the same ([physics.md] 4); the difference falls with the
  // deformation, that is, inversely with stiffness.
  const auto difference = [](double stiffer) {
    Pose end[2];
    for (Coupling coupling : {Coupling::kExact, Coupling::kFrozen}) {
      const Plant plant(Tumbling(stiffer, coupling));
      Simulation simulation(plant, Settings(Integrator::kSdirk3, 0.005, 1.0));
      EXPECT_TRUE(simulation.AdvanceTo(1.0).ok);
      end[static_cast<int>(coupling)] = simulation.state().pose[0];
    }
    const Vector6 d = LogSE3(Inverse(end[0]) * end[1]);
    return std::max(d.head<3>().norm(), d.tail<3>().norm() / 0.532);
  };
  const double soft = difference(1.0), stiff = difference(1e3), stiffer = difference(1e4);
  EXPECT_GT(soft, 0.1);  // where they differ, they differ much
  EXPECT_LT(stiff, 2e-3);
  EXPECT_LT(stiffer, 3e-4);
}

TEST(Vehicle, VibratingMantleOnAFreeRootInVacuoKeepsMomentaAndEnergy) {
  Robot robot = PaperRobot(8, 32);
  robot.mantle->initial_radial_speed_m_s = 0.2;
  robot.root_twist << 1.0, 0.7, 2.0, 0.1, 0.05, 0.2;
  const Plant plant(robot);
  double previous_energy = 0;
  for (double h : {1e-4, 5e-5}) {
    Simulation simulation(plant, Settings(Integrator::kRk4, h, 0.2));
    const Sample start = simulation.Observe();
    ASSERT_TRUE(simulation.AdvanceTo(0.2).ok);
    const Sample end = simulation.Observe();
    EXPECT_GT(end.energies.elastic_mantle_j, 0.01 * start.energies.total());  // it does vibrate
    const double energy = std::abs(end.energies.total() / start.energies.total() - 1.0);
    const double momentum = (end.momentum - start.momentum).norm() / start.momentum.norm();
    EXPECT_LT(energy, 1e-7 * std::pow(h / 5e-5, 4)) << h;
    EXPECT_LT(momentum, 1e-12) << h;  // the root turns slowly: (w h)^4 is round-off
    if (h < 7e-5) {
      EXPECT_GT(tests::Order(previous_energy, energy), 3.0);
    }
    previous_energy = energy;
  }
}

TEST(Vehicle, CablesThatStartAndEndOnItDoNotMoveItsMomentum) {
  // Cable and spokes pull in turn, in vacuo: all six momenta stay zero, the centre of mass in
  // place.
  Robot robot = PaperRobot(10, 16);
  robot.effects.viscosity = true;
  robot.arms[0].cables = {
      {"a", 0.6, 0.4, 0.5, 0.42, GivenTension{TableSchedule{{0, 0.2, 0.5}, {0, 0.8, 0}}}, {}},
      {"b", 0.6, 2.5, 0, 0.30, ReeledLength{TableSchedule{{0, 0.3}, {0, -0.01}}, 500, 1}, {}}};
  robot.mantle->spokes = {
      {"s", 0.025, 0.105, 8, GivenTension{TableSchedule{{0.1, 0.3}, {0, 0.6}}}}};
  const Plant plant(robot);
  Simulation simulation(plant, Settings(Integrator::kSdirk3, 0.0025, 0.6));
  const Sample start = simulation.Observe();
  double moved = 0, largest = 0, turned = 0;
  const RunResult result = simulation.Run([&](const Sample& s) {
    moved = std::max(moved, (s.centre_of_mass_m - start.centre_of_mass_m).norm());
    largest = std::max(largest, s.momentum.norm());
    turned = std::max(turned, s.root_twist.head<3>().norm());
    return true;
  });
  ASSERT_TRUE(result.ok) << result.reason;
  EXPECT_GT(turned, 0.5);  // the root reacts
  // 0.8 N for 0.5 s would be 0.2 N s: kept to the method's error at 2.5 ms
  EXPECT_LT(largest, 2e-5);
  EXPECT_LT(moved, 1e-5);
}

TEST(Vehicle, TrajectoriesAreFrameInvariant) {
  Robot robot = PaperRobot(8, 16);
  robot.effects = EveryEffect();
  robot.effects.weight = robot.effects.buoyancy = false;
  robot.mantle->strips = {{"pulse", 0.025, 0.105, TriangularSchedule{0, 200, 0.66, 0}}};
  robot.arms[0].cables = {{"a", 0.6, 0.4, 0, 0.42, GivenTension{ConstantSchedule{0.3}}, {}}};
  robot.root_twist << 0.1, 0.2, 0.3, 0.1, 0, 0.1;
  const auto end = [](const Robot& r) {
    const Plant plant(r);
    Simulation simulation(plant, Settings(Integrator::kSdirk2, 0.005, 1.0));
    EXPECT_TRUE(simulation.AdvanceTo(1.0).ok);
    return simulation.Observe();
  };
  const Sample here = end(robot);
  const Pose h{ExpSO3(Vector3(1.0, -2.0, 0.5)), Vector3(3, -4, 5)};
  robot.root_pose = h;
  const Sample there = end(robot);
  constexpr double kRoundOff = 1e-9;  // round-off of positions of 7 m over 200 steps
  EXPECT_LT(((h * here.root).position - there.root.position).norm(), kRoundOff);
  EXPECT_LT(((h * here.tips[0]).position - there.tips[0].position).norm(), kRoundOff);
  EXPECT_LT((here.root_twist - there.root_twist).norm(), 100 * kRoundOff);
  EXPECT_NEAR(here.volume_m3, there.volume_m3, kRoundOff * here.volume_m3);
}

TEST(Vehicle, CurrentOnlyCarriesANeutralVehicleAlong) {
  // Swimming in a uniform current is swimming in still water, seen from a moving frame.
  Robot robot = PaperRobot(8, 16);
  robot.effects = EveryEffect();
  robot.mantle->strips = {{"pulse", 0.025, 0.105, TriangularSchedule{0, 200, 0.66, 0}}};
  const auto end = [](const Robot& r) {
    const Plant plant(r);
    Simulation simulation(plant, Settings(Integrator::kSdirk2, 0.005, 0.5));
    EXPECT_TRUE(simulation.AdvanceTo(0.5).ok);
    return simulation.Observe();
  };
  const Vector3 current(0.2, -0.1, 0.3);
  Robot carried = robot;
  carried.effects.current_m_s = current;
  carried.root_twist.tail<3>() = current;
  const Sample still = end(robot), moving = end(carried);
  EXPECT_LT((still.root.position + 0.5 * current - moving.root.position).norm(), 1e-9);
  EXPECT_LT((still.tips[0].position + 0.5 * current - moving.tips[0].position).norm(), 1e-9);
}

}  // namespace
}  // namespace mantle::model
