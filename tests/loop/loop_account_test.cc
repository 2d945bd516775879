#include "loop/loop_account.h"

#include <gtest/gtest.h>

#include <cmath>

#include "loop/scene/scene.h"
#include "reduced/build/reduced_plant.h"
#include "tests/support/paths.h"

namespace mantle::loop {
namespace {

using model::Vector3;
using model::VectorX;

/// Sums over a few steps of numbers of order one.
constexpr double kRoundOff = 1e-12;

struct Bench {
  explicit Bench(const std::string& name, const std::vector<std::string>& overrides = {})
      : scene(scene::LoadScene(tests::SourcePath("scenes/") + name + ".toml", overrides)),
        reduced(scene.robot, scene.reduction),
        reference(scene.control->goal, scene.robot),
        account(reduced, *scene.control, reference),
        truth(InitialState(reduced)),
        zero(VectorX::Zero(reduced.input_count())) {
    account.Start(truth.root.position, &result);
  }
  double LookAt(double t_s, const Vector3& position) {
    truth.time_s = t_s;
    truth.root.position = position;
    return account.Look(truth, Vector3::Zero(), &result);
  }

  scene::Scene scene;
  reduced::ReducedPlant reduced;
  controller::Reference reference;
  LoopAccount account;
  reduced::ReducedState truth;
  VectorX zero;
  LoopResult result;
};

TEST(LoopAccount, WaypointsArePassedInTurn) {
  Bench b("steer");
  const auto& points = std::get<controller::PathTask>(b.scene.control->goal).waypoints;
  const double tolerance_m = std::get<controller::PathTask>(b.scene.control->goal).tolerance_m;
  b.LookAt(1.0, points[1]);
  EXPECT_TRUE(std::isinf(b.result.waypoints[1].distance_m)) << "its turn has not come";
  b.LookAt(2.0, points[0] + Vector3(1.01 * tolerance_m, 0, 0));
  EXPECT_FALSE(b.result.waypoints[0].passed);
  EXPECT_NEAR(b.result.waypoints[0].distance_m, 1.01 * tolerance_m, kRoundOff);
  b.LookAt(3.0, points[0] + Vector3(0.99 * tolerance_m, 0, 0));
  EXPECT_TRUE(b.result.waypoints[0].passed);
  b.LookAt(4.0, points[0] + Vector3(2 * tolerance_m, 0, 0));
  EXPECT_TRUE(b.result.waypoints[0].passed) << "having been there is enough";
  EXPECT_EQ(b.result.waypoints[0].time_s, 3.0) << "the least distance counts";
  b.LookAt(5.0, points[1]);
  EXPECT_TRUE(b.result.waypoints[1].passed);
  EXPECT_FALSE(b.result.waypoints[2].passed);
}

TEST(LoopAccount, TheErrorOfAPathIsTheDistanceFromTheReference) {
  Bench b("steer");
  constexpr double kPeriod_s = 0.01;
  double sum = 0;
  for (const double t : {1.0, 2.0, 3.0}) {
    const Vector3 off(0.01 * t, 0, -0.02);
    EXPECT_NEAR(b.LookAt(t, b.reference.At(t).position + off), off.norm(), kRoundOff);
    b.account.Add(b.truth, kPeriod_s, b.zero, b.zero, b.zero, &b.result);
    ++b.result.cycles;
    sum += off.norm();
  }
  b.result.time_s = 3.0;
  b.account.Conclude(&b.result);
  EXPECT_EQ(b.result.error_name, "position_m");
  EXPECT_NEAR(b.result.mean_error, sum / 3, kRoundOff);
  EXPECT_NEAR(b.result.max_error, Vector3(0.03, 0, -0.02).norm(), kRoundOff);
  EXPECT_EQ(b.result.final_error, b.result.max_error);
}

TEST(LoopAccount, TheCostIsTheStageCostOverTime) {
  Bench b("steer", {"control.cost.heading=0", "control.cost.turn_rate=0", "control.cost.position=7",
                    "control.cost.effort=3", "control.cost.rate=0.5"});
  const Vector3 off(0.1, 0.2, 0.2);  // 0.3 m
  b.LookAt(2.0, b.reference.At(2.0).position + off);
  const VectorX before = VectorX::Constant(5, 0.1), now = VectorX::Constant(5, 0.2);
  constexpr double kPeriod_s = 0.05;
  b.account.Add(b.truth, kPeriod_s, now, before, b.zero, &b.result);
  const double rate = 0.1 / kPeriod_s;
  EXPECT_NEAR(b.result.cost, kPeriod_s * (7 * 0.09 + 3 * 5 * 0.2 * 0.2 + 0.5 * 5 * rate * rate),
              kRoundOff);
  EXPECT_NEAR(b.result.effort_n2_s, kPeriod_s * 5 * 0.2 * 0.2, kRoundOff);
  double sum = 0;
  for (const auto& [name, value] : b.result.cost_terms) {
    EXPECT_GE(value, 0.0) << name;
    sum += value;
    const double expected = name == "effort"     ? kPeriod_s * 3 * 5 * 0.2 * 0.2
                            : name == "position" ? kPeriod_s * 7 * 0.09
                                                 : value;
    EXPECT_NEAR(value, expected, kRoundOff) << name;
  }
  EXPECT_NEAR(sum, b.result.cost, kRoundOff) << "the terms are what the cost is made of";
  b.result.cycles = 1;
  b.result.time_s = kPeriod_s;
  b.account.Conclude(&b.result);
  EXPECT_NEAR(b.result.tension_error_n, 0.1, kRoundOff)
      << "the actual tension is judged by the commanded one";
}

TEST(LoopAccount, ACruiseIsJudgedByTheVelocityOverAPulse) {
  Bench b("swim");
  const Vector3 velocity = b.reference.At(0).velocity;
  const double period_s = b.scene.control->gait.period_s;
  constexpr double kStep_s = 0.01;
  const long steps = std::lround(3 * period_s / kStep_s);
  for (long k = 0; k <= steps; ++k) {
    const double t = static_cast<double>(k) * kStep_s;
    // On the average that velocity, with a ripple of the pulse's period.
    const double ripple_m = 0.01 * std::sin(2 * M_PI * t / period_s);
    b.LookAt(t, t * velocity + ripple_m * Vector3::UnitZ());
    b.account.Add(b.truth, kStep_s, b.zero, b.zero, b.zero, &b.result);
    ++b.result.cycles;
  }
  b.result.time_s = static_cast<double>(steps) * kStep_s;
  b.account.Conclude(&b.result);
  EXPECT_EQ(b.result.error_name, "mean_speed_m_s");
  constexpr double kInterpolation_m_s = 1e-9;  // the window's other end lies between two samples
  EXPECT_LT(b.result.max_error, kInterpolation_m_s) << "the first pulse does not count";
}

TEST(LoopAccount, TheMeanSpeedIsTheWayOverTime) {
  Bench b("steer");
  const Vector3 start = b.truth.root.position;
  b.LookAt(1.0, start + Vector3(0.3, 0, 0));
  b.LookAt(2.0, start + Vector3(0.3, 0, 0.4));
  b.LookAt(3.0, start + Vector3(0.3, 0, 0.0));  // back again
  b.result.cycles = 3;
  b.result.time_s = 4.0;
  b.account.Conclude(&b.result);
  EXPECT_NEAR(b.result.mean_speed_m_s, (0.3 + 0.4 + 0.4) / 4.0, kRoundOff);
}

}  // namespace
}  // namespace mantle::loop
