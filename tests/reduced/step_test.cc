#include "reduced/step.h"

#include <gtest/gtest.h>

#include "model/simulation.h"
#include "reduced/build/simulation.h"
#include "tests/reduced/reduced_robots.h"
#include "tests/support/gradient_checker.h"

namespace mantle::reduced {
namespace {

using model::PlantInputs;
using tests::RandomReducedState;

PlantInputs SomeInputs(const ReducedPlant& model, double strength) {
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
  const ReducedPlant model(tests::ControlRobot(12, 32), reduction);
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

// Largest difference between plant and reduced model after 0.4 s with steps of 5 and 2.5 ms: tip
// and root in arm lengths, volume in its change.
struct MotionErrors {
  double coarse{0}, fine{0};
};
MotionErrors CompareMotion(const model::Robot& robot, const Reduction& reduction) {
  const ReducedPlant model(robot, reduction);
  constexpr double kDuration_s = 0.4;
  const auto error = [&](double h) {
    model::RunSettings full;
    full.duration_s = kDuration_s;
    full.step_s = h;
    full.stepper.newton_tolerance = 1e-11;
    model::Simulation plant(model.plant, full);
    ReducedRunSettings small;
    small.duration_s = kDuration_s;
    small.step_s = h;
    small.output_interval_s = kDuration_s;
    ReducedSimulation reduced(model, small);
    const model::Sample start = plant.Observe();
    EXPECT_TRUE(plant.AdvanceTo(kDuration_s).ok);
    EXPECT_TRUE(reduced.AdvanceTo(kDuration_s).ok);
    const model::Sample f = plant.Observe(), r = reduced.Observe();
    const double length = robot.arms[0].length_m;
    double worst = std::max((f.tips[0].position - r.tips[0].position).norm() / length,
                            (f.root.position - r.root.position).norm() / length);
    EXPECT_GT((f.tips[0].position - start.tips[0].position).norm(), 0.05 * length) << "it moves";
    if (model.mantle) {
      const double change = std::abs(f.volume_m3 - start.volume_m3);
      EXPECT_GT(change, 0.01 * start.volume_m3);
      worst = std::max(worst, std::abs(f.volume_m3 - r.volume_m3) / change);
    }
    return worst;
  };
  return {error(0.005), error(0.0025)};
}

// The semi-discrete robot is the same; what differs is the time discretisation, in strains or in
// poses, which falls with the square of the step.
constexpr double kSecondOrder = 0.3;  // 0.25 for order 2

TEST(Step, SameMotionAsPlantWithAsManySegmentsAsElements) {
  model::Robot robot = tests::PaperRobot(5, 24);
  robot.mantle.reset();
  tests::AddFourCables(&robot.arms[0]);
  robot.arms[0].cables[0].drive = model::GivenTension{model::ConstantSchedule{0.3}};
  robot.effects.drag = robot.effects.added_mass = robot.effects.viscosity = true;
  const MotionErrors e = CompareMotion(robot, tests::EquivalentReduction(robot));
  EXPECT_LT(e.fine, 1e-4);
  EXPECT_LT(e.fine, kSecondOrder * e.coarse);
}

TEST(Step, SameMotionAsPlantWithAllOfACoarseMantlesShapesToo) {
  // Two elements of a tube have six free coordinates: six modes span them all.
  model::Robot robot = tests::ControlRobot(5, 24);
  robot.mantle->pieces = {{0.05, 0.0}};
  robot.mantle->theta0_rad = -std::numbers::pi / 2;
  robot.mantle->r0_m = 0.03;
  robot.mantle->stations_m.clear();
  robot.mantle->strips = {{"muscle", 0.0, 0.05, model::ConstantSchedule{100.0}}};
  robot.mantle->elements = 2;
  robot.arms[0].cables[0].drive = model::GivenTension{model::ConstantSchedule{0.3}};
  Reduction reduction = tests::EquivalentReduction(robot);
  reduction.mantle.modes = 6;
  reduction.mantle.static_pressures_pa.emplace();
  const MotionErrors e = CompareMotion(robot, reduction);
  EXPECT_LT(e.fine, 1e-3);
  EXPECT_LT(e.fine, kSecondOrder * e.coarse);
}

TEST(Step, SecondOrderInTime) {
  const ReducedPlant model(tests::ControlRobot(12, 32), {});
  const ReducedState start = RandomReducedState(model, 0.4, 5);
  const PlantInputs inputs = SomeInputs(model, 0.5);
  StepSettings settings;
  settings.tolerance = 1e-12;
  StepWork work(model);
  const auto run = [&](int steps) {
    ReducedState s = start, next = start;
    for (int i = 0; i < steps; ++i) {
      EXPECT_TRUE(
          TakeStep(model, settings, 0.08 / steps, s, inputs, inputs, &work, &next, nullptr).ok);
      s = next;
    }
    return s;
  };
  const ReducedState exact = run(320);
  const auto error = [&](int steps) {
    return Difference(exact, run(steps)).head(model.velocity_count()).norm();
  };
  const double coarse = error(20), fine = error(40);
  EXPECT_GT(coarse / fine, 3.3);  // 4 for order 2
  EXPECT_LT(coarse / fine, 5.5);
}

TEST(Step, RemainderOfTheJacobianIsOfSecondOrder) {
  const ReducedPlant model(tests::ControlRobot(12, 32), {});
  const ReducedState start = RandomReducedState(model, 0.3, 9);
  const PlantInputs inputs = SomeInputs(model, 0.5);
  StepSettings settings;
  settings.tolerance = 1e-13;
  StepWork work(model);
  StepJacobian jacobian(model);
  ReducedState end = start, other = start;
  ASSERT_TRUE(TakeStep(model, settings, 0.05, start, inputs, inputs, &work, &end, &jacobian).ok);
  model::VectorX direction = tests::RandomVector(2 * model.velocity_count(), 4);
  for (int i = 0; i < model.mantle->size; ++i) {
    direction(6 + model.mantle_first() + i) *= model.mantle->basis.scale(i);
    direction(model.velocity_count() + 6 + model.mantle_first() + i) *=
        10 * model.mantle->basis.scale(i);
  }
  const auto remainder = [&](double size) {
    const ReducedState moved = Moved(start, size * direction);
    EXPECT_TRUE(TakeStep(model, settings, 0.05, moved, inputs, inputs, &work, &other, nullptr).ok);
    return (Difference(end, other) - size * jacobian.state * direction).norm();
  };
  const double ratio = remainder(2e-3) / remainder(1e-3);
  EXPECT_GT(ratio, 3.5);  // 4 for a quadratic remainder
  EXPECT_LT(ratio, 4.5);
}

TEST(StepBadInput, WrongSizeAndStepAreRefused) {
  const ReducedPlant model(tests::ControlRobot(8, 24), {});
  ReducedState s = InitialState(model), next = s;
  StepWork work(model);
  const PlantInputs inputs = SomeInputs(model, 0.0);
  EXPECT_FALSE(TakeStep(model, {}, 0.0, s, inputs, inputs, &work, &next, nullptr).ok);
  EXPECT_FALSE(TakeStep(model, {}, -1.0, s, inputs, inputs, &work, &next, nullptr).ok);
  s.q.resize(3);
  const StepOutcome o = TakeStep(model, {}, 0.05, s, inputs, inputs, &work, &next, nullptr);
  EXPECT_FALSE(o.ok);
  EXPECT_STREQ(o.cause, "the state has the wrong size for this model");
}

}  // namespace
}  // namespace mantle::reduced
