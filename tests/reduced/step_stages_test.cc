#include <gtest/gtest.h>

#include "reduced/build/reduced_plant.h"
#include "reduced/step.h"
#include "tests/reduced/reduced_robots.h"

namespace mantle::reduced {
namespace {

constexpr double kStep_s = 0.05;

struct Vehicle {
  Vehicle()
      : model(tests::ControlRobot(12, 32), {}), start(tests::RandomReducedState(model, 0.3, 4)) {
    EvaluateInputs(model.plant, 0.0, false, &inputs);
    inputs.cables[1].tension_n = 0.3;
    inputs.strips_pa[0] = 200;
  }
  ReducedPlant model;
  ReducedState start;
  model::PlantInputs inputs;
};

class StepFromStages : public testing::TestWithParam<StepScheme> {};

TEST_P(StepFromStages, EndsWhereAStepWithoutThemEndsInFewerIterations) {
  const Vehicle s;
  StepSettings settings;
  settings.scheme = GetParam();
  settings.tolerance = 1e-10;
  StepWork work(s.model);
  StepJacobian expected(s.model), jacobian(s.model);
  StepStages stages(s.model);
  ReducedState end = s.start, other = s.start, near = s.start;
  near.v *= 1.001;
  ASSERT_TRUE(
      TakeStep(s.model, settings, kStep_s, near, s.inputs, s.inputs, &work, &end, nullptr, &stages)
          .ok);
  EXPECT_TRUE(stages.known);
  const StepOutcome cold = TakeStep(s.model, settings, kStep_s, s.start, s.inputs, s.inputs, &work,
                                    &end, &expected, nullptr);
  const StepOutcome warm = TakeStep(s.model, settings, kStep_s, s.start, s.inputs, s.inputs, &work,
                                    &other, &jacobian, &stages);
  ASSERT_TRUE(cold.ok && warm.ok);
  EXPECT_LT(warm.iterations, cold.iterations);
  constexpr double kSame =
      1e-7;  // the tolerance, times rates per increment (2 / h gamma) and scales
  EXPECT_LT((end.v - other.v).cwiseAbs().maxCoeff(), kSame);
  EXPECT_LT((end.q - other.q).cwiseAbs().maxCoeff(), kSame);
  EXPECT_LT((expected.state - jacobian.state).cwiseAbs().maxCoeff(),
            kSame * expected.state.cwiseAbs().maxCoeff());
}

INSTANTIATE_TEST_SUITE_P(Schemes, StepFromStages,
                         testing::Values(StepScheme::kSdirk2, StepScheme::kBackwardEuler),
                         [](const auto& info) {
                           return info.param == StepScheme::kSdirk2 ? "Sdirk2" : "BackwardEuler";
                         });

TEST(StepFromStages, AreForgottenByAStepThatFails) {
  const Vehicle s;
  StepWork work(s.model);
  StepStages stages(s.model);
  ReducedState end = s.start;
  ASSERT_TRUE(
      TakeStep(s.model, {}, kStep_s, s.start, s.inputs, s.inputs, &work, &end, nullptr, &stages)
          .ok);
  ReducedState closed = s.start;
  closed.q(s.model.mantle_first() + 2) = 40 * s.model.mantle->basis.scale(2);
  EXPECT_FALSE(
      TakeStep(s.model, {}, kStep_s, closed, s.inputs, s.inputs, &work, &end, nullptr, &stages).ok);
  EXPECT_FALSE(stages.known);
}

TEST(StepTolerance, DerivativesImproveTheEndStateOfACoarseIteration) {
  const Vehicle s;
  StepWork work(s.model);
  StepJacobian jacobian(s.model);
  ReducedState exact = s.start, coarse = s.start, corrected = s.start;
  StepSettings settings;
  settings.tolerance = 1e-12;
  ASSERT_TRUE(
      TakeStep(s.model, settings, kStep_s, s.start, s.inputs, s.inputs, &work, &exact, nullptr).ok);
  settings.tolerance = 1e-4;
  ASSERT_TRUE(
      TakeStep(s.model, settings, kStep_s, s.start, s.inputs, s.inputs, &work, &coarse, nullptr)
          .ok);
  ASSERT_TRUE(TakeStep(s.model, settings, kStep_s, s.start, s.inputs, s.inputs, &work, &corrected,
                       &jacobian)
                  .ok);
  EXPECT_LT((corrected.q - exact.q).norm(), 0.1 * (coarse.q - exact.q).norm());
}

}  // namespace
}  // namespace mantle::reduced
