#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "reduced/build/simulation.h"
#include "tests/reduced/reduced_robots.h"

/// A prescribed root moves the reduced model as it moves the plant, whatever its schedule.

namespace mantle::reduced {
namespace {

using model::PrescribedRoot;
using model::Robot;
using model::Sample;
using model::Schedule;

struct Root {
  std::string name;
  PrescribedRoot motion;
};

std::vector<Root> EveryScheduleType(int axis, double x) {
  const std::pair<const char*, Schedule> schedules[] = {
      {"constant", model::ConstantSchedule{3 * x}},
      {"sine", model::SineSchedule{2 * x, 3.0, 0.4, x, 0.0}},
      {"sine that begins later", model::SineSchedule{2 * x, 3.0, 0.0, x, 0.05}},
      {"triangular", model::TriangularSchedule{0.0, 2 * x, 0.1, 0.02}},
      {"table", model::TableSchedule{{0.0, 0.06, 0.09, 0.3}, {x, 3 * x, -x, 0.0}}}};
  std::vector<Root> roots;
  for (const auto& [name, schedule] : schedules) {
    Root along{std::string(name) + " along", {}}, turned{std::string(name) + " turned", {}};
    (axis == 0 ? along.motion.x_m : along.motion.z_m) = schedule;
    turned.motion.angle_rad = schedule;
    turned.motion.rotation_axis = model::Vector3(1, 2, -2) / 3.0;
    turned.motion.y_m = schedule;
    roots.push_back(along);
    roots.push_back(turned);
  }
  return roots;
}

template <typename Simulation>
std::vector<Sample> Samples(Simulation* simulation) {
  std::vector<Sample> samples;
  const model::RunResult result = simulation->Run([&](const Sample& s) {
    samples.push_back(s);
    return true;
  });
  EXPECT_TRUE(result.ok) << result.reason;
  return samples;
}

struct Both {
  std::vector<Sample> plant, reduced;
};

Both RunBoth(const Robot& robot, const Reduction& reduction, double step_s) {
  const ReducedPlant model(robot, reduction);
  model::RunSettings full;
  full.duration_s = 0.3;
  full.step_s = step_s;
  full.output_interval_s = 0.03;
  full.stepper.newton_tolerance = 1e-11;
  ReducedRunSettings settings = RunSettingsOf(full, reduction);
  settings.step_s = step_s;
  model::Simulation plant(model.plant, full);
  ReducedSimulation reduced(model, settings);
  return {Samples(&plant), Samples(&reduced)};
}

TEST(ReducedRootMotion, ArmFollowsEveryScheduleAsThePlant) {
  // Same strains and sections as the plant's mesh: the same semi-discrete arm, by other coordinates
  // and the root's impulses through another mass matrix. What differs is the steps' error, which
  // falls with their square and is largest after kinks (stiff layers).
  constexpr double kShare = 4e-3;
  Robot robot;
  robot.name = "arm";
  robot.arms = {tests::PaperArm(5)};
  robot.effects.drag = robot.effects.added_mass = robot.effects.viscosity = true;
  robot.root_pose.rotation = model::ExpSO3(model::Vector3(0.2, -0.4, 0.3));
  for (const Root& root : EveryScheduleType(0, 0.01)) {
    robot.root = root.motion;
    const Both both = RunBoth(robot, tests::EquivalentReduction(robot), 0.0005);
    ASSERT_EQ(both.plant.size(), both.reduced.size()) << root.name;
    double worst = 0, moved = 0;
    for (std::size_t i = 0; i < both.plant.size(); ++i) {
      const Sample &f = both.plant[i], &r = both.reduced[i];
      worst = std::max(worst, (f.tips[0].position - r.tips[0].position).norm());
      moved = std::max(moved, (f.tips[0].position - both.plant[0].tips[0].position).norm());
      EXPECT_LT((f.root.position - r.root.position).norm(), 1e-14) << root.name;
      EXPECT_LT((f.root_twist - r.root_twist).norm(), 1e-13) << root.name;
    }
    EXPECT_LE(worst, std::max(kShare * moved, 1e-12)) << root.name << " of " << moved << " m";
  }
}

TEST(ReducedRootMotion, MantleFollowsEveryScheduleAsThePlant) {
  // Mode 1 is the axial bounce, which the root's axial motion excites; six modes hold the shape
  // after a kink to less than a tenth. Without the kinks' impulses the error is all of it.
  constexpr double kShare = 0.1;
  Robot robot;
  robot.name = "mantle";
  robot.mantle = tests::PaperMantle(24, 3);
  robot.effects.viscosity = robot.effects.added_mass = true;
  Reduction reduction;
  reduction.arms.clear();
  reduction.mantle.modes = 6;
  reduction.mantle.cubature_tolerance = 0;
  for (const Root& root : EveryScheduleType(2, 0.0005)) {
    robot.root = root.motion;
    const Both both = RunBoth(robot, reduction, 0.001);
    double worst = 0, moved = 0;
    for (std::size_t i = 0; i < std::min(both.plant.size(), both.reduced.size()); ++i) {
      worst = std::max(worst, std::abs(both.plant[i].volume_m3 - both.reduced[i].volume_m3));
      moved = std::max(moved, std::abs(both.plant[i].volume_m3 - both.plant[0].volume_m3));
    }
    EXPECT_LE(worst, std::max(kShare * moved, 1e-15)) << root.name << " of " << moved << " m^3";
    if (root.name == "table along") {
      EXPECT_GT(moved, 1e-7);
    }
  }
}

}  // namespace
}  // namespace mantle::reduced
