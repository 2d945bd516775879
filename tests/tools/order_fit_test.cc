#include "tools/studies/order_fit.h"

#include <gtest/gtest.h>

#include <cmath>

namespace mantle::tools {
namespace {

// The fit scans orders in steps of 0.005.
constexpr double kOrderStep = 0.006;

std::vector<ConvergencePoint> Power(double constant, double order, double reference = 0) {
  std::vector<ConvergencePoint> points;
  for (int k = 0; k < 6; ++k) {
    const double size = 0.1 * std::pow(0.5, k);
    points.push_back({size, constant * (std::pow(size, order) - std::pow(reference, order))});
  }
  return points;
}

TEST(OrderFit, FindsOrderAndConstantOfAPower) {
  const auto fit = FitOrder(Power(0.3, 2), 0, 0, 1);
  ASSERT_TRUE(fit);
  EXPECT_NEAR(fit->order, 2, kOrderStep);
  EXPECT_NEAR(fit->constant, 0.3, 0.02);
  EXPECT_EQ(fit->points, 6);
  EXPECT_NEAR(fit->SizeFor(0.3 * 1e-4), 0.01, 1e-3);
}

TEST(OrderFit, AllowsForAReferenceThatIsNotExact) {
  // Against a mesh twice as fine as the finest, errors fall faster than the order says.
  const double reference = 0.5 * 0.1 * std::pow(0.5, 5);
  const auto points = Power(1, 2, reference);
  EXPECT_NEAR(FitOrder(points, reference, 0, 1)->order, 2, kOrderStep);
  EXPECT_GT(FitOrder(points, 0, 0, 1)->order, 2 + 2 * kOrderStep);
}

TEST(OrderFit, LeavesOutWhatTheReferenceDoesNotResolveAndWhatIsTooCoarse) {
  auto points = Power(1, 3);
  points[0].error = 0.9;     // not in the asymptotic range
  points[5].error = 4.5e-8;  // the reference's own error
  const auto fit = FitOrder(points, 0, 1e-7, 0.05);
  ASSERT_TRUE(fit);
  EXPECT_NEAR(fit->order, 3, kOrderStep);
  EXPECT_EQ(fit->points, 4);
}

TEST(OrderFit, SaysHowMuchErrorsScatter) {
  auto points = Power(1, 2);
  EXPECT_NEAR(FitOrder(points, 0, 0, 1)->scatter, 0, 0.01);
  points[2].error *= 3;
  EXPECT_GT(FitOrder(points, 0, 0, 1)->scatter, 0.3);
}

TEST(OrderFit, NeedsThreeErrors) {
  EXPECT_FALSE(FitOrder({{0.1, 1e-2}, {0.05, 1e-3}}, 0, 0, 1));
  EXPECT_FALSE(FitOrder(Power(1e-12, 2), 0, 1e-8, 1));
  EXPECT_FALSE(FitOrder({}, 0, 0, 1));
}

TEST(ParetoFront, HoldsWhatNoOtherPointBeatsInBoth) {
  const std::vector<double> cost{1, 2, 3, 4, NAN, 1}, error{0.5, 0.6, 0.1, 0.1, 0, 0.7};
  EXPECT_EQ(ParetoFront(cost, error), (std::vector<int>{0, 2}));
}

TEST(LargestSizeWithin, LiesBetweenNeighbours) {
  const double size = LargestSizeWithin(Power(1, 2), 2.5e-3);
  EXPECT_NEAR(size, 0.05, 1e-6);
  EXPECT_EQ(LargestSizeWithin(Power(1, 2), 1e-9), 0);
  EXPECT_EQ(LargestSizeWithin(Power(1, 2), 1), 0.1);
  // A coarse size that errs little by chance does not count beyond one that errs more.
  EXPECT_LT(LargestSizeWithin({{0.1, 1e-5}, {0.05, 1e-2}, {0.025, 1e-4}}, 1e-3), 0.05);
}

}  // namespace
}  // namespace mantle::tools
