#include "reduced/build/mantle_guard.h"

#include <gtest/gtest.h>

#include "reduced/build/mantle_basis.h"
#include "reduced/build/simulation.h"
#include "tests/reduced/reduced_robots.h"

namespace mantle::reduced {
namespace {

// The paper's mantle alone, clamped, in its own added mass and viscosity.
model::Robot MantleUnder(model::Schedule pressure) {
  model::Robot robot;
  robot.name = "mantle";
  robot.root = model::ClampedRoot{};
  robot.mantle = tests::PaperMantle(64);
  robot.mantle->strips = {tests::PaperStrip(std::move(pressure))};
  robot.effects.viscosity = robot.effects.added_mass = true;
  return robot;
}
model::Schedule RampTo(double pressure) { return model::TableSchedule{{0, 0.5}, {0, pressure}}; }

model::RunResult RunOf(const model::Robot& robot, double duration_s) {
  const ReducedPlant model(robot, {});
  ReducedRunSettings settings;
  settings.duration_s = duration_s;
  ReducedSimulation simulation(model, settings);
  return simulation.Run();
}
bool Warned(const model::RunResult& result, const std::string& of) {
  for (const std::string& w : result.warnings) {
    if (w.find(of) != std::string::npos) return true;
  }
  return false;
}

TEST(MantleGuard, FindsTheFoldOfThePlantsStaticPath) {
  // 494.1 Pa (docs/model.md), on a mesh of 64 elements to a tenth of a per cent.
  const model::Plant plant(MantleUnder(RampTo(100)));
  const auto collapse = CollapsePressure(plant);
  ASSERT_TRUE(collapse.has_value());
  EXPECT_NEAR(*collapse, 494.1, 0.5);
}

TEST(MantleGuard, MantleThatThePlantSeesCloseUpStopsTheRun) {
  const model::RunResult result = RunOf(MantleUnder(RampTo(500)), 6.0);
  EXPECT_FALSE(result.ok);
  EXPECT_LT(result.sim_time_s, 2.0);
  for (const char* part : {"mantle: collapse: 500", "bound 494", "lower the pressure"}) {
    EXPECT_NE(result.reason.find(part), std::string::npos) << result.reason;
  }
  // ... as the plant does.
  const model::Plant plant(MantleUnder(RampTo(500)));
  model::RunSettings settings;
  settings.duration_s = 6.0;
  model::Simulation full(plant, settings);
  const model::RunResult closed = full.Run();
  EXPECT_FALSE(closed.ok);
  EXPECT_NE(closed.reason.find("closed up"), std::string::npos) << closed.reason;
}

TEST(MantleGuard, MantleBelowItsCollapseRunsOnAsThePlantDoes) {
  const model::RunResult result = RunOf(MantleUnder(RampTo(480)), 3.0);
  EXPECT_TRUE(result.ok) << result.reason;
  EXPECT_TRUE(Warned(result, "the shapes are extrapolated"));  // built up to 390 Pa
  EXPECT_FALSE(Warned(result, "its static path turns"));
  EXPECT_TRUE(Warned(result, "goes into lobes"));
}

TEST(MantleGuard, PulsesBeyondCollapseAreWarnedOfAndSwum) {
  const model::RunResult result =
      RunOf(MantleUnder(model::TriangularSchedule{0.0, 550.0, 0.66, 0.0}), 2.0);
  EXPECT_TRUE(result.ok) << result.reason;
  EXPECT_TRUE(Warned(result, "its static path turns"));
}

TEST(MantleGuard, WithinItsShapesNothingIsSaidOfThem) {
  const model::RunResult result =
      RunOf(MantleUnder(model::TriangularSchedule{0.0, 160.0, 0.66, 0.0}), 2.0);
  EXPECT_TRUE(result.ok) << result.reason;
  EXPECT_FALSE(Warned(result, "shape"));
}

TEST(MantleGuard, FailuresNameWhatWhereValueAndBound) {
  const ReducedPlant model(MantleUnder(RampTo(100)), {});
  ReducedState s = InitialState(model);
  s.q.segment(model.mantle_first(), model.mantle->size) =
      20.0 * model.mantle->basis.equilibria.back();
  ReducedWork work(model);
  model::PlantInputs inputs;
  EvaluateInputs(model.plant, 0.0, false, &inputs);
  const ReducedFailure failure =
      EvaluateResidual(model, s, model::VectorX::Zero(model.velocity_count()), inputs, &work);
  ASSERT_TRUE(failure);
  EXPECT_STREQ(failure.body, "mantle");
  EXPECT_GE(failure.node, 0);
  EXPECT_LT(failure.value, failure.bound);
  EXPECT_NE(failure.Message().find("closed up"), std::string::npos) << failure.Message();
}

}  // namespace
}  // namespace mantle::reduced
