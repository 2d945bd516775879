#include "model/rod_middle.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/gradient_checker.h"
#include "tests/support/random_values.h"

namespace mantle::model {
namespace {

using tests::RandomValues;

constexpr double kRoundOff = 1e-13;    // relative, a hundred operations
constexpr double kDifferences = 1e-9;  // fourth-order differences, step 1e-3 of the scale
// Rotations across an element [rad], over the range that elements may take.
constexpr double kRotations[] = {0.0, 1e-10, 1e-7, 1e-4, 1e-2, 0.3, 1.5, 2.8};

struct Case {
  Pose g1, g2;
  Vector6 d, eta1, eta2;
};
Case RandomCase(RandomValues* random, double rotation) {
  Case c;
  c.g1 = random->AnyPose(1.0);
  c.d << rotation * random->Direction(), 0.03 * (Vector3::UnitX() + 0.3 * random->Cube());
  c.g2 = c.g1 * ExpSE3(c.d);
  c.eta1 = random->Twist(3.0, 0.5);
  c.eta2 = random->Twist(3.0, 0.5);
  return c;
}
RodMiddle MiddleBetween(const Pose& g1, const Pose& g2) { return MiddleOf(Inverse(g1) * g2); }

// Body twist of a moving pose at t = 0.
template <typename Path>
Vector6 TwistOf(const Path& path) {
  const Pose now = path(0.0);
  return tests::DifferenceRate([&](double t) -> Vector6 { return LogSE3(Inverse(now) * path(t)); },
                               1e-3);
}

TEST(RodMiddle, LiesHalfWayOnTheHelix) {
  RandomValues random(1);
  for (double rotation : kRotations) {
    const Case c = RandomCase(&random, rotation);
    const RodMiddle m = MiddleBetween(c.g1, c.g2);
    EXPECT_LT((LogSE3(m.half) - 0.5 * c.d).norm(), kRoundOff * (1.0 + rotation)) << rotation;
    // either sign of the quaternions is the same pose
    Pose other = c.g2;
    other.rotation.coeffs() *= -1.0;
    EXPECT_LT((MiddleBetween(c.g1, other).tau - m.tau).norm(), kRoundOff) << rotation;
  }
}

TEST(RodMiddle, TwistIsThatOfThePoseItHas) {
  RandomValues random(2);
  for (double rotation : kRotations) {
    const Case c = RandomCase(&random, rotation);
    const auto path = [&](double t) {
      const Pose g1 = c.g1 * ExpSE3(t * c.eta1);
      return g1 * MiddleBetween(g1, c.g2 * ExpSE3(t * c.eta2)).half;
    };
    const Vector6 eta = MiddleTwist(MiddleBetween(c.g1, c.g2), c.eta1, c.eta2);
    EXPECT_TRUE(tests::JacobianMatches(eta, TwistOf(path), kDifferences)) << rotation;
  }
}

TEST(RodMiddle, BiasIsWhatTheNodesAccelerationsDoNotMake) {
  RandomValues random(3);
  for (double rotation : kRotations) {
    const Case c = RandomCase(&random, rotation);
    const Vector6 a1 = random.Twist(20, 3), a2 = random.Twist(20, 3);
    const auto twist = [&](double t) -> Vector6 {
      // g1(t) with the twist eta1 + a1 t, to second order in t
      const Pose g1 = c.g1 * ExpSE3(t * c.eta1 + 0.5 * t * t * a1);
      const Pose g2 = c.g2 * ExpSE3(t * c.eta2 + 0.5 * t * t * a2);
      return MiddleTwist(MiddleBetween(g1, g2), c.eta1 + t * a1, c.eta2 + t * a2);
    };
    const RodMiddle m = MiddleBetween(c.g1, c.g2);
    const Vector6 eta = MiddleTwist(m, c.eta1, c.eta2);
    const Vector6 rate = MiddleTwist(m, a1, a2) + MiddleBias(m, c.eta1, c.eta2, eta);
    EXPECT_TRUE(tests::JacobianMatches(rate, tests::DifferenceRate(twist, 1e-3), kDifferences))
        << rotation;
  }
}

TEST(RodMiddle, RigidMotionCarriesItRigidly) {
  RandomValues random(4);
  for (double rotation : kRotations) {
    const Case c = RandomCase(&random, rotation);
    const RodMiddle m = MiddleBetween(c.g1, c.g2);
    const Vector6 eta2 = AdjointInverseTimes(ExpSE3(c.d), c.eta1);
    const Vector6 eta = MiddleTwist(m, c.eta1, eta2);
    EXPECT_LT((eta - AdjointInverseTimes(m.half, c.eta1)).norm(), kRoundOff * c.eta1.norm());
    EXPECT_LT(MiddleBias(m, c.eta1, eta2, eta).norm(), kRoundOff * c.eta1.squaredNorm());
  }
}

TEST(RodMiddle, WrenchesDoTheSamePowerOnTheNodes) {
  RandomValues random(5);
  for (double rotation : kRotations) {
    const Case c = RandomCase(&random, rotation);
    const RodMiddle m = MiddleBetween(c.g1, c.g2);
    const Vector6 w = random.Twist(0.1, 5.0);
    Vector6 f1 = Vector6::Zero(), f2 = Vector6::Zero();
    AddMiddleWrench(m, w, &f1, &f2);
    const double scale = f1.norm() * c.eta1.norm() + f2.norm() * c.eta2.norm();
    EXPECT_NEAR(f1.dot(c.eta1) + f2.dot(c.eta2), w.dot(MiddleTwist(m, c.eta1, c.eta2)),
                kRoundOff * scale);
  }
}

Eigen::MatrixXd Assembled(const MiddleBlocks& b) {
  Eigen::MatrixXd a(12, 12);
  a << b.a11, b.a12, b.a21, b.a22;
  return a;
}

TEST(RodMiddle, FormIsTheFormOfTheTwists) {
  RandomValues random(6);
  Matrix6 form;
  for (int k = 0; k < 6; ++k) form.col(k) = random.Twist(1, 1);
  const Case c = RandomCase(&random, 0.7);
  const RodMiddle m = MiddleBetween(c.g1, c.g2);
  Eigen::VectorXd x(12), y(12);
  x << c.eta1, c.eta2;
  y << random.Twist(1, 1), random.Twist(1, 1);
  const double expected =
      MiddleTwist(m, y.head<6>(), y.tail<6>()).dot(form * MiddleTwist(m, c.eta1, c.eta2));
  EXPECT_NEAR(y.dot(Assembled(MiddleForm(m, form)) * x), expected, 1e-13);
}

TEST(RodMiddle, NodesForcesTurnWithTheShape) {
  RandomValues random(7);
  for (double rotation : {1e-6, 0.01, 0.4, 2.0}) {
    const Case c = RandomCase(&random, rotation);
    const Vector6 w = random.Twist(0.1, 5.0);
    const auto forces = [&](const Eigen::VectorXd& zeta) -> Eigen::VectorXd {
      Vector6 f1 = Vector6::Zero(), f2 = Vector6::Zero();
      AddMiddleWrench(MiddleBetween(c.g1 * ExpSE3(zeta.head<6>()), c.g2 * ExpSE3(zeta.tail<6>())),
                      w, &f1, &f2);
      Eigen::VectorXd f(12);
      f << f1, f2;
      return -f;
    };
    const Eigen::MatrixXd numeric = tests::DifferenceJacobian(forces, Eigen::VectorXd::Zero(12),
                                                              Eigen::VectorXd::Constant(12, 1e-3));
    const RodMiddle m = MiddleBetween(c.g1, c.g2);
    MiddleBlocks blocks = MiddleForm(m, Matrix6::Zero());
    SubtractMiddleTurn(m, w, &blocks);
    EXPECT_TRUE(tests::JacobianMatches(Assembled(blocks), numeric, kDifferences)) << rotation;
  }
}

TEST(RodMiddle, PointAheadMovesAsItsFrame) {
  RandomValues random(8);
  const Vector6 eta = random.Twist(3, 1), w = random.Twist(1, 5);
  const double ahead = 0.02;
  const Pose shift{Eigen::Quaterniond::Identity(), Vector3(ahead, 0, 0)};
  EXPECT_LT((TwistAhead(ahead, eta) - AdjointInverseTimes(shift, eta)).norm(), kRoundOff);
  EXPECT_LT((WrenchFromAhead(ahead, w) - AdjointInverseTransposeTimes(shift, w)).norm(), kRoundOff);
  Matrix6 form = random.Twist(1, 1).asDiagonal();
  const double expected = TwistAhead(ahead, w).dot(form * TwistAhead(ahead, eta));
  FormFromAhead(ahead, &form);
  EXPECT_NEAR(w.dot(form * eta), expected, kRoundOff * (1.0 + std::abs(expected)));
}

}  // namespace
}  // namespace mantle::model
