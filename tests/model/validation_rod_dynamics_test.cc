#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "model/modes.h"
#include "tests/support/paper_robot.h"
#include "tests/support/runs.h"

/// Rods in motion: frequencies, momenta and energy of published problems.

namespace mantle::model {
namespace {

using tests::Extrapolate;
using tests::Run;
using tests::Settings;

Robot UniformArm(int elements, bool added_mass) {
  Robot robot;
  robot.name = "arm";
  robot.root = ClampedRoot{};
  robot.arms = {tests::PaperArm(elements)};
  robot.arms[0].mount = Pose::Identity();
  robot.arms[0].radius_base_m = robot.arms[0].radius_tip_m = 0.01;
  robot.effects.added_mass = added_mass;
  return robot;
}

struct Frequencies {
  std::vector<double> bending, axial, torsion;
};
// Sorted by what moves most; the two equal bending planes are listed once each.
Frequencies FrequenciesOf(int elements, bool added_mass) {
  const Robot robot = UniformArm(elements, added_mass);
  const Plant plant(robot);
  Frequencies f;
  for (const Mode& mode : VibrationModes(plant, InitialState(plant), 12)) {
    const Vector6 tip = mode.shape.segment<6>(plant.ArmVelocity(0, elements));
    const double twist = 0.01 * std::abs(tip(0)), stretch = std::abs(tip(3));
    const double bend = tip.tail<2>().norm();
    auto& kind = bend > twist && bend > stretch ? f.bending : twist > stretch ? f.torsion : f.axial;
    kind.push_back(mode.angular_frequency_rad_s);
  }
  return f;
}

TEST(CosseratRod, FrequenciesMatchTimoshenko) {
  // Timoshenko cantilever (Huang, J. Appl. Mech. 28 (1961) 579) with shear factor 1: values of the
  // issue, to seven digits.
  constexpr double kRelative = 1e-5;  // h^4 after extrapolation, on the third bending mode
  const Frequencies coarse = FrequenciesOf(60, false), fine = FrequenciesOf(120, false);
  const double bending[] = {1.032915, 6.435400, 17.853218};
  for (int k = 0; k < 3; ++k) {
    for (int plane : {0, 1}) {
      const double w = Extrapolate(coarse.bending[2 * k + plane], fine.bending[2 * k + plane]);
      EXPECT_NEAR(w, bending[k], kRelative * bending[k]) << k << " plane " << plane;
    }
  }
  EXPECT_NEAR(Extrapolate(coarse.axial[0], fine.axial[0]), 38.80087, kRelative * 38.8);
  EXPECT_NEAR(Extrapolate(coarse.torsion[0], fine.torsion[0]), 27.43636, kRelative * 27.4);
}

TEST(CosseratRod, FrequenciesInWaterMatchTimoshenkoWithAddedMass) {
  constexpr double kRelative = 1e-5;
  const Frequencies coarse = FrequenciesOf(60, true), fine = FrequenciesOf(120, true);
  const double bending[] = {0.653401, 4.075631, 11.326993};
  for (int k = 0; k < 3; ++k) {
    const double w = Extrapolate(coarse.bending[2 * k], fine.bending[2 * k]);
    EXPECT_NEAR(w, bending[k], kRelative * bending[k]) << k;
  }
}

TEST(CosseratRod, ReleasedFromModeOneItSwingsAtItsFrequency) {
  // The clock of the speed case: counts zero crossings of the tip over 20 periods.
  Robot robot;
  robot.name = "rod";
  robot.root = ClampedRoot{};
  robot.arms = {tests::PaperArm(16)};
  Arm& arm = robot.arms[0];
  arm.mount = Pose::Identity();
  arm.length_m = 1.0;
  arm.radius_base_m = arm.radius_tip_m = 0.02;
  arm.material = {1e5, 0.0, 0.0, 2000.0};
  arm.initial_mode1_tip_speed_m_s = 0.005;
  const Plant plant(robot);
  const double w = VibrationModes(plant, InitialState(plant), 1)[0].angular_frequency_rad_s;
  const double period = 2 * M_PI / w;
  RunSettings settings = Settings(Integrator::kSdirk2, period / 60, 20.0 * period);
  settings.output_interval_s = settings.step_s;
  Simulation simulation(plant, settings);
  std::vector<double> crossings;
  double last_y = 0, last_t = 0, largest = 0;
  const RunResult result = simulation.Run([&](const Sample& s) {
    const double y = s.tips[0].position.y();
    if (last_y < 0 && y >= 0) {
      crossings.push_back(last_t + (s.time_s - last_t) * last_y / (last_y - y));
    }
    largest = std::max(largest, std::abs(y));
    last_y = y;
    last_t = s.time_s;
    return true;
  });
  ASSERT_TRUE(result.ok) << result.reason;
  ASSERT_GE(crossings.size(), 18u);
  const double measured =
      (crossings.back() - crossings.front()) / static_cast<double>(crossings.size() - 1);
  EXPECT_NEAR(measured, period, 0.002 * period);  // SDIRK2: phase error (w h)^2/20 = 5e-4
  EXPECT_NEAR(largest, 0.005 / w, 0.02 * 0.005 / w);
}

Robot Spaghetti() {
  // Simo & Vu-Quoc, CMAME 66 (1988) 125, section 5.6: L 10, EA = GA = 1e4, GJ = EI = 500, A rho = 1,
  // J rho = 10, force and moments on the end at the lower right until t = 5.
  Robot robot;
  robot.name = "spaghetti";
  Arm arm;
  arm.name = "spaghetti";
  arm.length_m = 10;
  arm.radius_base_m = arm.radius_tip_m = 0.1;
  arm.material = {1, 0, 0, 1};
  arm.stiffness = (Vector6() << 500, 500, 500, 1e4, 1e4, 1e4).finished();
  arm.inertia = (Vector6() << 20, 10, 10, 1, 1, 1).finished();
  arm.elements = 10;
  // from (6, 0, 0) to (0, 8, 0); the load acts at the start
  arm.mount.position = {6, 0, 0};
  arm.mount.rotation = ExpSO3(Vector3(0, 0, std::atan2(8.0, -6.0)));
  const TableSchedule pulse{{0, 2.5, 5}, {0, 200, 0}};
  Vector6 wrench;
  wrench << 0, -0.5, -1.0, 0.1, 0, 0;
  arm.points = {{"end", 0, wrench, LoadFrame::kWorld, pulse}};
  robot.arms = {arm};
  return robot;
}

TEST(CosseratRod, FlyingSpaghettiKeepsMomentumAndEnergyAfterThePulse) {
  const Plant plant(Spaghetti());
  double previous_angular = 0, previous_energy = 0;
  for (double h : {0.02, 0.01}) {
    Simulation simulation(plant, Settings(Integrator::kSdirk3, h, 10));
    ASSERT_TRUE(simulation.AdvanceTo(5.0).ok);
    const Sample start = simulation.Observe();
    // The impulse of the pulse, 1/2 5 200/10 along e1: linear loads are integrated exactly.
    EXPECT_NEAR(start.momentum(3), 50.0, 1e-6);
    EXPECT_LT(start.momentum.tail<2>().norm(), 1e-6);
    ASSERT_TRUE(simulation.AdvanceTo(10.0).ok);
    const Sample end = simulation.Observe();
    EXPECT_LT((end.momentum.tail<3>() - start.momentum.tail<3>()).norm(), 1e-6);
    const double angular = (end.momentum.head<3>() - start.momentum.head<3>()).norm() /
                           start.momentum.head<3>().norm();
    const double energy =
        std::abs(end.energies.total() - start.energies.total()) / start.energies.total();
    EXPECT_LT(angular, 2e-4 * std::pow(h / 0.01, 3)) << h;
    EXPECT_LT(energy, 1e-2 * std::pow(h / 0.01, 3)) << h;
    if (h < 0.015) {
      EXPECT_GT(tests::Order(previous_angular, angular), 2.0);  // SDIRK3: towards 3
      EXPECT_GT(tests::Order(previous_energy, energy), 2.0);
    }
    previous_angular = angular;
    previous_energy = energy;
  }
}

TEST(CosseratRod, TumblingArmInIdealFluidKeepsEnergyAndMomentum) {
  // Erratum 1: without the Munk moment it gains 46 % in 0.5 s. The issue asks for 0.1 %.
  constexpr double kRelative = 1e-3;
  Robot robot;
  robot.name = "arm";
  robot.arms = {tests::PaperArm(20)};
  robot.effects.added_mass = true;
  robot.root_twist << 3.0, 4.0, 2.0, 0.3, -0.2, 0.4;
  const Plant plant(robot);
  Simulation simulation(plant, Settings(Integrator::kSdirk3, 1e-3, 0.5));
  const Sample start = simulation.Observe();
  double worst = 0;
  const RunResult result = simulation.Run([&](const Sample& s) {
    worst = std::max(worst, std::abs(s.energies.total() / start.energies.total() - 1.0));
    return true;
  });
  ASSERT_TRUE(result.ok) << result.reason;
  EXPECT_LT(worst, kRelative);
  EXPECT_GT(result.last.energies.elastic_arms_j, 0.02 * start.energies.total());  // it bends
  EXPECT_LT((result.last.momentum - start.momentum).norm(), kRelative * start.momentum.norm());
}

TEST(Cable, StiffReeledCableIsStableAtTenMilliseconds) {
  // [physics.md] 2: held constant over a step it is unstable above 370 N/m at 10 ms. Here 1e5 N/m
  // with 100 N s/m, drawn in by 20 mm in 0.4 s, then held.
  Robot robot = UniformArm(20, true);
  robot.effects.viscosity = robot.effects.drag = true;
  const TableSchedule draw{{0.1, 0.5}, {0.0, -0.02}};
  robot.arms[0].cables = {{"winch", 0.6, 0.0, 0.0, 0.42, ReeledLength{draw, 1e5, 100.0}}};
  const Plant plant(robot);
  Simulation simulation(plant, Settings(Integrator::kSdirk2, 0.01, 3.0));
  double previous = 0, jump = 0;
  const RunResult result = simulation.Run([&](const Sample& s) {
    if (s.time_s > 2.0) jump = std::max(jump, std::abs(s.cable_tension_n[0] - previous));
    previous = s.cable_tension_n[0];
    return true;
  });
  ASSERT_TRUE(result.ok) << result.reason;
  EXPECT_EQ(result.counters.rejected, 0);
  const double length = 0.42 - 0.02 + previous / 1e5;  // reel plus the cable's stretch
  EXPECT_NEAR(result.last.cable_length_m[0], length, 1e-6);
  EXPECT_GT(previous, 0.05);
  EXPECT_LT(previous, 5.0);
  EXPECT_LT(jump, 0.02 * previous);  // settled: no chatter from step to step
  // and it is where statics says
  robot.arms[0].cables[0].drive = ReeledLength{ConstantSchedule{-0.02}, 1e5, 100.0};
  const Vector3 still = tests::Equilibrium(robot, 20).path.back().tips_m[0];
  EXPECT_LT((result.last.tips[0].position - still).norm(), 0.01 * 0.42);  // slow last creep
}

}  // namespace
}  // namespace mantle::model
