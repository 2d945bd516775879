#include "controller/plan.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/controller/control_scene.h"

namespace mantle::controller {
namespace {

using tests::ControlScene;

class PlanOfSteering : public testing::Test {
 protected:
  PlanOfSteering()
      : world_("steer.toml", {"control.grid.steps=6", "control.grid.step=0.1",
                              "control.grid.growth=1.2", "control.grid.knots=[1,3,6]"}),
        horizon_(MakeHorizon(world_.scene.control->grid, world_.scene.control->motors)) {
    const Trajectory t = world_.Motion(horizon_);
    for (double s : horizon_.time_s) plan_.time_s.push_back(t.states[0].time_s + s);
    plan_.tensions = t.tensions;
    plan_.states = t.states;
  }
  ReducedState At(double t_s) const {
    ReducedState s = plan_.states[0];
    StateAt(plan_, t_s, &s);
    return s;
  }

  ControlScene world_;
  Horizon horizon_;
  Plan plan_;
};

TEST_F(PlanOfSteering, IntervalsHoldTheirBeginAndAreClampedOutside) {
  const int last = horizon_.steps() - 1;
  EXPECT_EQ(IntervalAt(plan_, plan_.start_s() - 1.0), 0);
  EXPECT_EQ(IntervalAt(plan_, plan_.end_s() + 1.0), last);
  EXPECT_EQ(IntervalAt(plan_, plan_.end_s()), last);
  for (int k = 0; k <= last; ++k) {
    EXPECT_EQ(IntervalAt(plan_, plan_.time_s[k]), k);
    EXPECT_EQ(IntervalAt(plan_, 0.5 * (plan_.time_s[k] + plan_.time_s[k + 1])), k);
  }
}

TEST_F(PlanOfSteering, TensionsAreLinearBetweenNodesAndConstantOutside) {
  constexpr double kRoundOff = 1e-12;  // of shares of an interval of times near 3 s
  VectorX u(world_.model.input_count());
  for (int k = 0; k < horizon_.steps(); ++k) {
    for (double s : {0.0, 0.25, 0.8}) {
      TensionsAt(plan_, plan_.time_s[k] + s * horizon_.step(k), u);
      const VectorX line = (1 - s) * plan_.tensions.col(k) + s * plan_.tensions.col(k + 1);
      EXPECT_LT((u - line).cwiseAbs().maxCoeff(), kRoundOff);
    }
  }
  TensionsAt(plan_, plan_.start_s() - 1.0, u);
  EXPECT_EQ(u, plan_.tensions.col(0));
  TensionsAt(plan_, plan_.end_s() + 1.0, u);
  EXPECT_EQ(u, plan_.tensions.rightCols<1>());
}

TEST_F(PlanOfSteering, StateMeetsNodesAndTheirRates) {
  constexpr double kRoundOff = 1e-11;  // exponential of a logarithm, differences over 0.1 s
  const int n = world_.model.velocity_count();
  VectorX difference(2 * n);
  for (int k = 0; k <= horizon_.steps(); ++k) {
    const ReducedState s = At(plan_.time_s[k]);
    StateDifference(plan_.states[k], s, difference);
    EXPECT_LT(difference.cwiseAbs().maxCoeff(), kRoundOff) << k;
    EXPECT_EQ(s.time_s, plan_.time_s[k]);
  }
}

TEST_F(PlanOfSteering, RatesAreTheDerivativeOfTheCoordinates) {
  constexpr double kStep_s = 1e-4;
  const int n = world_.model.velocity_count();
  for (int k = 0; k < horizon_.steps(); ++k) {
    for (double share : {0.2, 0.5, 0.9}) {
      const double t = plan_.time_s[k] + share * horizon_.step(k);
      const ReducedState a = At(t - kStep_s), s = At(t), b = At(t + kStep_s);
      const VectorX rate = (b.q - a.q) / (2 * kStep_s);
      // Central differences of a cubic are off by its third derivative (12 jumps / h^3) times
      // step^2 / 6: 2e-6 of the rates here.
      const double scale = std::max(1.0, rate.cwiseAbs().maxCoeff());
      EXPECT_LT((rate - s.v.tail(n - 6)).cwiseAbs().maxCoeff(), 1e-5 * scale) << k << " " << share;
    }
  }
}

TEST_F(PlanOfSteering, UniformMotionOfTheRootIsReproducedExactly) {
  // Along a screw both ends' twists are log(a^-1 b) / h, and the cubic is the straight line.
  model::Vector6 twist;
  twist << 0.4, -0.2, 0.3, 0.02, 0.01, 0.08;
  Plan plan = plan_;
  const double h = horizon_.step(0);
  for (int k : {0, 1}) {
    plan.states[k].v.head<6>() = twist;
    plan.states[k].root = model::ExpSE3(static_cast<double>(k) * h * twist);
  }
  ReducedState s = plan.states[0];
  StateAt(plan, plan.time_s[0] + 0.37 * h, &s);
  const model::Pose expected = model::ExpSE3(0.37 * h * twist);
  EXPECT_LT(model::LogSE3(model::Inverse(expected) * s.root).norm(), 1e-12);
  EXPECT_LT((s.v.head<6>() - twist).norm(), 1e-11);
}

TEST(LimitTensions, KeepsRatesThenBounds) {
  const std::vector<MotorLimits> limits(5, {0.1, 0.8, 2.0, false});
  VectorX before(5), u(5), expected(5);
  before << 0.4, 0.4, 0.4, 0.75, 0.15;
  u << 0.45, 0.9, 0.0, 2.0, -1.0;
  expected << 0.45, 0.5, 0.3, 0.8, 0.1;  // 0.1 N in 50 ms
  LimitTensions(limits, before, 0.05, u);
  EXPECT_LT((u - expected).cwiseAbs().maxCoeff(), 1e-15);
}

TEST(LimitTensions, ABoundBeatsTheRateWhereTheMotorIsOutside) {
  const std::vector<MotorLimits> limits(2, {0.1, 0.8, 2.0, false});
  VectorX before(2), u(2), expected(2);
  before << 1.5, 0.0;
  u << 1.5, 0.0;
  expected << 0.8, 0.1;
  LimitTensions(limits, before, 0.01, u);
  EXPECT_EQ(u, expected);
}

}  // namespace
}  // namespace mantle::controller
