#include "controller/reference.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "loop/scene/scene.h"
#include "tests/support/paths.h"

namespace mantle::controller {
namespace {

scene::Scene Load(const std::string& name) {
  return scene::LoadScene(tests::SourcePath("scenes/") + name);
}

class PathReference : public testing::Test {
 protected:
  PathReference()
      : scene_(Load("steer.toml")),
        task_(std::get<PathTask>(scene_.control->goal)),
        reference_(scene_.control->goal, scene_.robot) {}

  int waypoints() const { return static_cast<int>(task_.waypoints.size()); }

  scene::Scene scene_;
  PathTask task_;
  Reference reference_;
};

TEST_F(PathReference, PassesEveryWaypointAtItsTime) {
  ASSERT_GE(waypoints(), 4);
  double before = 0;
  for (int i = 0; i < waypoints(); ++i) {
    const double t = reference_.WaypointTime(i);
    EXPECT_GT(t, before);
    EXPECT_LT((reference_.At(t).position - task_.waypoints[i]).norm(), 1e-9) << i;
    before = t;
  }
  EXPECT_EQ(reference_.EndTime(), before);
  EXPECT_TRUE(std::isinf(reference_.WaypointTime(waypoints())));
  EXPECT_TRUE(std::isinf(reference_.WaypointTime(-1)));
}

TEST_F(PathReference, StartsAtTheRootAlongItsAxisFromRest) {
  const ReferencePoint start = reference_.At(0.0);
  EXPECT_LT((start.position - scene_.robot.root_pose.position).norm(), 1e-12);
  EXPECT_LT((start.direction - scene_.robot.root_pose.rotation * Vector3::UnitZ()).norm(), 1e-12);
  EXPECT_EQ(start.velocity.norm(), 0.0);
  EXPECT_LT((reference_.At(-1.0).position - start.position).norm(), 1e-12);
}

TEST_F(PathReference, SpeedAlongTheCurveRisesWithinTheRampAndThenIsConstant) {
  // Positions lie on chords of 200 samples per span, whose directions differ by 1 % of a radian at
  // most: speeds by its square.
  constexpr double kStep_s = 1e-3, kChords = 1e-4;
  for (double t = 0.05; t < reference_.EndTime() + 2.0; t += 0.0731) {
    const Vector3 rate =
        (reference_.At(t + kStep_s).position - reference_.At(t - kStep_s).position) / (2 * kStep_s);
    const double speed = task_.speed_m_s * std::min(1.0, t / task_.ramp_s);
    EXPECT_NEAR(rate.norm(), speed, (kChords + 1e-3 * (t < task_.ramp_s + kStep_s)) * speed) << t;
    EXPECT_NEAR(reference_.At(t).velocity.norm(), speed, 1e-12);
  }
}

TEST_F(PathReference, VelocityAndDirectionAreTheCurvesTangent) {
  constexpr double kStep_s = 1e-3, kChord = 0.012;  // rad: of the spline's turn within one chord
  for (double t = 0.5; t < reference_.EndTime() + 2.0; t += 0.0917) {
    const ReferencePoint now = reference_.At(t);
    const Vector3 way = reference_.At(t + kStep_s).position - reference_.At(t - kStep_s).position;
    EXPECT_LT((way.normalized() - now.direction).norm(), kChord) << t;
    EXPECT_LT((now.velocity.normalized() - now.direction).norm(), 1e-12);
  }
}

TEST_F(PathReference, DirectionIsContinuousAlsoAtWaypointsAndTheEnd) {
  constexpr double kStep_s = 1e-4;
  // Curvature below 1/(0.1 m) at 60 mm/s turns by 6e-5 rad in 0.1 ms.
  constexpr double kTurn = 1.2e-4;
  for (int i = 0; i < waypoints(); ++i) {
    const double t = reference_.WaypointTime(i);
    EXPECT_LT((reference_.At(t + kStep_s).direction - reference_.At(t - kStep_s).direction).norm(),
              kTurn)
        << i;
  }
}

TEST_F(PathReference, GoesStraightOnBeyondTheEnd) {
  const double end = reference_.EndTime();
  const ReferencePoint at = reference_.At(end), later = reference_.At(end + 3.0);
  EXPECT_LT((later.position - at.position - 3.0 * task_.speed_m_s * at.direction).norm(), 1e-9);
  EXPECT_LT((later.direction - at.direction).norm(), 1e-9);
  EXPECT_EQ(reference_.SettledTime(), 0.0);
}

TEST(Reference, CruiseAsksForAVelocityAndNoPlace) {
  const scene::Scene scene = Load("swim.toml");
  const auto& task = std::get<CruiseTask>(scene.control->goal);
  const Reference reference(scene.control->goal, scene.robot);
  EXPECT_FALSE(reference.has_position());
  EXPECT_FALSE(reference.has_tip());
  EXPECT_TRUE(std::isinf(reference.EndTime()));
  EXPECT_LT((reference.At(7.0).velocity - task.speed_m_s * task.direction).norm(), 1e-15);
  EXPECT_EQ(reference.At(7.0).direction, task.direction);
}

TEST(Reference, CircleLiesAboutTheArmsAxisAtItsHeight) {
  const scene::Scene scene = Load("reach.toml");
  const auto& task = std::get<CircleTask>(scene.control->goal);
  const Reference reference(scene.control->goal, scene.robot);
  ASSERT_TRUE(reference.has_tip());
  EXPECT_EQ(reference.SettledTime(), task.approach_s);
  const model::Pose base = scene.robot.root_pose * scene.robot.arms[task.arm].mount;
  const Vector3 axis = base.rotation * Vector3::UnitX();
  const Vector3 centre = base.position + task.height_m * axis;
  EXPECT_LT((reference.At(0.0).tip - centre).norm(), 1e-12);
  for (double t = task.approach_s; t < task.approach_s + task.period_s; t += 0.1) {
    const Vector3 r = reference.At(t).tip - centre;
    EXPECT_NEAR(r.dot(axis), 0.0, 1e-12);
    EXPECT_NEAR(r.norm(), task.radius_m, 1e-12);
    EXPECT_LT((reference.At(t + task.period_s).tip - centre - r).norm(), 1e-11);
    EXPECT_LT((reference.At(t + 0.5 * task.period_s).tip - centre + r).norm(), 1e-11);
  }
}

TEST(Reference, TheApproachToTheCircleIsSmooth) {
  const scene::Scene scene = Load("reach.toml");
  const auto& task = std::get<CircleTask>(scene.control->goal);
  const Reference reference(scene.control->goal, scene.robot);
  constexpr double kStep_s = 1e-5;
  const auto rate = [&](double t) {
    return Vector3((reference.At(t + kStep_s).tip - reference.At(t).tip) / kStep_s);
  };
  const double speed = 2 * std::numbers::pi / task.period_s * task.radius_m;
  EXPECT_LT(rate(0.0).norm(), 1e-3 * speed);
  EXPECT_LT((rate(task.approach_s) - rate(task.approach_s - kStep_s)).norm(), 1e-3 * speed);
  EXPECT_NEAR(rate(task.approach_s).norm(), speed, 1e-3 * speed);
}

}  // namespace
}  // namespace mantle::controller
