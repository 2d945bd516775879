#include "reduced/polynomial.h"

#include <gtest/gtest.h>

#include <cmath>

namespace mantle::reduced {
namespace {

double Cubic(const Eigen::VectorXd& x) {
  return 2 + x(0) - 3 * x(1) * x(2) + x(0) * x(0) * x(2) - 4 * x(1) * x(1) * x(1);
}

TEST(Polynomials, ReproduceACubicWithItsDerivatives) {
  constexpr double kRoundOff = 1e-10;  // of a fit over |x| <= 2
  Polynomials p(3, Eigen::VectorXd::Constant(3, 2.0), 1,
                [](const Eigen::VectorXd& x, Eigen::VectorXd* y) { (*y)(0) = Cubic(x); });
  PolynomialValues v;
  p.Size(&v);
  const Eigen::Vector3d x(0.3, -1.2, 0.7);
  p.Evaluate(x.data(), true, &v);
  EXPECT_NEAR(v.value(0), Cubic(x), kRoundOff);
  const Eigen::Vector3d gradient(1 + 2 * x(0) * x(2), -3 * x(2) - 12 * x(1) * x(1),
                                 -3 * x(1) + x(0) * x(0));
  EXPECT_LT((v.gradient.col(0) - gradient).cwiseAbs().maxCoeff(), kRoundOff);
  Eigen::Matrix3d hessian;
  hessian << 2 * x(2), 0, 2 * x(0), 0, -24 * x(1), -3, 2 * x(0), -3, 0;
  EXPECT_LT((v.hessian[0] - hessian).cwiseAbs().maxCoeff(), kRoundOff);
}

TEST(Polynomials, RefuseAFunctionOfHigherDegree) {
  EXPECT_THROW(
      Polynomials(2, Eigen::VectorXd::Ones(3), 1,
                  [](const Eigen::VectorXd& x, Eigen::VectorXd* y) { (*y)(0) = Cubic(x); }),
      std::runtime_error);
}

}  // namespace
}  // namespace mantle::reduced
