#include "controller/horizon.h"

#include <gtest/gtest.h>

#include <cmath>

namespace mantle::controller {
namespace {

constexpr double kRoundOff = 1e-13;  // sums of some tens of numbers of order one

model::ControlGrid Grid(int steps, double step_s, double growth, std::vector<int> knots = {}) {
  return {steps, step_s, growth, std::move(knots)};
}

std::vector<Horizon> Horizons() {
  return {MakeHorizon(Grid(1, 0.05, 1.0)), MakeHorizon(Grid(20, 0.05, 1.0)),
          MakeHorizon(Grid(24, 0.05, 1.08)), MakeHorizon(Grid(12, 0.1, 1.0, {2, 3, 7, 12}))};
}

TEST(Horizon, HatsReproduceLinearFunctionsOfTime) {
  // Two hats that sum to one and weigh their knots' times to the node's are the linear
  // interpolation; before the first knot the other end is node 0, which is not decided.
  for (const Horizon& h : Horizons()) {
    ASSERT_EQ(h.hats.size(), h.time_s.size());
    EXPECT_EQ(h.hats[0].knot, (std::array{-1, -1}));
    for (int k = 1; k <= h.steps(); ++k) {
      double sum = 0, time = 0;
      for (int i : {0, 1}) {
        if (h.hats[k].knot[i] < 0) continue;
        EXPECT_GE(h.hats[k].weight[i], 0.0);
        sum += h.hats[k].weight[i];
        time += h.hats[k].weight[i] * h.time_s[h.knots[h.hats[k].knot[i]]];
      }
      EXPECT_NEAR(time, h.time_s[k], kRoundOff) << k;
      if (k >= h.knots.front()) {
        EXPECT_NEAR(sum, 1.0, kRoundOff) << k;
      }
    }
    for (int j = 0; j < h.knot_count(); ++j) {
      const Horizon::Hat& hat = h.hats[h.knots[j]];
      EXPECT_EQ(hat.knot, (std::array{-1, j}));
      EXPECT_EQ(hat.weight[1], 1.0);
    }
  }
}

TEST(Horizon, DefaultKnotsAscendAndEndAtTheLastNode) {
  for (int steps = 1; steps <= 80; ++steps) {
    const Horizon h = MakeHorizon(Grid(steps, 0.05, 1.0));
    EXPECT_EQ(h.knot_count(), std::min(8, steps));
    EXPECT_EQ(h.knots.back(), steps);
    EXPECT_GE(h.knots.front(), 1);
    for (int j = 1; j < h.knot_count(); ++j) EXPECT_LT(h.knots[j - 1], h.knots[j]) << steps;
    // denser at the beginning
    if (steps >= 16) {
      EXPECT_LT(h.knots[1] - h.knots[0], h.knots[7] - h.knots[6]) << steps;
    }
  }
}

TEST(Horizon, GivenKnotsAreKept) {
  const std::vector<int> knots = {1, 2, 5, 9};
  EXPECT_EQ(MakeHorizon(Grid(9, 0.1, 1.0, knots)).knots, knots);
}

TEST(Horizon, StepsGrowGeometrically) {
  const double step_s = 0.05, growth = 1.1;
  const Horizon h = MakeHorizon(Grid(20, step_s, growth));
  EXPECT_EQ(h.steps(), 20);
  EXPECT_EQ(h.time_s.front(), 0.0);
  for (int k = 0; k < h.steps(); ++k) {
    EXPECT_NEAR(h.step(k), step_s * std::pow(growth, k), kRoundOff);
  }
  EXPECT_NEAR(h.length_s(), step_s * (std::pow(growth, 20) - 1) / (growth - 1), kRoundOff);
}

TEST(Horizon, AChangeIsItsHatsTimesTheShapeMotorByMotor) {
  const Horizon h = MakeHorizon(Grid(12, 0.1, 1.05, {2, 3, 7, 12}));
  const int motors = 3, nodes = h.steps() + 1;
  Eigen::VectorXd w(motors * h.knot_count());
  for (Eigen::Index i = 0; i < w.size(); ++i) w(i) = std::sin(1.0 + 2.0 * static_cast<double>(i));
  Eigen::MatrixXd shape = Eigen::MatrixXd::Ones(motors, nodes);
  for (int k = 0; k < nodes; ++k) shape(1, k) = 0.5 + 0.5 * std::cos(k);
  const Eigen::MatrixXd before = Eigen::MatrixXd::Constant(motors, nodes, 0.3);
  Eigen::MatrixXd u = before;
  AddChange(h, shape, w, &u);
  EXPECT_EQ(u.col(0), before.col(0));
  for (int m = 0; m < motors; ++m) {
    for (int k = 1; k < nodes; ++k) {
      // the piecewise linear function through (0, 0) and (t_knot, w_knot)
      int right = 0;
      while (h.knots[right] < k) ++right;
      const double t1 = h.time_s[h.knots[right]], w1 = w(right * motors + m);
      const double t0 = right == 0 ? 0.0 : h.time_s[h.knots[right - 1]];
      const double w0 = right == 0 ? 0.0 : w((right - 1) * motors + m);
      const double line = w0 + (h.time_s[k] - t0) / (t1 - t0) * (w1 - w0);
      EXPECT_NEAR(u(m, k) - before(m, k), shape(m, k) * line, kRoundOff) << m << " " << k;
    }
  }
}

}  // namespace
}  // namespace mantle::controller
