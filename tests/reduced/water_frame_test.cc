#include "reduced/water_frame.h"

#include <gtest/gtest.h>

#include "loop/scene/scene.h"
#include "reduced/build/reduced_plant.h"
#include "reduced/outputs.h"
#include "tests/support/paths.h"

namespace mantle::reduced {
namespace {

constexpr double kStep_s = 0.02;
const Vector3 kCurrent_m_s(0.03, 0.05, -0.02);

scene::Scene Scene(const std::string& name, const std::vector<std::string>& overrides = {}) {
  return scene::LoadScene(tests::SourcePath("scenes/") + name, overrides);
}

model::Robot InStillWater(model::Robot robot) {
  robot.effects.current_m_s.reset();
  return robot;
}

/// A model under way: bent, pulled, moving, and where the root is free turning.
struct Moving {
  explicit Moving(const scene::Scene& scene)
      : robot(InStillWater(scene.robot)),
        model(robot, scene.reduction),
        work(model),
        state(InitialState(model)) {
    EvaluateInputs(model, 0.0, false, &inputs);
    VectorX u = VectorX::LinSpaced(model.input_count(), 0.05, 0.2);
    ApplyControls(model, u.data(), &inputs);
    if (model.root_free()) state.v.head<6>() << 0.2, -0.3, 0.1, 0.02, -0.03, 0.05;
    ReducedState next = state;
    for (int i = 0; i < 10; ++i) {
      EXPECT_TRUE(
          TakeStep(model, settings, kStep_s, state, inputs, inputs, &work, &next, nullptr).ok);
      std::swap(state, next);
    }
  }
  ReducedState Take(const ReducedState& from, const Vector3& c, double h = kStep_s,
                    StepJacobian* jacobian = nullptr, Eigen::MatrixXd* by_current = nullptr) {
    CurrentStep step(model);
    ReducedState to = from;
    EXPECT_TRUE(
        step.Take(settings, h, from, inputs, inputs, c, &work, &to, jacobian, by_current).ok);
    return to;
  }

