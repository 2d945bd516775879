#include "reduced/strain_basis.h"

#include <gtest/gtest.h>

#include "model/rod.h"
#include "reduced/quadrature.h"

namespace mantle::reduced {
namespace {

TEST(StrainBasis, ConstantStrainsPartTheArm) {
  ArmReduction r;
  r.segments = 3;
  const StrainBasis basis(r, 0.42);
  EXPECT_EQ(basis.size(), 12);
  ASSERT_EQ(basis.groups().size(), 3u);
  EXPECT_EQ(basis.groups().back().to_m, 0.42);
  Matrix6X b;
  basis.Evaluate(1, 0.2, &b);
  EXPECT_EQ(b.cols(), 4);
  EXPECT_EQ(b.sum(), 4.0);
  EXPECT_EQ(b.bottomRows<2>().cwiseAbs().sum(), 0.0);  // no shear among the four
}

TEST(StrainBasis, LegendreFunctionsAreOrthogonal) {
  ArmReduction r;
  r.basis = BasisKind::kLegendre;
  r.degree = 4;
  r.strains = kBending;
  const StrainBasis basis(r, 0.42);
  ASSERT_EQ(basis.size(), 10);
  const QuadratureRule rule = GaussLegendre(6);
  Eigen::MatrixXd gram = Eigen::MatrixXd::Zero(10, 10);
  Matrix6X b;
  for (std::size_t k = 0; k < rule.point.size(); ++k) {
    basis.Evaluate(0, 0.42 * rule.point[k], &b);
    gram += rule.weight[k] * b.transpose() * b;
  }
  for (int d = 0; d <= 4; ++d) {
    gram(2 * d, 2 * d) -= 1.0 / (2 * d + 1);
    gram(2 * d + 1, 2 * d + 1) -= 1.0 / (2 * d + 1);
  }
  EXPECT_LT(gram.cwiseAbs().maxCoeff(), 1e-14);  // round-off
}

TEST(StrainBasis, RefusesWhatCannotBe) {
  const auto refused = [](const ArmReduction& r, const char* word) {
    try {
      StrainBasis(r, 0.42);
      ADD_FAILURE() << "accepted: " << word;
    } catch (const model::BadRobot& error) {
      EXPECT_NE(std::string(error.what()).find(word), std::string::npos) << error.what();
    }
  };
  ArmReduction r;
  r.segments = 0;
  refused(r, "segments = 0");
  r = {};
  r.segment_ends_m = {0.1, 0.1, 0.42};
  refused(r, "segment of 0 m");
  r.segment_ends_m = {0.1, 0.3};
  refused(r, "0.42");
  r = {};
  r.strains = {};
  refused(r, "strains: none");
  r = {};
  r.basis = BasisKind::kLegendre;
  r.degree = 99;
  refused(r, "degree = 99");
}

}  // namespace
}  // namespace mantle::reduced
