#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "model/simulation.h"
#include "tests/support/paper_robot.h"
#include "tests/support/runs.h"

// Reeled cables in implicit steps: however stiff the reel, the steps hold and the cable follows it.

namespace mantle::model {
namespace {

constexpr double kSofter_n_m = 1e3, kStiffest_n_m = 1e9;
constexpr double kTakenIn_m = 0.02;

// The arm in water, one cable reeled in within half a second, held, and paid out again.
Robot ReeledArm(double stiffness_n_m) {
  Robot robot;
  robot.name = "arm";
  robot.root = ClampedRoot{};
  robot.arms = {tests::PaperArm(12)};
  robot.effects.drag = robot.effects.added_mass = robot.effects.viscosity = true;
  TableSchedule table;
  table.time_s = {0, 0.5, 1.0, 1.5};
  table.value = {0, -kTakenIn_m, -kTakenIn_m, 0};
  robot.arms[0].cables = {{"pull", 0.6, 0, 0, 0.42, ReeledLength{table, stiffness_n_m, 10}, {}}};
  return robot;
}

struct Outcome {
  RunResult result;
  std::vector<Sample> samples;
};

Outcome Reel(const Robot& robot, double step_s) {
  const Plant plant(robot);
  RunSettings settings;
  settings.duration_s = 2;
  settings.step_s = step_s;
  settings.output_interval_s = 0.05;
  Outcome out;
  Simulation simulation(plant, settings);
  out.result = simulation.Run([&](const Sample& s) {
    out.samples.push_back(s);
    return true;
  });
  EXPECT_TRUE(out.result.ok) << out.result.reason;
  return out;
}

const Sample& At(const Outcome& run, double time_s) {
  return *std::min_element(run.samples.begin(), run.samples.end(),
                           [&](const Sample& a, const Sample& b) {
                             return std::abs(a.time_s - time_s) < std::abs(b.time_s - time_s);
                           });
}

TEST(ReelTensions, AStepCostsTheSameFromSoftToStiff) {
  const long soft = Reel(ReeledArm(kSofter_n_m), 0.01).result.counters.evaluations;
  for (double k = kSofter_n_m; k <= kStiffest_n_m; k *= 100) {
    const StepCounters c = Reel(ReeledArm(k), 0.01).result.counters;
    constexpr long kMostRejected = 10;  // where the cable goes slack or taut within a step
    EXPECT_LE(c.rejected, kMostRejected) << k << " N/m";
    EXPECT_LE(c.evaluations, 2 * soft) << k << " N/m";
  }
}

TEST(ReelTensions, TheCableFollowsTheReelAndItsTensionTendsToTheRigidOne) {
  const Outcome rigid = Reel(ReeledArm(kStiffest_n_m), 0.01);
  const double rest = rigid.samples.front().cable_length_m[0];
  for (double k : {1e5, 1e6, 1e7, 1e8}) {
    const Outcome run = Reel(ReeledArm(k), 0.01);
    for (double t : {0.6, 0.7, 0.9}) {  // held since 0.5 s
      const double tension = At(rigid, t).cable_tension_n[0];
      EXPECT_GT(tension, 0.01);
      EXPECT_NEAR(At(run, t).cable_length_m[0], rest - kTakenIn_m + tension / k,
                  1e-7 + 0.01 * tension / k)
          << k << " N/m, " << t << " s";
      constexpr double kShare = 2e-3;  // what the iteration leaves, and 1e5 N/m against rigid
      EXPECT_NEAR(At(run, t).cable_tension_n[0], tension, kShare * tension)
          << k << " N/m, " << t << " s";
    }
  }
}

TEST(ReelTensions, ASlackCableCarriesNothing) {
  for (double k : {1e4, 1e9}) {
    const Outcome run = Reel(ReeledArm(k), 0.01);
    for (const Sample& s : run.samples) EXPECT_GE(s.cable_tension_n[0], 0.0) << s.time_s;
    EXPECT_LT(At(run, 2.0).cable_tension_n[0], 1e-3) << k;
  }
}

TEST(ReelTensions, CoarseStepsAgreeWithFineOnes) {
  const Outcome coarse = Reel(ReeledArm(1e7), 0.01), fine = Reel(ReeledArm(1e7), 0.001);
  for (double t : {0.3, 0.9, 1.3, 1.9}) {
    constexpr double kTolerance_m = 5e-4;  // a thousandth of the arm: order 2, and a switch inside
    EXPECT_LT((At(coarse, t).tips[0].position - At(fine, t).tips[0].position).norm(), kTolerance_m)
        << t;
  }
}

TEST(ReelTensions, ARestartWhileTautGivesTheSameBits) {
  const Plant plant(ReeledArm(1e6));
  RunSettings settings;
  settings.duration_s = 1;
  Simulation whole(plant, settings), resumed(plant, settings);
  ASSERT_TRUE(whole.AdvanceTo(0.3).ok);
  const std::string saved = whole.Checkpoint();
  ASSERT_TRUE(whole.AdvanceTo(1.0).ok);
  resumed.Restore(saved);
  ASSERT_TRUE(resumed.AdvanceTo(1.0).ok);
  EXPECT_EQ(whole.Checkpoint(), resumed.Checkpoint());
}

}  // namespace
}  // namespace mantle::model
