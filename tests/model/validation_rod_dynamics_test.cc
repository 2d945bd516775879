#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "model/modes.h"
#include "model/motion_modes.h"
#include "tests/support/paper_robot.h"
#include "tests/support/random_values.h"
#include "tests/support/runs.h"

/// Rods in motion: frequencies, momenta and energy of published problems.

namespace mantle::model {
namespace {

using tests::CompleteRun;
using tests::Extrapolate;
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

// A rod of EI = 1, mass 1 per length and length 1, stiff otherwise: Euler-Bernoulli's.
std::vector<double> SlenderFrequencies(int elements, bool clamped) {
  Robot robot;
  robot.name = "rod";
  if (clamped) robot.root = ClampedRoot{};
  Arm arm;
  arm.name = "rod";
  arm.length_m = 1.0;
  arm.radius_base_m = arm.radius_tip_m = 0.01;
  // Stretch does not enter the bending of a straight rod; its lowest frequency is beyond.
  arm.stiffness = (Vector6() << 1e3, 1, 1, 1e5, 1e8, 1e8).finished();
  arm.inertia = (Vector6() << 1e-8, 1e-8, 1e-8, 1, 1, 1).finished();
  arm.elements = elements;
  robot.arms = {arm};
  const Plant plant(robot);
  PlantInputs inputs;
  EvaluateInputs(plant, 0.0, false, &inputs);
  std::vector<double> out;  // each once, though the two planes have it
  for (const MotionMode& mode : MotionModes(plant, InitialState(plant), inputs, clamped ? 8 : 16)) {
    const double w = std::abs(mode.rate_1_s.imag());
    if (w > 1.0 && (out.empty() || w > (1.0 + 1e-5) * out.back())) out.push_back(w);
  }
  return out;
}

TEST(CosseratRod, FirstFrequenciesOfFewElementsAreEulerBernoullis) {
  // Roots of cos b cosh b = -1 and 1; w = b^2. The errors are of fourth order, 1.2 times the
  // measured ones; with masses at nodes alone and bending constant over elements they were 1.1e-2,
  // 2.7e-3 and 6.6e-4 in the first mode clamped, 9.0e-2, 2.5e-2 and 6.4e-3 free.
  const struct {
    bool clamped;
    double root[3];
    int elements;
    double error[3];
  } cases[] = {
      {true, {1.8751040687, 4.6940911330, 7.8547574382}, 5, {2.6e-5, 1.1e-3, 8.1e-3}},
      {true, {1.8751040687, 4.6940911330, 7.8547574382}, 10, {1.6e-6, 6.6e-5, 5.2e-4}},
      {true, {1.8751040687, 4.6940911330, 7.8547574382}, 20, {1.2e-7, 5.0e-6, 3.9e-5}},
      {false, {4.7300407449, 7.8532046241, 10.9956078380}, 5, {9.5e-4, 6.7e-3, 2.4e-2}},
      {false, {4.7300407449, 7.8532046241, 10.9956078380}, 10, {6.6e-5, 5.0e-4, 1.9e-3}},
      {false, {4.7300407449, 7.8532046241, 10.9956078380}, 20, {5.1e-6, 3.9e-5, 1.5e-4}},
  };
  for (const auto& c : cases) {
    const std::vector<double> w = SlenderFrequencies(c.elements, c.clamped);
    ASSERT_GE(w.size(), 3u);
    for (int k = 0; k < 3; ++k) {
      EXPECT_LT(std::abs(w[k] / (c.root[k] * c.root[k]) - 1.0), c.error[k])
          << (c.clamped ? "clamped, " : "free, ") << c.elements << " elements, mode " << k;
    }
  }
}

// The solid's inertia about the base, about its own axes, and the added mass's.
Matrix6 SolidInertia(const Arm& arm, double density, double added_density) {
  Matrix6 out = Matrix6::Zero();
  constexpr int kSteps = 2000;  // Simpson's rule on polynomials of degree 4: error 1e-15
  for (int i = 0; i <= kSteps; ++i) {
    const double x = arm.length_m * i / kSteps;
    const double w = arm.length_m / (3.0 * kSteps) * (i == 0 || i == kSteps ? 1 : i % 2 ? 4 : 2);
    const double r = arm.radius_base_m + (arm.radius_tip_m - arm.radius_base_m) * x / arm.length_m;
    const double area = M_PI * r * r;
    Vector6 section;
    section << 0.5 * r * r, 0.25 * r * r, 0.25 * r * r, 1, 1, 1;
    section *= w * density * area;
    section.tail<2>().array() += w * added_density * area;
    const Matrix6 ad = Adjoint(Inverse(Pose{Eigen::Quaterniond::Identity(), Vector3(x, 0, 0)}));
    out += ad.transpose() * section.asDiagonal() * ad;
  }
  return out;
}

TEST(CosseratRod, RigidMotionHasTheSolidsMomentumAndEnergyWithAnyMesh) {
  constexpr double kRelative = 1e-12;
  tests::RandomValues random(3);
  for (double tip : {0.015, 0.006}) {
    for (bool water : {false, true}) {
      for (int n : {1, 2, 4, 20}) {
        Robot robot;
        robot.name = "arm";
        robot.arms = {tests::PaperArm(n)};
        robot.arms[0].radius_tip_m = tip;
        robot.effects.added_mass = water;
        robot.root_pose = random.AnyPose(1.0);
        robot.root_twist = random.Twist(3.0, 1.0);
        const Plant plant(robot);
        Simulation simulation(plant, Settings(Integrator::kSdirk3, 1e-3, 1e-3));
        const Sample s = simulation.Observe();
        const Pose base = robot.root_pose * robot.arms[0].mount;
        const Vector6 eta = AdjointInverseTimes(robot.arms[0].mount, robot.root_twist);
        const Vector6 p = SolidInertia(robot.arms[0], 1022.0, water ? 1.5 * 1022.0 : 0.0) * eta;
        const Vector6 momentum = AdjointInverseTransposeTimes(base, p);
        EXPECT_LT((s.momentum - momentum).head<3>().norm(), kRelative * momentum.head<3>().norm())
            << n << " elements, tip " << tip;
        EXPECT_LT((s.momentum - momentum).tail<3>().norm(), kRelative * momentum.tail<3>().norm());
        EXPECT_NEAR(s.energies.total(), 0.5 * eta.dot(p), kRelative * eta.dot(p));
      }
    }
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
  // Simo & Vu-Quoc, CMAME 66 (1988) 125, section 5.6: L 10, EA = GA = 1e4, GJ = EI = 500, A rho =
  // 1, J rho = 10, force and moments on the end at the lower right until t = 5.
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

struct Drift {
  double impulse, linear, angular, energy;
};
// Errors of a step: momentum gained until t = 5 against the impulse, then changes until t = 10.
Drift DriftOf(Integrator integrator, double h) {
  const Plant plant(Spaghetti());
  Simulation simulation(plant, Settings(integrator, h, 10));
  EXPECT_TRUE(simulation.AdvanceTo(5.0).ok);
  const Sample start = simulation.Observe();
  EXPECT_TRUE(simulation.AdvanceTo(10.0).ok);
  const Sample end = simulation.Observe();
  const Vector6 change = end.momentum - start.momentum;
  // The impulse of the pulse is 1/2 5 200/10 = 50 along e1.
  return {(start.momentum.tail<3>() - Vector3(50, 0, 0)).norm() / 50.0,
          change.tail<3>().norm() / 50.0, change.head<3>().norm() / start.momentum.head<3>().norm(),
          std::abs(end.energies.total() / start.energies.total() - 1.0)};
}

TEST(CosseratRod, FlyingSpaghettiKeepsMomentumAndEnergy) {
  // Twists are body-fixed, so momentum is kept to the integrator's order, and no better. Measured
  // with RK4 at 2.5 ms: 2e-9, 8e-9, 2e-8, 2e-11; a tenfold margin.
  const Drift d = DriftOf(Integrator::kRk4, 0.0025);
  EXPECT_LT(d.impulse, 2e-8);
  EXPECT_LT(d.linear, 1e-7);
  EXPECT_LT(d.angular, 2e-7);
  EXPECT_LT(d.energy, 5e-10);
}

TEST(CosseratRod, FlyingSpaghettiKeepsThemAtTheOrderOfTheIntegrator) {
  const struct {
    Integrator integrator;
    double step, order;
  } cases[] = {
      {Integrator::kSdirk2, 0.01, 2}, {Integrator::kSdirk3, 0.01, 3}, {Integrator::kRk4, 0.006, 4}};
  for (const auto& c : cases) {
    // Over two halvings: at one of the steps an error may pass through zero.
    const Drift coarse = DriftOf(c.integrator, c.step), fine = DriftOf(c.integrator, 0.25 * c.step);
    const auto order = [](double before, double after) {
      return 0.5 * tests::Order(before, after);
    };
    constexpr double kSlack = 0.5;  // of the order: the last terms of the expansion still show
    EXPECT_GT(order(coarse.impulse, fine.impulse), c.order - kSlack) << c.order;
    EXPECT_GT(order(coarse.linear, fine.linear), c.order - kSlack) << c.order;
    EXPECT_GT(order(coarse.angular, fine.angular), c.order - kSlack) << c.order;
    EXPECT_GT(order(coarse.energy, fine.energy), c.order - kSlack) << c.order;
  }
}

TEST(CosseratRod, TumblingArmInIdealFluidKeepsEnergyAndMomentum) {
  // Erratum 1: without the Munk moment it gains 46 % in 0.5 s. The issue asks for 0.1 %; the start
  // from rigid rotation excites everything up to 2e3 rad/s, so that steps must resolve that.
  constexpr double kRelative = 1e-3;
  Robot robot;
  robot.name = "arm";
  robot.arms = {tests::PaperArm(20)};
  robot.effects.added_mass = true;
  robot.root_twist << 3.0, 4.0, 2.0, 0.3, -0.2, 0.4;
  const Plant plant(robot);
  const auto worst_of = [&](Integrator integrator, double h) {
    Simulation simulation(plant, Settings(integrator, h, 0.5));
    const Sample start = simulation.Observe();
    double worst = 0;
    const RunResult result = simulation.Run([&](const Sample& s) {
      worst = std::max(worst, std::abs(s.energies.total() / start.energies.total() - 1.0));
      return true;
    });
    EXPECT_TRUE(result.ok) << result.reason;
    EXPECT_GT(result.last.energies.elastic_arms_j, 0.1 * start.energies.total());  // it bends
    EXPECT_LT((result.last.momentum - start.momentum).norm(), kRelative * start.momentum.norm());
    return worst;
  };
  EXPECT_LT(worst_of(Integrator::kSdirk2, 2.5e-4), kRelative);
  EXPECT_LT(worst_of(Integrator::kRk4, 1.25e-4), 0.1 * kRelative);
}

TEST(Cable, StiffReeledCableIsStableAtTenMilliseconds) {
  // [physics.md] 2: held constant over a step it is unstable above 370 N/m at 10 ms. Here 1e5 N/m
  // with 100 N s/m, drawn in by 20 mm in 0.4 s, then held.
  Robot robot = UniformArm(20, true);
  robot.effects.viscosity = robot.effects.drag = true;
  const TableSchedule draw{{0.1, 0.5}, {0.0, -0.02}};
  robot.arms[0].cables = {{"winch", 0.6, 0.0, 0.0, 0.42, ReeledLength{draw, 1e5, 100.0}, {}}};
  const Plant plant(robot);
  const auto tip_after = [&](double h, long allowed_rejections) {
    RunSettings settings = Settings(Integrator::kSdirk2, h, 2.0);
    settings.output_interval_s = h;
    Simulation simulation(plant, settings);
    double tension = 0, previous = 0, jump = 0;
    const RunResult result = simulation.Run([&](const Sample& s) {
      tension = s.cable_tension_n[0];
      if (s.time_s > 0.6) {  // held: the cable's length stays on the reel plus its stretch
        EXPECT_NEAR(s.cable_length_m[0], 0.40 + tension / 1e5, 3e-6) << s.time_s;
        EXPECT_GT(tension, 0.5);
        EXPECT_LT(tension, 1.5);
        jump = std::max(jump, std::abs(tension - previous));
      }
      previous = tension;
      return true;
    });
    EXPECT_TRUE(result.ok) << result.reason;
    // The rod swings at 5 rad/s: 10 % per 10 ms without chatter
    EXPECT_LT(jump, 10.0 * h);
    EXPECT_LE(result.counters.rejected, allowed_rejections) << h;
    return result.last.tips[0].position;
  };
  // Steps are tried again shorter where the cable goes taut or slack within them.
  const Vector3 coarse = tip_after(0.01, 20), fine = tip_after(0.001, 20);
  EXPECT_LT((coarse - fine).norm(), 1e-3 * 0.42);
}

}  // namespace
}  // namespace mantle::model
