#include <gtest/gtest.h>

#include <cmath>

#include "loop/closed_loop.h"
#include "loop/scene/scene.h"
#include "reduced/outputs.h"
#include "tests/support/paths.h"

// One frame: whatever a closed loop measures, estimates, plans, costs and reports is the earth's,
// as the plant's own samples are, with water at rest, in a current and in one that changes.

namespace mantle::loop {
namespace {

struct Case {
  const char *scene, *current;
};
void PrintTo(const Case& c, std::ostream* os) { *os << c.scene << " " << c.current; }

constexpr const char* kNone = "";
constexpr const char* kSteady = "effects.current=[0.03,0.05,-0.02]";
constexpr const char* kChanging =
    "effects.current={x={type=\"sine\",amplitude=0.05,frequency=1},y={type=\"sine\",offset=0.04,"
    "amplitude=0.02,frequency=0.5}}";
// The plant's state is projected on the reduced shape; root and tips come through exactly.
constexpr double kRoundOff = 1e-11;

class OneFrame : public testing::TestWithParam<Case> {
 protected:
  scene::Scene Load(std::vector<std::string> overrides) const {
    const auto& [name, current] = GetParam();
    if (*current != '\0') overrides.emplace_back(current);
    return scene::LoadScene(tests::SourcePath("scenes/") + name, overrides);
  }
};
INSTANTIATE_TEST_SUITE_P(
    Scenes, OneFrame,
    testing::Values(Case{"swim.toml", kNone}, Case{"swim.toml", kSteady},
                    Case{"swim.toml", kChanging}, Case{"steer.toml", kNone},
                    Case{"steer.toml", kSteady}, Case{"steer.toml", kChanging},
                    Case{"steer_noise.toml", kSteady}, Case{"steer_mismatch.toml", kChanging},
                    Case{"reach.toml", kNone}, Case{"reach.toml", kSteady},
                    Case{"reach.toml", kChanging}, Case{"reach_mismatch.toml", kSteady},
                    Case{"octopus_swim.toml", kSteady}, Case{"octopus_swim.toml", kChanging}));

TEST_P(OneFrame, TruthSampleErrorAndPlanAreTheEarths) {
  const bool octopus = std::string_view(GetParam().scene).starts_with("octopus");
  const scene::Scene scene = Load({octopus ? "time.duration=0.1" : "time.duration=0.6"});
  ClosedLoop loop(scene);
  const controller::Reference& reference = loop.reference();
  const model::Pose start = scene.robot.root_pose;
  std::vector<double> least;
  double travelled = 0;
  model::Vector3 before = start.position;
  const LoopResult r = loop.Run([&](const LoopStep& step) {
    const model::Sample s = loop.plant_side().Observe();
    const reduced::ReducedState& truth = step.truth;
    EXPECT_LT((truth.root.position - s.root.position).norm(), kRoundOff) << step.time_s;
    EXPECT_LT((truth.v.head<6>() - s.root_twist).norm(), kRoundOff) << step.time_s;
    for (std::size_t a = 0; a < s.tips.size(); ++a) {
      EXPECT_LT((loop.vehicle().tip(static_cast<int>(a)) - s.tips[a].position).norm(), kRoundOff);
    }
    if (!loop.reduced().root_free()) {
      EXPECT_LT((truth.root.position - start.position).norm(), kRoundOff) << "it is clamped";
      EXPECT_LT(truth.v.head<6>().norm(), kRoundOff);
      EXPECT_LT((step.estimate.root.position - start.position).norm(), kRoundOff);
    }
    const controller::ReferencePoint at = reference.At(step.time_s);
    if (reference.has_position()) {
      EXPECT_NEAR(step.error, (s.root.position - at.position).norm(), kRoundOff);
      const auto& path = std::get<controller::PathTask>(scene.control->goal);
      const double d = (s.root.position - path.waypoints[0]).norm();
      least.push_back(d);
    }
    if (reference.has_tip()) {
      EXPECT_NEAR(step.error, (s.tips[reference.arm()].position - at.tip).norm(), kRoundOff);
    }
    // At the end there is no turn of the controller any more.
    if (scene.sensors.perfect() && step.time_s < scene.run.duration_s - 1e-9) {
      EXPECT_LT((step.estimate.root.position - s.root.position).norm(), kRoundOff);
    }
    if (step.planned && step.plan != nullptr) {
      // From here to where the plan begins it goes on at about the speed it has.
      const controller::Plan& plan = *step.plan;
      const double ahead = plan.start_s() - step.time_s;
      const model::Vector3 expected =
          s.root.position + ahead * (s.root.rotation * s.root_twist.tail<3>());
      constexpr double kNear_m = 2e-3;  // accelerations and noise over the delay
      EXPECT_LT((plan.states[0].root.position - expected).norm(),
                scene.sensors.perfect() ? kNear_m : 10 * kNear_m);
    }
    travelled += (s.root.position - before).norm();
    before = s.root.position;
    return true;
  });
  ASSERT_TRUE(r.ok) << r.reason;
  EXPECT_EQ(r.ended, "");
  if (!least.empty()) {
    EXPECT_NEAR(r.waypoints[0].distance_m, *std::min_element(least.begin(), least.end()),
                kRoundOff);
  }
  EXPECT_NEAR(r.mean_speed_m_s, travelled / r.time_s, kRoundOff);
  EXPECT_LT((before - r.plant.last.root.position).norm(), kRoundOff);
}

class FoundCurrent : public testing::TestWithParam<const char*> {};
INSTANTIATE_TEST_SUITE_P(Scenes, FoundCurrent,
                         testing::Values("steer_current.toml", "steer_noise.toml", "reach.toml"));

TEST_P(FoundCurrent, IsWithin5mm_sOfTheWatersAndWaypointsAreReachedInTheEarth) {
  std::vector<std::string> overrides = {"time.duration=12", "effects.current=[0,0.05,0]"};
  const bool reaches = std::string_view(GetParam()) == "reach.toml";
  ClosedLoop loop(scene::LoadScene(tests::SourcePath("scenes/") + GetParam(), overrides));
  double least_m = 1e9;
  const LoopResult r = loop.Run([&](const LoopStep&) {
    const auto* path = std::get_if<controller::PathTask>(&loop.control_side().options().goal);
    if (path != nullptr) {
      const model::Vector3 at = loop.plant_side().Observe().root.position;
      least_m = std::min(least_m, (at - path->waypoints[0]).norm());
    }
    return true;
  });
  ASSERT_TRUE(r.ok) << r.reason;
  ASSERT_TRUE(r.current.has_value());
  RecordProperty("rms_mm_s", std::to_string(1e3 * r.current->rms_error));
  // A vehicle feels the current along its whole way; an arm that is held, by its drag alone.
  const double kNear_m_s = reaches ? 8e-3 : 5e-3;
  EXPECT_LT(r.current->rms_error, kNear_m_s) << r.current->estimated.transpose();
  EXPECT_LT((r.current->estimated - r.current->actual).norm(), kNear_m_s)
      << r.current->estimated.transpose();
  EXPECT_EQ(r.estimator.refused, 0);
  if (reaches) return;
  EXPECT_TRUE(r.waypoints[0].passed) << r.waypoints[0].distance_m;
  EXPECT_NEAR(r.waypoints[0].distance_m, least_m, kRoundOff);
}

TEST(BelievedRobot, HasNoCurrent) {
  const scene::Scene scene = scene::LoadScene(tests::SourcePath("scenes/reach.toml"), {kSteady});
  ClosedLoop loop(scene);
  EXPECT_TRUE(loop.plant().robot.effects.current_m_s.has_value());
  EXPECT_FALSE(loop.reduced().robot.effects.current_m_s.has_value());
  EXPECT_TRUE(scene.control->estimator.current) << "but looks for one";
}

}  // namespace
}  // namespace mantle::loop
