#include "reduced/dense.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>

#include "tests/support/random_values.h"

namespace mantle::reduced {
namespace {

// Random matrices of this size have condition numbers of some hundreds.
constexpr double kRoundOff = 1e-11;

Eigen::MatrixXd RandomMatrix(int rows, int columns, unsigned seed) {
  tests::RandomValues random(seed);
  Eigen::MatrixXd m(rows, columns);
  for (int i = 0; i < rows; ++i) {
    for (int j = 0; j < columns; ++j) m(i, j) = random.Uniform();
  }
  return m;
}

TEST(DenseLu, SolvesVectorsAndPanelsOfAnySize) {
  for (int n : {1, 3, 4, 7, 21, 42}) {
    const Eigen::MatrixXd a = RandomMatrix(n, n, n);
    DenseLu lu(n);
    lu.Factor(RandomMatrix(n, n, 99));  // nothing is kept of an earlier matrix
    lu.Factor(a);
    const Eigen::VectorXd b = RandomMatrix(n, 1, 100 + n);
    Eigen::VectorXd x = b;
    lu.Solve(&x);
    EXPECT_LT((a * x - b).cwiseAbs().maxCoeff(), kRoundOff * (1.0 + x.norm())) << n;
    const Panel right = RandomMatrix(n, PanelColumns(n + 3), 200 + n);
    Panel y = right;
    lu.Solve(&y);
    EXPECT_LT((a * y - right).cwiseAbs().maxCoeff(), kRoundOff * (1.0 + y.norm())) << n;
  }
}

TEST(DenseLu, PivotsWhereTheDiagonalVanishes) {
  Eigen::MatrixXd a(3, 3);
  a << 0, 2, 0, 0, 0, 4, 5, 0, 0;
  DenseLu lu(3);
  lu.Factor(a);
  Eigen::VectorXd x = Eigen::Vector3d(2, 4, 5);
  lu.Solve(&x);
  EXPECT_EQ(x, Eigen::VectorXd(Eigen::Vector3d(1, 1, 1)));
}

TEST(DenseLu, SingularMatrixIsSeenInTheResult) {
  Eigen::MatrixXd a = RandomMatrix(5, 5, 1);
  a.col(3).setZero();
  DenseLu lu(5);
  lu.Factor(a);
  Eigen::VectorXd x = Eigen::VectorXd::Ones(5);
  lu.Solve(&x);
  EXPECT_FALSE(x.allFinite());
}

TEST(AddProduct, EqualsTheMatrixProductOnPartsOfMatrices) {
  const Eigen::MatrixXd a = RandomMatrix(9, 8, 3);
  const Panel b = RandomMatrix(10, PanelColumns(20), 4);
  Panel c = RandomMatrix(6, PanelColumns(20), 5);
  const Panel expected = c + a.block(2, 1, 6, 7) * b.middleRows(1, 7);
  AddProduct(a.block(2, 1, 6, 7), b.middleRows(1, 7), c);
  EXPECT_LT((c - expected).cwiseAbs().maxCoeff(), kRoundOff);
}

}  // namespace
}  // namespace mantle::reduced
