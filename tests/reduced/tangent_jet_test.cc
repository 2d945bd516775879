#include "reduced/tangent_jet.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "tests/support/gradient_checker.h"
#include "tests/support/random_values.h"

namespace mantle::reduced {
namespace {

using tests::RandomValues;

Vector6 OfAngle(RandomValues& random, double angle) {
  Vector6 d;
  d << angle * random.Direction(), random.Cube();
  return d;
}

Matrix6 Full(const TangentBlocks& t) {
  Matrix6 m;
  m << t.f, Matrix3::Zero(), t.g, t.f;
  return m;
}

// Angles that straddle every switch of the series, pi, 2 pi and beyond.
const double kAngles[] = {1e-12,
                          1e-6,
                          1e-3,
                          0.1,
                          0.31,
                          0.32,
                          1.0,
                          1.99,
                          2.01,
                          3.1,
                          std::numbers::pi,
                          3.2,
                          5.0,
                          2 * std::numbers::pi,
                          6.33,
                          6.4,
                          9.0};

TEST(TangentJet, EqualsTheTangentOperatorAndExponentialOfTheLieGroup) {
  constexpr double kTolerance = 2e-12;  // lie.h keeps 1e-13 relative, times |v|, angle^2
  RandomValues random(1);
  for (double angle : kAngles) {
    const Vector6 d = OfAngle(random, angle);
    TangentJet jet;
    EvaluateTangentJet(d, Vector6::Zero(), &jet);
    EXPECT_LT((Full(jet.value) - model::TangentOperator(d)).cwiseAbs().maxCoeff(), kTolerance)
        << angle;
    const model::Pose g = model::ExpSE3(d);
    EXPECT_LT((jet.rotation - g.rotation.toRotationMatrix()).cwiseAbs().maxCoeff(), kTolerance);
    EXPECT_LT((jet.position - g.position).cwiseAbs().maxCoeff(), kTolerance);
  }
}

TEST(TangentJet, TimeDerivativesMatchDifferences) {
  constexpr double kFirst = 1e-8, kSecond = 1e-8;  // differences of fourth order with steps of 1e-3
  RandomValues random(2);
  for (double angle : kAngles) {
    const Vector6 d = OfAngle(random, angle), d1 = random.Twist(1, 1), d2 = random.Twist(1, 1);
    const auto curve = [&](double t) -> Vector6 { return d + t * d1 + 0.5 * t * t * d2; };
    const auto value = [&](double t) -> Eigen::VectorXd {
      TangentJet jet;
      EvaluateTangentJet(curve(t), d1 + t * d2, &jet);
      return Full(jet.value).reshaped();
    };
    const auto rate = [&](double t) -> Eigen::VectorXd {
      TangentJet jet;
      EvaluateTangentJet(curve(t), d1 + t * d2, &jet);
      return Full(jet.rate).reshaped();
    };
    TangentJet jet;
    const TangentCoefficients k = EvaluateTangentJet(d, d1, &jet);
    EvaluateSecondTangent(k, d, d1, d2, &jet);
    const Eigen::VectorXd first = Full(jet.rate).reshaped(), second = Full(jet.second).reshaped();
    EXPECT_LT((first - tests::DifferenceRate(value, 1e-3)).cwiseAbs().maxCoeff(), kFirst) << angle;
    EXPECT_LT((second - tests::DifferenceRate(rate, 1e-3)).cwiseAbs().maxCoeff(), kSecond) << angle;
  }
}

TEST(TangentJet, TransposeDerivativeMatchesDifferences) {
  constexpr double kTolerance = 1e-8;
  RandomValues random(3);
  for (double angle : kAngles) {
    const Vector6 d = OfAngle(random, angle), sigma = random.Twist(1, 1);
    TangentJet jet;
    const TangentCoefficients k = EvaluateTangentJet(d, Vector6::Zero(), &jet);
    const auto numeric = tests::DifferenceJacobian(
        [&](const Eigen::VectorXd& x) -> Eigen::VectorXd {
          TangentJet other;
          EvaluateTangentJet(x, Vector6::Zero(), &other);
          return other.value.TransposeTimes(sigma);
        },
        d, Eigen::VectorXd::Constant(6, 1e-3));
    EXPECT_TRUE(tests::JacobianMatches(TangentTransposeDerivative(k, d, sigma), numeric, kTolerance,
                                       kTolerance))
        << angle;
  }
}

}  // namespace
}  // namespace mantle::reduced
