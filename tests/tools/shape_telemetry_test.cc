#include "tools/mantle/shape_telemetry.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numeric>

#include "tests/tools/scene_robot.h"
#include "tools/mantle/lcm_bridge.h"

namespace mantle::testing_tools {
namespace {

using namespace tools;
using model::Vector6;

// Strains are single precision: what is integrated over an arm of 40 elements is this good.
constexpr double kSingle = 2e-6;

model::Pose PoseAt(const ShapeTelemetry& m, std::size_t i) {
  model::Pose g;
  g.position = {m.position[i][0], m.position[i][1], m.position[i][2]};
  g.rotation = {m.quaternion[i][0], m.quaternion[i][1], m.quaternion[i][2], m.quaternion[i][3]};
  return g;
}

// The tip that the strains of the first arm lead to from its base.
model::Pose TipByStrains(const ShapeTelemetry& m) {
  model::Pose g = PoseAt(m, 0);
  for (std::size_t i = 0; i + 1 < static_cast<std::size_t>(m.arm_nodes[0]); ++i) {
    Vector6 xi;
    for (int k = 0; k < 6; ++k) xi(k) = double{m.strain[i][static_cast<std::size_t>(k)]};
    g = g * model::ExpSE3((m.arc_length[i + 1] - m.arc_length[i]) * xi);
  }
  return g;
}

TEST(ShapeMessages, StrainsLeadFromTheBaseToTheTip) {
  const SceneRobot robot("paper");
  const auto state = Moved(robot, 0.6);
  ShapeMessages shapes(robot.plant);
  const ShapeTelemetry& m = shapes.Of(state, {});
  const int last = robot.plant.rods[0].element_count();
  ASSERT_EQ(m.arm_nodes[0], last + 1);
  const model::Pose tip = AbsolutePose(robot.plant, state, 0, last);
  EXPECT_NEAR((TipByStrains(m).position - tip.position).norm(), 0.0, kSingle);
  EXPECT_EQ(m.position.back(), (Triple{tip.position.x(), tip.position.y(), tip.position.z()}));
  EXPECT_GT(std::abs(m.strain[0][2]) + std::abs(m.strain[0][1]), 0.1) << "it is bent";
}

TEST(ShapeMessages, AtRestNothingIsHeldAndTheShapeIsTheReference) {
  const SceneRobot robot("vehicle");
  ShapeMessages shapes(robot.plant);
  const ShapeTelemetry& m = shapes.Of(InitialState(robot.plant), {});
  for (const auto& stress : m.stress) {
    for (const float s : stress) EXPECT_NEAR(s, 0.0F, 1e-9F);
  }
  for (const auto& strain : m.mantle_strain) {
    for (const float e : strain) EXPECT_NEAR(e, 0.0F, 1e-9F);
  }
  ASSERT_EQ(m.mantle_profile.size(), robot.plant.shell->reference.size());
  for (std::size_t j = 0; j < m.mantle_profile.size(); ++j) {
    EXPECT_EQ(m.mantle_profile[j][0], robot.plant.shell->reference[j](0));
  }
  EXPECT_FLOAT_EQ(m.radius.front(), 0.015F);
  EXPECT_FLOAT_EQ(m.radius.back(), 0.006F);
  ASSERT_EQ(m.rigid_profile.size(), 3U);
  EXPECT_EQ(m.rigid_profile[1], (std::array<double, 2>{0.015, -0.112}));
}

TEST(ShapeMessages, StressIsWhatBendsAStaticArm) {
  // A dead load F at the tip of a clamped arm: the force held is F everywhere, the moment its
  // lever.
  const SceneRobot robot("elastica");
  const model::StaticsSettings settings = robot.scene.statics;
  const model::StaticsResult r = SolveStatics(robot.plant, settings);
  ASSERT_TRUE(r.ok) << r.reason;
  ShapeMessages shapes(robot.plant);
  const ShapeTelemetry& m = shapes.Of(r.state, {});
  const model::RodPoint& load = robot.plant.rods[0].points.at(0);
  const double force = model::Value(load.load.schedule, settings.time_s) * r.load_factor *
                       load.load.wrench.tail<3>().norm();
  for (std::size_t i = 0; i < m.stress.size(); ++i) {
    const double held = std::hypot(double{m.stress[i][3]}, m.stress[i][4], m.stress[i][5]);
    EXPECT_NEAR(held, force, 2e-3 * force) << "span " << i;  // the mesh's order, h^2
  }
}

TEST(ShapeMessages, CablesRunWhereTheirLengthIsMeasured) {
  const SceneRobot robot("vehicle");
  model::PlantState state = InitialState(robot.plant);
  ShapeMessages shapes(robot.plant);
  const std::vector<double> tension = {1, 2, 3, 4, 5};
  const ShapeTelemetry& m = shapes.Of(state, tension);
  ASSERT_EQ(m.cable_name.size(), 5U);
  std::size_t at = 0;
  for (std::size_t c = 0; c < 5; ++c) {
    EXPECT_EQ(m.cable_tension[c], static_cast<float>(tension[c]));
    double length = 0;
    const auto points = static_cast<std::size_t>(m.cable_points[c]);
    for (std::size_t i = at + 1; i < at + points; ++i) {
      double square = 0;
      for (std::size_t k = 0; k < 3; ++k) {
        square += std::pow(double{m.cable_position[i][k]} - m.cable_position[i - 1][k], 2);
      }
      // Spokes go out and back: each counts once.
      length += std::sqrt(square) *
                (c == 4 ? static_cast<double>(points) / 2 / static_cast<double>(points - 1) : 1.0);
    }
    at += points;
    EXPECT_NEAR(length, robot.plant.cable_rest_m[c], 1e-5) << m.cable_name[c];
  }
  EXPECT_EQ(at, m.cable_position.size());
}

TEST(ShapeMessages, WhatDoesNotFitIntoAMessageIsThinnedToMeans) {
  const std::vector<std::string> fine = {"arms.arm.elements=640", "mantle.elements=320"};
  const SceneRobot robot("paper", fine);
  ShapeMessages shapes(robot.plant);
  EXPECT_GT(shapes.thinning(), 1);
  const auto state = Moved(robot, 0.15);
  const ShapeTelemetry& m = shapes.Of(state, {});
  auto link = OpenLcm({.url = "memq://"});
  EXPECT_NO_THROW(link->Write(m)) << "within a datagram";
  EXPECT_LT(m.position.size(), 641U);
  EXPECT_DOUBLE_EQ(m.arc_length.back(), 0.42);
  const model::Pose tip = AbsolutePose(robot.plant, state, 0, 640);
  EXPECT_EQ(m.position.back()[0], tip.position.x());
  // Means of strain over a span still lead to the tip, to the order of the span.
  EXPECT_NEAR((TipByStrains(m).position - tip.position).norm(), 0.0, 1e-4);
}

TEST(ShapeMessages, ACurrentCarriesTheShapeWithIt) {
  const SceneRobot still("vehicle"), carried("vehicle", {"effects.current=[0.1, 0, 0]"});
  model::PlantState state = InitialState(still.plant);
  state.time_s = 2;
  ShapeMessages a(still.plant), b(carried.plant);
  EXPECT_NEAR(b.Of(state, {}).position[3][0] - a.Of(state, {}).position[3][0], 0.2, 1e-12);
  EXPECT_NEAR(b.Of(state, {}).root_position[0], 0.2, 1e-12);
}

TEST(ShapeMessages, ACurrentThatChangesCarriesTheShapeAsTheTrajectorySays) {
  const SceneRobot robot("vehicle", {"effects.current={x=0.1, y={type=\"sine\", amplitude=0.2, "
                                     "frequency=1}}"});
  model::Simulation run(robot.plant, robot.scene.run);
  ASSERT_TRUE(run.AdvanceTo(0.3).ok);
  const model::Sample sample = run.Observe();
  ShapeMessages shapes(robot.plant);
  const ShapeTelemetry& m = shapes.Of(run.state(), sample.cable_tension_n);
  ASSERT_GT(sample.root.position.norm(), 0.02);
  for (std::size_t k = 0; k < 3; ++k) {
    EXPECT_NEAR(m.root_position[k], sample.root.position(static_cast<int>(k)), 1e-12);
    EXPECT_NEAR(m.position[static_cast<std::size_t>(m.arm_nodes[0]) - 1][k],
                sample.tips[0].position(static_cast<int>(k)), 1e-12);
  }
}

}  // namespace
}  // namespace mantle::testing_tools