  model::Robot robot;
  ReducedPlant model;
  StepSettings settings{StepScheme::kSdirk2, 1e-11};
  StepWork work;
  model::PlantInputs inputs;
  ReducedState state;
};

VectorX Difference(const ReducedState& a, const ReducedState& b) {
  VectorX d(2 * a.v.size());
  StateDifference(a, b, d);
  return d;
}

TEST(WaterFrame, ThereAndBackIsWhereItWas) {
  Moving moving(Scene("steer.toml"));
  model::WaterMotion water;
  water.velocity_m_s = kCurrent_m_s;
  water.drift_m = {1, 2, 3};
  ReducedState s = moving.state;
  ToEarth(water, &s);
  EXPECT_NEAR((s.root.position - moving.state.root.position - water.drift_m).norm(), 0, 1e-15);
  EXPECT_GT(Difference(moving.state, s).norm(), 1.0);
  ToWater(water, &s);
  EXPECT_LT(Difference(moving.state, s).cwiseAbs().maxCoeff(), 1e-12);
}

TEST(WaterFrame, AVehicleThatGoesWithTheWaterIsMovedByIt) {
  Moving moving(Scene("steer.toml"));
  ReducedState with_water = moving.state;
  with_water.v.segment<3>(3) += moving.state.root.rotation.conjugate() * kCurrent_m_s;
  const ReducedState still = moving.Take(moving.state, Vector3::Zero());
  const ReducedState carried = moving.Take(with_water, kCurrent_m_s);
  constexpr double kRoundOff = 1e-12;
  EXPECT_LT((carried.root.position - still.root.position - kStep_s * kCurrent_m_s).norm(),
            kRoundOff);
  EXPECT_LT((carried.q - still.q).norm(), kRoundOff);
  EXPECT_LT((carried.root.rotation * carried.v.segment<3>(3) -
             still.root.rotation * still.v.segment<3>(3) - kCurrent_m_s)
                .norm(),
            kRoundOff);
}

TEST(WaterFrame, AClampedArmBendsAsTheRobotsOwnCurrentBendsIt) {
  // The robot that knows its current is stepped in the drifting frame by its own inputs.
  const scene::Scene scene = Scene("reach.toml", {"effects.current=[0.03,0.05,-0.02]"});
  const ReducedPlant knows(scene.robot, scene.reduction);
  Moving moving(scene);
  ReducedState theirs = InitialState(knows), ours = InitialState(moving.model), next = ours;
  StepWork work(knows);
  model::PlantInputs inputs;
  for (int i = 0; i < 50; ++i) {
    EvaluateInputs(knows, 0.0, false, &inputs);
    ASSERT_TRUE(
        TakeStep(knows, moving.settings, kStep_s, theirs, inputs, inputs, &work, &next, nullptr)
            .ok);
    std::swap(theirs, next);
    EvaluateInputs(moving.model, 0.0, false, &moving.inputs);
    ours = moving.Take(ours, kCurrent_m_s);
  }
  EXPECT_GT(theirs.q.norm(), 1e-3) << "it bends";
  EXPECT_LT((ours.q - theirs.q).norm(), 1e-9 * theirs.q.norm());
  EXPECT_EQ(ours.root.position, moving.robot.root_pose.position) << "in the earth";
  EXPECT_LT(ours.v.head<6>().norm(), 1e-15);
}

class DerivativesOf : public testing::TestWithParam<const char*> {};
INSTANTIATE_TEST_SUITE_P(Roots, DerivativesOf, testing::Values("steer.toml", "reach.toml"));

TEST_P(DerivativesOf, AStepInACurrentAreExact) {
  Moving moving(Scene(GetParam()));
  const bool free = moving.model.root_free();
  const int n = 2 * moving.model.velocity_count();
  StepJacobian jacobian(moving.model);
  Eigen::MatrixXd by_current(n, 3);
  const ReducedState base =
      moving.Take(moving.state, kCurrent_m_s, kStep_s, &jacobian, &by_current);
  constexpr double kBy = 1e-5;    // of central differences
  constexpr double kNear = 2e-5;  // of the largest entry: round-off over kBy and Newton's tolerance
  ReducedState moved = moving.state;
  const auto column = [&](auto take) {
    return VectorX((Difference(base, take(kBy)) - Difference(base, take(-kBy))) / (2 * kBy));
  };
  // A coordinate of the mantle is small: one unit of it would turn it inside out.
  VectorX size = VectorX::Ones(n);
  if (moving.model.mantle) {
    for (const int at : {6, n / 2 + 6}) {
      size.segment(at + moving.model.mantle_first(), moving.model.mantle->size) =
          moving.model.mantle->basis.scale;
    }
  }
  const double largest = (jacobian.state * size.asDiagonal()).cwiseAbs().maxCoeff();
  for (int j = 0; j < n; ++j) {
    if (!free && (j < 6 || (j >= n / 2 && j < n / 2 + 6))) continue;  // given
    const VectorX difference = column([&](double by) {
      MoveState(moving.state, by * size(j) * VectorX::Unit(n, j), &moved);
      return moving.Take(moved, kCurrent_m_s);
    });
    EXPECT_LT((difference - size(j) * jacobian.state.col(j)).cwiseAbs().maxCoeff(), kNear * largest)
        << j;
  }
  for (int j = 0; j < 3; ++j) {
    const VectorX difference = column(
        [&](double by) { return moving.Take(moving.state, kCurrent_m_s + by * Vector3::Unit(j)); });
    EXPECT_GT(difference.norm(), 1e-3);
    EXPECT_LT((difference - by_current.col(j)).cwiseAbs().maxCoeff(),
              kNear * by_current.cwiseAbs().maxCoeff())
        << j;
  }
  const VectorX by_step =
      column([&](double by) { return moving.Take(moving.state, kCurrent_m_s, kStep_s + by); });
  EXPECT_LT((by_step - jacobian.step).cwiseAbs().maxCoeff(),
            1e-3 * jacobian.step.cwiseAbs().maxCoeff());
}

}  // namespace
}  // namespace mantle::reduced
