#include "controller/horizon.h"

#include <gtest/gtest.h>

#include <cmath>

namespace mantle::controller {
namespace {

constexpr double kRoundOff = 1e-13;  // sums of some tens of numbers of order one

ControlGrid Grid(int steps, double step_s, double growth, std::vector<int> knots = {}) {
  return {steps, step_s, growth, std::move(knots)};
}

// Two motors: one decides at the knots, one at every node.
std::vector<MotorLimits> Motors() {
  std::vector<MotorLimits> motors(2);
  motors[1].decides_every_node = true;
  return motors;
}

std::vector<Horizon> Horizons() {
  return {MakeHorizon(Grid(1, 0.05, 1.0), Motors()), MakeHorizon(Grid(20, 0.05, 1.0), Motors()),
          MakeHorizon(Grid(24, 0.05, 1.08), Motors()),
          MakeHorizon(Grid(12, 0.1, 1.0, {2, 3, 7, 12}), Motors())};
}

TEST(Horizon, HatsReproduceLinearFunctionsOfTime) {
  // Two hats that sum to one and weigh their knots' times to the node's are the linear
  // interpolation; before the first knot the other end is node 0, which is not decided.
  for (const Horizon& h : Horizons()) {
    ASSERT_EQ(h.hats.size(), 2 * h.time_s.size());
    for (int m : {0, 1}) {
      EXPECT_EQ(h.hat(0, m).decision, (std::array{-1, -1}));
      for (int k = 1; k <= h.steps(); ++k) {
        double sum = 0, time = 0;
        for (int i : {0, 1}) {
          const int j = h.hat(k, m).decision[i];
          if (j < 0) continue;
          EXPECT_EQ(h.decisions[j].motor, m);
          EXPECT_GE(h.hat(k, m).weight[i], 0.0);
          sum += h.hat(k, m).weight[i];
          time += h.hat(k, m).weight[i] * h.time_s[h.decisions[j].at];
        }
        EXPECT_NEAR(time, h.time_s[k], kRoundOff) << k;
        if (k >= (m == 0 ? h.knots.front() : 1)) {
          EXPECT_NEAR(sum, 1.0, kRoundOff) << k;
        }
      }
    }
  }
}

TEST(Horizon, DecisionsAreTheKnotsOfEveryMotor) {
  for (const Horizon& h : Horizons()) {
    std::vector<int> found(2, 0);
    double length = 0;
    for (int j = 0; j < h.decision_count(); ++j) {
      const Horizon::Decision& d = h.decisions[j];
      ++found[d.motor];
      EXPECT_LT(d.from, d.at);
      EXPECT_TRUE(h.decides(d.at, d.motor));
      EXPECT_EQ(h.hat(d.at, d.motor).decision, (std::array{-1, j}));
      EXPECT_EQ(d.from, d.before < 0 ? 0 : h.decisions[d.before].at);
      if (j > 0) {
        EXPECT_GE(d.from, h.decisions[j - 1].from);
      }
      length += d.length_s;
    }
    EXPECT_EQ(found, (std::vector{h.knot_count(), h.steps()}));
    // Hats sum to one but for half of the first interval of each motor.
    const double missing = 0.5 * (h.time_s[h.knots.front()] + h.time_s[1]);
    EXPECT_NEAR(length, 2 * h.length_s() - missing, kRoundOff);
    // What moves nodes 0..k is a head of the decisions.
    for (int k = 0; k <= h.steps(); ++k) {
      for (int j = 0; j < h.decision_count(); ++j) {
        EXPECT_EQ(j < h.Active(k), h.decisions[j].from < k) << k << " " << j;
      }
    }
  }
}

TEST(Horizon, DefaultKnotsAscendAndEndAtTheLastNode) {
  for (int steps = 1; steps <= 80; ++steps) {
    const Horizon h = MakeHorizon(Grid(steps, 0.05, 1.0), Motors());
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
  EXPECT_EQ(MakeHorizon(Grid(9, 0.1, 1.0, knots), Motors()).knots, knots);
}

TEST(Horizon, StepsGrowGeometrically) {
  const double step_s = 0.05, growth = 1.1;
  const Horizon h = MakeHorizon(Grid(20, step_s, growth), Motors());
  EXPECT_EQ(h.steps(), 20);
  EXPECT_EQ(h.time_s.front(), 0.0);
  for (int k = 0; k < h.steps(); ++k) {
    EXPECT_NEAR(h.step(k), step_s * std::pow(growth, k), kRoundOff);
  }
  EXPECT_NEAR(h.length_s(), step_s * (std::pow(growth, 20) - 1) / (growth - 1), kRoundOff);
}

TEST(Horizon, AChangeIsLinearBetweenAMotorsDecisions) {
  const Horizon h = MakeHorizon(Grid(12, 0.1, 1.05, {2, 3, 7, 12}), Motors());
  const int nodes = h.steps() + 1;
  Eigen::VectorXd w(h.decision_count());
  for (Eigen::Index i = 0; i < w.size(); ++i) w(i) = std::sin(1.0 + 2.0 * static_cast<double>(i));
  const Eigen::MatrixXd before = Eigen::MatrixXd::Constant(2, nodes, 0.3);
  Eigen::MatrixXd u = before;
  AddChange(h, w, &u);
  EXPECT_EQ(u.col(0), before.col(0));
  // The piecewise linear function through (0, 0) and (t_at, w).
  for (int m : {0, 1}) {
    double t0 = 0, w0 = 0;
    for (int j = 0; j < h.decision_count(); ++j) {
      const Horizon::Decision& d = h.decisions[j];
      if (d.motor != m) continue;
      for (int k = d.from + 1; k <= d.at; ++k) {
        const double line = w0 + (h.time_s[k] - t0) / (h.time_s[d.at] - t0) * (w(j) - w0);
        EXPECT_NEAR(u(m, k) - before(m, k), line, kRoundOff) << m << " " << k;
      }
      t0 = h.time_s[d.at];
      w0 = w(j);
    }
  }
}

}  // namespace
}  // namespace mantle::controller
