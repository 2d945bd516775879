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
    const Vector6 rate = MiddleTwist(m, a1, a2) + MiddleBias(m, c.eta1, c.eta2);
    EXPECT_TRUE(tests::JacobianMatches(rate, tests::DifferenceRate(twist, 1e-3), kDifferences))
        << rotation;
  }
}

TEST(RodMiddle, TauMovesWithTheNodes) {
  RandomValues random(9);
  for (double rotation : kRotations) {
    const Case c = RandomCase(&random, rotation);
    const auto tau = [&](double t) -> Vector6 {
      return MiddleBetween(c.g1 * ExpSE3(t * c.eta1), c.g2 * ExpSE3(t * c.eta2)).tau;
    };
    const Vector6 rate = MiddleTauRate(MiddleBetween(c.g1, c.g2), c.eta1, c.eta2);
    EXPECT_TRUE(tests::JacobianMatches(rate, tests::DifferenceRate(tau, 1e-3), kDifferences))
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
    EXPECT_LT(MiddleBias(m, c.eta1, eta2).norm(), kRoundOff * c.eta1.squaredNorm());
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

// A middle that carries a mass and a wrench that follows it, moved by increments zeta of its nodes
// as a stage of a step moves them.
struct Stage {
  Case c;
  Vector6 a1, a2, inertia, wrench;
  double ahead_m, s, chart;

  // Forces of inertia on the nodes, less those of the wrench.
  Eigen::VectorXd Residual(const Eigen::VectorXd& zeta) const {
    const auto moved = [&](const Vector6& eta, const Vector6& z) -> Vector6 {
      return eta + s * z + chart * SmallAdjointTimes(eta, z);
    };
    const Vector6 z1 = zeta.head<6>(), z2 = zeta.tail<6>();
    const Vector6 eta1 = moved(c.eta1, z1), eta2 = moved(c.eta2, z2);
    const RodMiddle m = MiddleBetween(c.g1 * ExpSE3(z1), c.g2 * ExpSE3(z2));
    const Vector6 rate =
        TwistAhead(ahead_m, MiddleTwist(m, a1 + s * (eta1 - c.eta1), a2 + s * (eta2 - c.eta2)) +
                                MiddleBias(m, eta1, eta2));
    Vector6 f1 = Vector6::Zero(), f2 = Vector6::Zero();
    AddMiddleWrench(m, WrenchFromAhead(ahead_m, inertia.cwiseProduct(rate) - wrench), &f1, &f2);
    Eigen::VectorXd f(12);
    f << f1, f2;
    return f;
  }
  // Differences of Residual less MiddleTangent.
  Eigen::MatrixXd LeftOut() const {
    const RodMiddle m = MiddleBetween(c.g1, c.g2);
    const Vector6 eta = MiddleTwist(m, c.eta1, c.eta2);
    Matrix6 of_frame = inertia.asDiagonal();
    FormFromAhead(ahead_m, &of_frame);
    const Matrix6 form = of_frame * (s * s * Matrix6::Identity() + chart * s * SmallAdjoint(eta));
    const Vector6 rate =
        TwistAhead(ahead_m, MiddleTwist(m, a1, a2) + MiddleBias(m, c.eta1, c.eta2));
    const MiddleMotion motion{inertia,
                              ahead_m,
                              WrenchFromAhead(ahead_m, inertia.cwiseProduct(rate) - wrench),
                              MiddleTauRate(m, c.eta1, c.eta2),
                              c.eta2 - c.eta1,
                              a2 - a1};
    const Eigen::MatrixXd numeric =
        tests::DifferenceJacobian([&](const Eigen::VectorXd& zeta) { return Residual(zeta); },
                                  Eigen::VectorXd::Zero(12), Eigen::VectorXd::Constant(12, 1e-3));
    return numeric - Assembled(MiddleTangent(m, form, motion, s, chart));
  }
};
Stage RandomStage(RandomValues* random, double rotation, double s, double chart) {
  Stage stage{RandomCase(random, rotation),
              random->Twist(60, 9),
              random->Twist(60, 9),
              {},
              random->Twist(0.1, 5.0),
              0.004,
              s,
              chart};
  stage.inertia << 2e-3, 1e-3, 1.5e-3, 0.4, 0.7, 0.7;
  return stage;
}

TEST(RodMiddle, TangentIsCompleteWhereTheShapeDoesNotMove) {
  RandomValues random(7);
  for (double rotation : {1e-6, 0.01, 0.4, 2.0}) {
    for (double chart : {0.0, 0.5, 1.0}) {
      Stage stage = RandomStage(&random, rotation, 300.0, chart);
      stage.c.eta1.setZero();
      stage.c.eta2.setZero();
      const double scale = 300.0 * 300.0 * 0.7;
      EXPECT_LT(stage.LeftOut().cwiseAbs().maxCoeff(), kDifferences * scale) << rotation;
    }
  }
}

TEST(RodMiddle, TangentLeavesOutOnlySquaresOfRates) {
  // What is left out must be the same for any s: neither s^2 nor s times a rate is in it.
  RandomValues random(8);
  for (double rotation : {1e-6, 0.01, 0.4, 2.0}) {
    for (double chart : {0.0, 0.5, 1.0}) {
      Stage stage = RandomStage(&random, rotation, 300.0, chart);
      const Eigen::MatrixXd left_out = stage.LeftOut();
      stage.s = 600.0;
      const double scale = 600.0 * 600.0 * 0.7;
      EXPECT_LT((stage.LeftOut() - left_out).cwiseAbs().maxCoeff(), kDifferences * scale)
          << rotation << " " << chart;
      // 3 rad/s and 0.5 m/s on 0.7 kg
      EXPECT_LT(left_out.cwiseAbs().maxCoeff(), 0.7 * 3.0 * 3.0 * 5) << rotation << " " << chart;
    }
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
