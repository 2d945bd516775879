#include "reduced/quadrature.h"

#include <gtest/gtest.h>

#include <cmath>

namespace mantle::reduced {
namespace {

constexpr double kRoundOff = 2e-14;  // weights and points of up to 32 by bisection

double Integrate(const QuadratureRule& rule, int power) {
  double sum = 0;
  for (std::size_t i = 0; i < rule.point.size(); ++i) {
    sum += rule.weight[i] * std::pow(rule.point[i], power);
  }
  return sum;
}

TEST(Quadrature, LegendreIsExactToDegreeTwoNMinusOne) {
  for (int n : {1, 2, 3, 5, 8, 20, 32}) {
    const QuadratureRule rule = GaussLegendre(n);
    ASSERT_EQ(rule.point.size(), static_cast<std::size_t>(n));
    for (int p = 0; p < 2 * n; ++p) EXPECT_NEAR(Integrate(rule, p), 1.0 / (p + 1), kRoundOff) << n;
    EXPECT_GT(std::abs(Integrate(rule, 2 * n) - 1.0 / (2 * n + 1)), n < 8 ? kRoundOff : 0.0);
  }
}

TEST(Quadrature, RadauHoldsTheEndAndIsExactToDegreeTwoNMinusTwo) {
  for (int n : {1, 2, 3, 5, 8, 20, 32}) {
    const QuadratureRule rule = GaussRadau(n);
    ASSERT_EQ(rule.point.size(), static_cast<std::size_t>(n));
    EXPECT_EQ(rule.point.back(), 1.0);
    for (int p = 0; p < 2 * n - 1; ++p) {
      EXPECT_NEAR(Integrate(rule, p), 1.0 / (p + 1), kRoundOff) << n;
    }
  }
}

TEST(Quadrature, RefusesNoPointsAndTooMany) {
  EXPECT_THROW(GaussLegendre(0), std::invalid_argument);
  EXPECT_THROW(GaussRadau(kMaxQuadraturePoints + 1), std::invalid_argument);
}

}  // namespace
}  // namespace mantle::reduced
