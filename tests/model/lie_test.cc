#include "model/lie.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <vector>

#include "tests/support/gradient_checker.h"
#include "tests/support/matrix_series.h"
#include "tests/support/random_values.h"

namespace mantle::model {
namespace {

using tests::BlockError;
using tests::LongMatrix;
using tests::PowerSeries;
using tests::RandomValues;

// Issue: "hold full accuracy (relative 1e-13)" per 3x3 block, so that small parts count as well.
constexpr double kFullAccuracy = 1e-13;
constexpr double kPi = std::numbers::pi;

// Angles log-uniform over 1e-12 .. pi, and a hair to each side of every switch between series:
// |omega|^2 = 0.02 and 2.5 in lie.cc, sin^2(t/2) = 1e-4 in the logarithm, pi itself.
std::vector<double> Angles() {
  std::vector<double> angles;
  const int count = 400;
  for (int i = 0; i < count; ++i) {
    angles.push_back(1e-12 * std::pow(kPi / 1e-12, i / (count - 1.0)));
  }
  for (double at : {std::sqrt(0.02), std::sqrt(2.5), 2.0 * std::asin(1e-2)}) {
    for (double side : {-1e-3, -1e-9, -1e-15, 0.0, 1e-15, 1e-9, 1e-3}) {
      angles.push_back(at * (1.0 + side));
    }
  }
  angles.back() = kPi * (1.0 - 1e-9);
  return angles;
}

// For every angle a random axis and a linear part between a fine rod's element and a whole arm.
template <typename Visit>
void Sweep(unsigned seed, Visit visit) {
  RandomValues random(seed);
  for (double angle : Angles()) {
    Vector6 d;
    d << angle * random.Direction(), std::pow(10.0, random.Between(-3.0, 0.0)) * random.Cube();
    visit(d, angle);
  }
}

Matrix3 Rotation(const Pose& g) { return g.rotation.toRotationMatrix(); }

TEST(Lie, HatActsAsCrossProduct) {
  RandomValues random(1);
  const Vector3 a = random.Cube(), b = random.Cube();
  EXPECT_EQ(Hat(a) * b, a.cross(b));
  EXPECT_EQ(Vee(Hat(a)), a);
}

TEST(Lie, ExpMatchesMatrixSeries) {
  const auto coefficients = tests::ExponentialCoefficients();
  Sweep(2, [&](const Vector6& d, double angle) {
    const LongMatrix reference = PowerSeries(tests::LongTwistMatrix(d), coefficients);
    const Pose g = ExpSE3(d);
    EXPECT_LT(BlockError(Rotation(g), reference.topLeftCorner(3, 3)), kFullAccuracy) << angle;
    EXPECT_LT(BlockError(g.position, reference.topRightCorner(3, 1)), kFullAccuracy) << angle;
    // The vector part of the quaternion keeps relative accuracy where R - 1 no longer shows it.
    const Eigen::Quaterniond q = tests::QuaternionOf(reference.topLeftCorner(3, 3));
    EXPECT_LT((g.rotation.vec() - q.vec()).norm(), kFullAccuracy * q.vec().norm()) << angle;
    EXPECT_NEAR(g.rotation.norm(), 1.0, 1e-15);
  });
}

TEST(Lie, ExpOfLongRotationVectorsStaysAccurate) {
  RandomValues random(3);
  for (double angle : {kPi, 3.5, 2.0 * kPi, 9.0, 31.0}) {
    const Vector3 axis = random.Direction();
    const Matrix3 r = ExpSO3(angle * axis).toRotationMatrix();
    const Matrix3 reference = Eigen::AngleAxis<long double>(angle * axis.cast<long double>().norm(),
                                                            axis.cast<long double>().normalized())
                                  .toRotationMatrix()
                                  .cast<double>();
    EXPECT_LT((r - reference).norm(), 31.0 * 1e-15) << angle;
  }
}

TEST(Lie, LogInvertsExp) {
  const auto coefficients = tests::ExponentialCoefficients();
  Sweep(4, [&](const Vector6& d, double angle) {
    const LongMatrix m = PowerSeries(tests::LongTwistMatrix(d), coefficients);
    Pose g;
    g.rotation = tests::QuaternionOf(m.topLeftCorner(3, 3));
    g.position = m.topRightCorner(3, 1).cast<double>();
    const Vector6 log = LogSE3(g);
    EXPECT_LT(BlockError(log, d.cast<long double>()), kFullAccuracy) << angle;
    // The double cover gives the same logarithm.
    g.rotation.coeffs() = -g.rotation.coeffs();
    EXPECT_EQ(LogSE3(g), log) << angle;
  });
}

TEST(Lie, LogAtPiKeepsTheStoredAxis) {
  RandomValues random(5);
  const Vector3 axis = random.Direction();
  const Vector3 log = LogSO3(Eigen::Quaterniond(0.0, axis.x(), axis.y(), axis.z()));
  EXPECT_LT((log - kPi * axis).norm(), kPi * kFullAccuracy);
}

TEST(Lie, LogBeyondPiIsTheComplement) {
  RandomValues random(6);
  for (double beyond : {1e-9, 1e-3, 0.5, 2.0, 3.1}) {
    const Vector3 axis = random.Direction();
    const Vector3 log = LogSO3(ExpSO3((kPi + beyond) * axis));
    EXPECT_LT((log + (kPi - beyond) * axis).norm(), kPi * kFullAccuracy) << beyond;
    Vector6 d;
    d << (kPi + beyond) * axis, random.Cube();
    const Pose g = ExpSE3(d);
    const Pose back = ExpSE3(LogSE3(g));  // another vector, the same pose
    EXPECT_LT((Rotation(back) - Rotation(g)).norm(), 10 * kFullAccuracy) << beyond;
    EXPECT_LT((back.position - g.position).norm(), 10 * kFullAccuracy) << beyond;
  }
}

TEST(Lie, IdentityHasZeroLogAndUnitOperators) {
  EXPECT_EQ(LogSE3(Pose::Identity()), Vector6(Vector6::Zero()));
  EXPECT_EQ(TangentOperator(Vector6::Zero()), Matrix6(Matrix6::Identity()));
  EXPECT_EQ(TangentOperatorInverse(Vector6::Zero()), Matrix6(Matrix6::Identity()));
}

TEST(Lie, AdjointIsExponentialOfSmallAdjoint) {
  const auto coefficients = tests::ExponentialCoefficients();
  Sweep(7, [&](const Vector6& d, double angle) {
    EXPECT_EQ(SmallAdjoint(d), Matrix6(tests::LongSmallAdjoint(d).cast<double>()));
    const LongMatrix reference = PowerSeries(tests::LongSmallAdjoint(d), coefficients);
    EXPECT_LT(BlockError(Adjoint(ExpSE3(d)), reference), kFullAccuracy) << angle;
  });
}

TEST(Lie, AdjointActionsAgreeWithTheirMatrices) {
  RandomValues random(8);
  for (int i = 0; i < 20; ++i) {
    const Pose g = random.AnyPose(1.0), h = random.AnyPose(1.0);
    const Vector6 x = random.Twist(1, 1), d = random.Twist(1, 1);
    const Matrix6 inverse = Adjoint(Inverse(g));
    constexpr double kRoundOff = 2e-15;  // a dozen operations on numbers of order one
    EXPECT_LT((AdjointInverseTimes(g, x) - inverse * x).norm(), kRoundOff);
    EXPECT_LT((AdjointInverseTransposeTimes(g, x) - inverse.transpose() * x).norm(), kRoundOff);
    EXPECT_LT((Adjoint(g * h) - Adjoint(g) * Adjoint(h)).norm(), 2 * kRoundOff);
    EXPECT_LT((Adjoint(g) * inverse - Matrix6::Identity()).norm(), 2 * kRoundOff);
    EXPECT_LT((SmallAdjointTimes(d, x) - SmallAdjoint(d) * x).norm(), kRoundOff);
    EXPECT_LT((CoadjointTimes(d, x) - SmallAdjoint(d).transpose() * x).norm(), kRoundOff);
    EXPECT_LT((CoadjointMatrix(x) * d - CoadjointTimes(d, x)).norm(), kRoundOff);
  }
}

TEST(Lie, TangentOperatorMatchesMatrixSeries) {
  const auto coefficients = tests::TangentCoefficients();
  RandomValues random(9);
  Sweep(9, [&](const Vector6& d, double angle) {
    const LongMatrix reference = PowerSeries(tests::LongSmallAdjoint(d), coefficients);
    EXPECT_LT(BlockError(TangentOperator(d), reference), kFullAccuracy) << angle;
    const Vector6 x = random.Twist(1, 1);
    EXPECT_LT((TangentOperatorTimes(d, x) - TangentOperator(d) * x).norm(), 1e-15 * 10);
  });
}

TEST(Lie, InverseTangentOperatorMatchesMatrixSeries) {
  auto coefficients = tests::EvenInverseCoefficients();
  coefficients[1] = 0.5L;
  RandomValues random(10);
  Sweep(10, [&](const Vector6& d, double angle) {
    const LongMatrix reference = PowerSeries(tests::LongSmallAdjoint(d), coefficients);
    EXPECT_LT(BlockError(TangentOperatorInverse(d), reference), kFullAccuracy) << angle;
    const Vector6 x = random.Twist(1, 1);
    EXPECT_LT((TangentOperatorInverseTimes(d, x) - TangentOperatorInverse(d) * x).norm(), 1e-14);
  });
}

TEST(Lie, TangentOperatorTimesItsInverseIsIdentity) {
  Sweep(11, [](const Vector6& d, double angle) {
    const Matrix6 product = TangentOperator(d) * TangentOperatorInverse(d);
    EXPECT_LT((product - Matrix6::Identity()).norm(), 10 * kFullAccuracy) << angle;
  });
  RandomValues random(11);
  for (double angle : {kPi, 4.0, 5.0, 6.0}) {  // exists up to 2 pi, where it grows without bound
    Vector6 d;
    d << angle * random.Direction(), random.Cube();
    const Matrix6 inverse = TangentOperatorInverse(d);
    EXPECT_LT((TangentOperator(d) * inverse - Matrix6::Identity()).norm(),
              kFullAccuracy * inverse.norm())
        << angle;
  }
}

TEST(Lie, TangentOperatorIsTheBodyVelocityOfExp) {
  RandomValues random(12);
  for (double angle : {1e-3, 0.5, 1.58, 3.0}) {
    Vector6 d;
    d << angle * random.Direction(), random.Cube();
    const Pose inverse = Inverse(ExpSE3(d));
    const auto increment = [&](const Eigen::VectorXd& x) -> Eigen::VectorXd {
      return LogSE3(inverse * ExpSE3(x));
    };
    const Eigen::MatrixXd numeric =
        tests::DifferenceJacobian(increment, d, Eigen::VectorXd::Constant(6, 1e-3));
    constexpr double kDifferences = 1e-10;  // 1e-12 truncation, 1e-13 round-off, times |d|
    EXPECT_TRUE(tests::JacobianMatches(TangentOperator(d), numeric, kDifferences)) << angle;
  }
}

TEST(Lie, EvenTangentInverseAndItsTransposeMatchTheSeries) {
  const auto coefficients = tests::EvenInverseCoefficients();
  RandomValues random(13);
  Sweep(13, [&](const Vector6& d, double angle) {
    const EvenTangentInverse even(d);
    const LongMatrix reference = PowerSeries(tests::LongSmallAdjoint(d), coefficients);
    EXPECT_LT(BlockError(even.Matrix(), reference), kFullAccuracy) << angle;
    const Vector6 x = random.Twist(1, 1);
    EXPECT_LT((even.Times(x) - even.Matrix() * x).norm(), 1e-14);
    EXPECT_LT((even.TransposeTimes(x) - even.Matrix().transpose() * x).norm(), 1e-14);
  });
}

TEST(Lie, DerivativesOfEvenTangentInverseMatchTheSeries) {
  const auto coefficients = tests::EvenInverseCoefficients();
  RandomValues random(14);
  Sweep(14, [&](const Vector6& d, double angle) {
    const EvenTangentInverse even(d);
    const Vector6 x = random.Twist(1, 1);
    LongMatrix forward(6, 6), transposed(6, 6);
    for (int j = 0; j < 6; ++j) {
      const LongMatrix e = tests::SeriesDerivative(d, Vector6::Unit(j), coefficients);
      forward.col(j) = e * x.cast<long double>();
      transposed.col(j) = e.transpose() * x.cast<long double>();
    }
    EXPECT_LT(BlockError(even.Derivative(x), forward), kFullAccuracy) << angle;
    EXPECT_LT(BlockError(even.TransposeDerivative(x), transposed), kFullAccuracy) << angle;
  });
}

TEST(Lie, RelativePoseIsObjective) {
  RandomValues random(15);
  for (int i = 0; i < 50; ++i) {
    const Pose g1 = random.AnyPose(1.0), g2 = random.AnyPose(1.0), h = random.AnyPose(1.0);
    const Vector6 d = LogSE3(Inverse(g1) * g2);
    const Vector6 moved = LogSE3(Inverse(h * g1) * (h * g2));
    if (d.head<3>().norm() > 3.0) continue;  // the branch cut
    EXPECT_LT((d - moved).norm(), 1e-13);
  }
}

}  // namespace
}  // namespace mantle::model
