#include "tools/mantle/water_telemetry.h"

#include <gtest/gtest.h>

#include "tests/tools/scene_robot.h"
#include "tools/mantle/shape_telemetry.h"

namespace mantle::testing_tools {
namespace {

using namespace tools;
using model::Vector3;

// The message holds single precision.
constexpr double kSingle = 1e-6;

Vector3 ForceAt(const WaterTelemetry& m, std::size_t i) {
  return {double{m.drag[i][0]}, double{m.drag[i][1]}, double{m.drag[i][2]}};
}

TEST(WaterMessages, DragTakesTheEnergyThatTheAccountSays) {
  const SceneRobot robot("paper");
  const model::PlantState state = Moved(robot, 0.6);
  WaterMessages water(robot.plant, 1);
  ASSERT_TRUE(water.active());
  const WaterTelemetry m = water.Of(state);
  const model::Rod& rod = robot.plant.rods[0];
  ASSERT_EQ(m.drag.size(), rod.nodes.size());
  double power_w = 0, scale_w = 0;
  for (std::size_t i = 0; i < m.drag.size(); ++i) {
    const auto pose = AbsolutePose(robot.plant, state, 0, static_cast<int>(i));
    const Vector3 velocity =
        pose.rotation * AbsoluteTwist(robot.plant, state, 0, static_cast<int>(i)).tail<3>();
    const double p = rod.nodes[i].weight_m * ForceAt(m, i).dot(velocity);
    EXPECT_LE(p, 0) << "drag drives node " << i;
    power_w += p;
    scale_w += std::abs(p);
  }
  // The same power by the load itself.
  const auto& drag = *std::find_if(rod.loads.begin(), rod.loads.end(), [](const auto& load) {
    return std::holds_alternative<model::DragLoad>(load);
  });
  std::vector<double> powers(64, 0.0);
  for (std::size_t i = 0; i < m.drag.size(); ++i) {
    const auto twist = AbsoluteTwist(robot.plant, state, 0, static_cast<int>(i));
    std::get<model::DragLoad>(drag).AddPower(
        rod.nodes[i].section,
        {AbsolutePose(robot.plant, state, 0, static_cast<int>(i)).rotation, twist}, twist,
        rod.nodes[i].weight_m, powers.data());
  }
  double sum_w = 0;
  for (const double p : powers) sum_w += p;
  EXPECT_NEAR(power_w, sum_w, kSingle * scale_w);
  EXPECT_LT(sum_w, 0);
}

TEST(WaterMessages, BodyDragIsAgainstTheSwimming) {
  const SceneRobot robot("paper");
  const model::PlantState state = Moved(robot, 0.9);
  const WaterTelemetry m = WaterMessages(robot.plant, 1).Of(state);
  const Vector3 drag(m.body_drag.data());
  const Vector3 velocity = state.pose[0].rotation * state.velocity.segment<3>(3);
  ASSERT_GT(velocity.norm(), 1e-3);
  EXPECT_LT(drag.dot(velocity), 0);
  EXPECT_GT(drag.norm(), 0);
}

TEST(WaterMessages, NodesAreThoseOfTheShape) {
  const SceneRobot robot("paper");
  const model::PlantState state = Moved(robot, 0.3);
  ShapeMessages shapes(robot.plant);
  const std::size_t nodes = shapes.Of(state, {}).position.size();
  EXPECT_EQ(WaterMessages(robot.plant, shapes.thinning()).Of(state).drag.size(), nodes);
  const WaterTelemetry all = WaterMessages(robot.plant, 1).Of(state);
  const WaterTelemetry fourth = WaterMessages(robot.plant, 4).Of(state);
  ASSERT_EQ(fourth.drag.size(), 6U);
  for (std::size_t i = 0; i < fourth.drag.size(); ++i) EXPECT_EQ(fourth.drag[i], all.drag[4 * i]);
}

TEST(WaterMessages, WithoutDragThereIsNothingToSay) {
  const SceneRobot dry("paper", {"effects.drag=false"});
  EXPECT_FALSE(WaterMessages(dry.plant, 1).active());
}

TEST(WaterMessages, AtRestTheWaterDoesNotDrag) {
  const SceneRobot robot("paper");
  const WaterTelemetry m = WaterMessages(robot.plant, 1).Of(InitialState(robot.plant));
  for (std::size_t i = 0; i < m.drag.size(); ++i) EXPECT_EQ(ForceAt(m, i).norm(), 0);
  EXPECT_EQ(Vector3(m.body_drag.data()).norm(), 0);
}

}  // namespace
}  // namespace mantle::testing_tools
