#include "reduced/build/cubature.h"

#include <gtest/gtest.h>

#include <random>

namespace mantle::reduced {
namespace {

Eigen::MatrixXd SmoothFamily(int rows, int columns) {
  Eigen::MatrixXd g(rows, columns);
  for (int i = 0; i < rows; ++i) {
    for (int j = 0; j < columns; ++j) {
      const double x = (j + 0.5) / columns;
      g(i, j) = std::pow(x, i) / columns;
    }
  }
  return g;
}

TEST(Cubature, FewPositiveWeightsIntegrateASmoothFamily) {
  constexpr double kTolerance = 1e-6;
  const Cubature c = ChooseCubature(SmoothFamily(8, 200), kTolerance);
  EXPECT_LE(c.residual, kTolerance);
  EXPECT_LE(c.column.size(), 12u);
  double sum = 0;
  for (double w : c.weight) {
    EXPECT_GT(w, 0.0);
    sum += w;
  }
  EXPECT_NEAR(sum, 200.0, 1e-3);  // the constant function: all elements
}

TEST(Cubature, IsDeterministicAndTightensWithTolerance) {
  const Eigen::MatrixXd g = SmoothFamily(12, 100);
  const Cubature a = ChooseCubature(g, 1e-3), b = ChooseCubature(g, 1e-3);
  EXPECT_EQ(a.column, b.column);
  EXPECT_EQ(a.weight, b.weight);
  const Cubature fine = ChooseCubature(g, 1e-7);
  EXPECT_LE(fine.residual, 1e-7);
  EXPECT_GT(fine.column.size(), a.column.size());
}

}  // namespace
}  // namespace mantle::reduced
