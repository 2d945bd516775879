#include "model/muscle.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "model/energy.h"
#include "model/simulation.h"
#include "model/statics.h"
#include "tests/support/paper_robot.h"
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
  robot.arms[0].radius_tip_m = robot.arms[0].radius_base_m;
  return robot;
}

double BendingOf(const Arm& arm) {
  return arm.material.young_pa * pi / 4 * std::pow(arm.radius_base_m, 4);
}

TEST(Muscle, SteadyMomentBendsTheRodIntoACircle) {  // kappa = m / EI, without any load
  Robot robot = Rod(10);
  MuscleWave wave = tests::Wave("bend", {0, 0, 1});
  wave.frequency_hz = ConstantSchedule{0};
  wave.wave_length_m = ConstantSchedule{1e12};
  wave.phase_rad = pi / 2;
  const double kappa = 2.0;
  wave.amplitude_n_m = ConstantSchedule{kappa * BendingOf(robot.arms[0])};
  robot.arms[0].muscles = {wave};
  const StaticsResult r = tests::Equilibrium(robot, 2);
  const Pose tip = r.state.pose.back();
  const double angle = kappa * 0.42;
  EXPECT_NEAR(tip.position.y(), (1 - std::cos(angle)) / kappa, 1e-9);
  EXPECT_NEAR(tip.position.x(), std::sin(angle) / kappa, 1e-9);
  EXPECT_EQ(r.stability.unstable_directions, 0);
  EXPECT_TRUE(r.without_potential.empty());
}

TEST(Muscle, StrainFollowsTheWaveAlongTheArm) {  // kappa(X) = m(X, t) / EI at rest
  Robot robot = Rod(60);
  MuscleWave wave = tests::Wave("bend", {0, 0, 1});
  wave.wave_length_m = TableSchedule{{0, 1}, {0.2, 0.3}};
  wave.frequency_hz = TableSchedule{{0, 1}, {1.0, 3.0}};
  wave.amplitude_n_m = SineSchedule{0.3 * BendingOf(robot.arms[0]), 0.4, 0.0, 0.0, 0.0};
  wave.envelope = {{0.1, ConstantSchedule{0.0}}, {0.42, TableSchedule{{0, 1}, {0, 2}}}};
  robot.arms[0].muscles = {wave};
  const Plant plant(robot);
  StaticsSettings settings;
  settings.time_s = 0.5;
  const StaticsResult r = SolveStatics(plant, settings);
  ASSERT_TRUE(r.ok) << r.reason;
  const double turns = 1.0 * 0.5 + 0.5 * 2.0 * 0.25;  // integral of the frequency
  constexpr double kMean = 2e-4;                      // wave over an element, (2 pi 7 mm / 0.25)^4
  for (int i = 0; i < 60; ++i) {
    const double from = plant.rods[0].x_m[i], to = plant.rods[0].x_m[i + 1];
    double mean = 0;
    constexpr int n = 200;
    for (int k = 0; k < n; ++k) {
      const double x = from + (k + 0.5) / n * (to - from);
      const double envelope = 1.0 * std::max(0.0, (x - 0.1) / 0.32);
      mean += 0.3 * std::sin(2 * pi * 0.4 * 0.5) * envelope *
              std::sin(2 * pi * (turns - x / 0.25) + 0.7) / n;
    }
    const Vector6 d =
        LogSE3(Inverse(r.state.pose[plant.ArmPose(0, i)]) * r.state.pose[plant.ArmPose(0, i + 1)]);
    EXPECT_NEAR(d(2) / (to - from), mean, kMean) << i;
  }
}

TEST(Muscle, WorkIsAccountedAndVehicleKeepsItsMomentum) {
  Robot robot;
  robot.name = "swimmer";
  robot.arms = {tests::PaperArm(12)};
  robot.rigid_body = tests::PaperCone();
  robot.arms[0].muscles = {tests::Wave("bend", {0, 1, 1})};
  robot.arms[0].muscles[0].amplitude_n_m = CubicSchedule{{0.0, 0.2}, {0.0, 2e-3}};
  RunSettings settings = tests::Settings(Integrator::kSdirk3, 0.002, 0.4);
  const RunResult r = tests::CompleteRun(robot, settings);
  ASSERT_EQ(r.work_names, std::vector<std::string>{"muscle.arm.bend"});
  EXPECT_GT(r.work_j[0], 1e-6);
  EXPECT_LT(r.power_balance_residual, 1e-11);
  constexpr double kThirdOrder = 3e-5;  // steps of 2 ms
  EXPECT_LT(r.energy_drift, kThirdOrder);
  // Internal: nothing else acts, so that momentum stays zero but for the steps' errors.
  const double scale = 0.2 * r.last.tip_twists[0].tail<3>().norm();
  EXPECT_LT(r.last.momentum.tail<3>().norm(), 1e-5 * scale);
}

TEST(Muscle, WaveTravelsToTheTipAndSwimsTheOtherWay) {
  // Undulation with the wave towards the tip drives a slender swimmer head first (Gray & Hancock
  // 1955: lateral drag above axial). x of the arm's base frame is -e3.
  Robot robot;
  robot.name = "eel";
  robot.arms = {tests::PaperArm(16)};
  robot.rigid_body = RigidBody{"head", Cone{0.015, 0.03, 1022}};
  robot.effects.drag = robot.effects.added_mass = robot.effects.viscosity = true;
  const auto way = [&](double frequency) {
    MuscleWave wave = tests::Wave("bend", {0, 0, 1});
    wave.amplitude_n_m = CubicSchedule{{0.0, 0.3}, {0.0, 4e-3}};
    wave.wave_length_m = ConstantSchedule{0.42};
    wave.frequency_hz = ConstantSchedule{frequency};
    robot.arms[0].muscles = {wave};
    return tests::CompleteRun(robot, tests::Settings(Integrator::kSdirk2, 0.01, 2.5))
        .last.root.position.z();
  };
  EXPECT_GT(way(1.5), 0.02);
  EXPECT_LT(way(-1.5), 0.5 * way(1.5));
}

TEST(Muscle, ReducedModelMovesAsThePlant) {
  Robot robot = Rod(24);
  robot.effects.viscosity = robot.effects.drag = robot.effects.added_mass = true;
  MuscleWave wave = tests::Wave("bend", {0, 0, 1});
  wave.amplitude_n_m = CubicSchedule{{0.0, 0.3}, {0.0, 8e-3}};
  robot.arms[0].muscles = {wave};
  const double duration = 0.6;
  const RunResult plant =
      tests::CompleteRun(robot, tests::Settings(Integrator::kSdirk3, 0.005, duration));
  const RunResult r = tests::EightSegmentRun(robot, duration);
  constexpr double kEightSegments = 0.01;  // of the length
  EXPECT_GT((plant.last.tips[0].position - Vector3(0.42, 0, 0)).norm(), 0.01);
  EXPECT_LT((plant.last.tips[0].position - r.last.tips[0].position).norm(), kEightSegments * 0.42);
}

}  // namespace
}  // namespace mantle::model
