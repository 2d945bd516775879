#include "controller/baselines.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "controller/gait.h"
#include "tests/controller/steered.h"
#include "tests/reduced/reduced_robots.h"
#include "tests/support/allocation_counter.h"

namespace mantle::controller {
namespace {

using tests::Steered;

constexpr double kPeriod_s = 0.01;  // of SYNC
constexpr ControllerKind kBaselines[] = {ControllerKind::kGait, ControllerKind::kPursuit,
                                         ControllerKind::kPid, ControllerKind::kLqr};

std::vector<std::unique_ptr<Steered>> EveryGoal() {
  std::vector<std::unique_ptr<Steered>> all;
  all.push_back(tests::SteeredVehicle(tests::StraightPath()));
  all.push_back(tests::SteeredVehicle(CruiseTask{Vector3::UnitZ(), 0.06}));
  all.push_back(tests::SteeredTip());
  for (auto& s : all) {
    for (BaselineGains& g : s->options.baselines) {
      g.integral = 0.5;
      g.derivative = 0.5;
      g.lookahead_s = 0.3;
      g.speed_gain = 5;
    }
  }
  return all;
}

VectorX GaitAlone(const Steered& s, double t_s) {
  VectorX tensions(s.model.input_count());
  GaitTensions(s.options.gait, t_s, tensions);
  return tensions;
}

TEST(Baselines, TensionsStayWithinBoundsWhateverTheEstimate) {
  for (const auto& s : EveryGoal()) {
    for (const ControllerKind kind : kBaselines) {
      const auto controller = MakeBaseline(s->parts(), kind);
      controller->Start(InitialState(s->model));
      VectorX tensions = VectorX::Zero(s->model.input_count());
      for (unsigned k = 1; k <= 60; ++k) {
        ReducedState state = tests::RandomReducedState(s->model, k % 3 == 0 ? 30.0 : 0.5, k);
        state.time_s = (k - 1) * kPeriod_s;
        controller->Command(k * kPeriod_s, &state, tensions);
        for (Eigen::Index i = 0; i < tensions.size(); ++i) {
          ASSERT_GE(tensions(i), s->options.motors[i].min_tension_n);
          ASSERT_LE(tensions(i), s->options.motors[i].max_tension_n);
        }
      }
    }
  }
}

TEST(Baselines, TheGaitGoesOnWithoutAnEstimate) {
  const auto s = tests::SteeredVehicle(tests::StraightPath());
  ReducedState broken = tests::RandomReducedState(s->model, 0.3, 1);
  constexpr double kRoundOff = 1e-9;
  broken.q(2) = std::numeric_limits<double>::quiet_NaN();
  for (const ControllerKind kind : kBaselines) {
    const auto controller = MakeBaseline(s->parts(), kind);
    controller->Start(InitialState(s->model));
    VectorX tensions(s->model.input_count());
    for (int k = 1; k <= 80; ++k) {
      const double t = k * kPeriod_s;
      controller->Command(t, k % 2 == 0 ? &broken : nullptr, tensions);
      // The reference still gathers speed: 2 s from rest.
      ASSERT_LT((tensions - 0.5 * t * GaitAlone(*s, t)).norm(), kRoundOff) << t;
    }
  }
}

TEST(Baselines, EachPullsTowardsWhatIsBesideIt) {
  // The path lies along e3; the vehicle is 50 mm off it towards -e1.
  const auto s = tests::SteeredVehicle(tests::StraightPath());
  const Eigen::Matrix2Xd n = PullDirections(s->model, -1);
  ReducedState state = InitialState(s->model);
  state.root.position.x() = -0.05;
  for (const ControllerKind kind :
       {ControllerKind::kPursuit, ControllerKind::kPid, ControllerKind::kLqr}) {
    const auto controller = MakeBaseline(s->parts(), kind);
    controller->Start(state);
    VectorX tensions(s->model.input_count());
    for (int k = 1; k <= 10; ++k) {  // the regulator decides rates
      state.time_s = (k - 1) * kPeriod_s;
      controller->Command(k * kPeriod_s, &state, tensions);
    }
    for (int i = 0; i < 4; ++i) {
      if (n(0, i) > 0.9) {
        EXPECT_GT(tensions(i), 0.01) << i;
      }
      if (n(0, i) < -0.9) {
        EXPECT_EQ(tensions(i), 0.0) << i;
      }
    }
  }
}

TEST(Baselines, TheGaitGrowsWhereTheVehicleIsBehindAndNeverBeyondItsLimits) {
  const auto s = tests::SteeredVehicle(tests::StraightPath());
  s->options.baselines[1].speed_gain = 5;
  const double largest = LargestScale(s->options.gait, s->options.motors);
  // 0.5 N within 0.4 of 0.8 s are 1.56 N/s of 2, and 0.8 N may be pulled: the rate comes first.
  EXPECT_NEAR(largest, 2.0 * 0.4 * 0.8 / 0.5, 1e-12);
  const auto controller = MakeBaseline(s->parts(), ControllerKind::kPursuit);
  ReducedState state = InitialState(s->model);
  state.time_s = 10.0;
  const double at = s->reference.At(state.time_s).position.z();
  VectorX tensions(s->model.input_count());
  constexpr double kPeak_s = 0.4 * 0.8;  // of a pulse that begins at 9.6 s
  const auto scale = [&](double behind_m) {
    state.root.position.z() = at - behind_m;
    controller->Start(state);
    controller->Command(9.6 + kPeak_s, &state, tensions);
    return tensions(4) / 0.5;
  };
  constexpr double kRoundOff = 1e-9;
  EXPECT_NEAR(scale(0.0), 1.0, kRoundOff);
  EXPECT_NEAR(scale(0.02), 1.1, kRoundOff);
  EXPECT_NEAR(scale(-0.02), 0.9, kRoundOff);
  EXPECT_NEAR(scale(1.0), largest, kRoundOff);
  EXPECT_NEAR(scale(-1.0), 0.0, kRoundOff);
}

TEST(Baselines, OnACircleTheGaitLeadsAndGrowsWithTheRadius) {
  const auto s = tests::SteeredTip();
  BaselineGains& g = s->options.baselines[0];
  g.gait_lead_s = 0.3;
  const auto controller = MakeBaseline(s->parts(), ControllerKind::kGait);
  controller->Start(InitialState(s->model));
  VectorX tensions(4);
  constexpr double kRoundOff = 1e-9;
  controller->Command(5.0, nullptr, tensions);
  EXPECT_LT((tensions - GaitAlone(*s, 5.3)).norm(), kRoundOff) << "on the circle";
  controller->Command(0.7, nullptr, tensions);  // half of the approach: half of the radius
  EXPECT_LT((tensions - 0.5 * GaitAlone(*s, 1.0)).norm(), kRoundOff);
}

TEST(Baselines, NothingIsAllocatedInACycle) {
  if (!tests::kCountsAllocations) GTEST_SKIP() << "nothing is counted on this platform";
  for (const auto& s : EveryGoal()) {
    for (const ControllerKind kind : kBaselines) {
      const auto controller = MakeBaseline(s->parts(), kind);
      ReducedState state = tests::RandomReducedState(s->model, 0.3, 2);
      controller->Start(state);
      VectorX tensions(s->model.input_count());
      state.time_s = kPeriod_s;
      controller->Command(2 * kPeriod_s, &state, tensions);
      state.time_s = 2 * kPeriod_s;
      const long before = tests::allocation_count;
      controller->Command(3 * kPeriod_s, &state, tensions);
      EXPECT_EQ(tests::allocation_count - before, 0) << static_cast<int>(kind);
    }
  }
}

TEST(LateralPid, TheIntegralRemovesAConstantDisturbance) {
  // A plant that answers at once: error = wanted - (pull + disturbance).
  LateralPid pid{.proportional = 0.5, .integral = 2.0, .most_n = 10.0};
  SteeringError e;
  const Vector2 wanted(0.3, -0.2), disturbance(-0.4, 0.1);
  Vector2 pull = Vector2::Zero();
  for (int k = 0; k < 1000; ++k) {
    e.error = wanted - pull - disturbance;
    pull = pid.Update(e, kPeriod_s);
  }
  constexpr double kGone = 1e-4;  // ten seconds at a rate of 2 / 1.5 per second
  EXPECT_LT(e.error.norm(), kGone);
}

TEST(LateralPid, DoesNotWindUpWhileItsPullIsCut) {
  constexpr double kMost_n = 0.8;
  LateralPid pid{.proportional = 1.0, .integral = 2.0, .most_n = kMost_n};
  const SteeringError far{{0.6, 0.0}, {0.0, 0.0}}, past{{-0.1, 0.0}, {0.0, 0.0}};
  for (int k = 0; k < 1000; ++k) EXPECT_LE(pid.Update(far, kPeriod_s).norm(), kMost_n + 1e-15);
  // Ten seconds of 0.6 would have left 6 s of integral; it stopped where P + I reached the limit.
  constexpr double kOneStep = 0.6 * kPeriod_s;
  EXPECT_LE(2.0 * pid.sum.x(), kMost_n - 0.6 + 2.0 * kOneStep);
  // As soon as the error changes its sign, the pull leaves its limit.
  EXPECT_LT(pid.Update(past, kPeriod_s).x(), 0.2);
}

}  // namespace
}  // namespace mantle::controller
