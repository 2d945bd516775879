#include "model/rod_element.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/gradient_checker.h"
#include "tests/support/random_values.h"

namespace mantle::model {
namespace {

using tests::RandomValues;

constexpr double kRoundOff = 1e-13;    // relative, a few hundred operations
constexpr double kDifferences = 1e-9;  // fourth-order differences, step 1e-3 of the scale

RodElement TypicalElement(bool viscous) {
  RodElement e;
  e.length = 0.03;
  e.reference_strain << 0.5, -2.0, 1.0, 1.0, 0, 0;
  e.stiffness << 0.9e-3, 1.7e-3, 1.6e-3, 34, 17, 16;
  if (viscous) e.viscosity << 4e-6, 14e-6, 14e-6, 0.3, 0.1, 0.1;
  return e;
}

struct Case {
  Pose g1, g2;
  Vector6 eta1, eta2;
};
Case RandomCase(RandomValues* random, double rotation) {
  Case c;
  c.g1 = random->AnyPose(1.0);
  Vector6 d;
  d << rotation * random->Direction(), 0.03 * (Vector3::UnitX() + 0.3 * random->Cube());
  c.g2 = c.g1 * ExpSE3(d);
  c.eta1 = random->Twist(3.0, 0.5);
  c.eta2 = random->Twist(3.0, 0.5);
  return c;
}

TEST(RodElement, ForcesDoMinusTheStressPower) {
  RandomValues random(1);
  for (double rotation : {0.0, 1e-9, 1e-4, 0.1, 1.0, 2.7}) {
    const Case c = RandomCase(&random, rotation);
    RodElementState s;
    ASSERT_TRUE(EvaluateRodElement(c.g1, c.g2, c.eta1, c.eta2, &s));
    const Vector6 sigma = random.Twist(1, 30);
    Vector6 f1 = Vector6::Zero(), f2 = Vector6::Zero();
    AddRodElementForces(s, sigma, &f1, &f2);
    const double scale = f1.norm() * c.eta1.norm() + f2.norm() * c.eta2.norm();
    EXPECT_NEAR(f1.dot(c.eta1) + f2.dot(c.eta2), -sigma.dot(s.d_dot), kRoundOff * scale)
        << rotation;
  }
}

TEST(RodElement, StrainRateIsTheDerivativeOfStrain) {
  RandomValues random(2);
  for (double rotation : {1e-6, 0.2, 1.6, 2.5}) {
    const Case c = RandomCase(&random, rotation);
    RodElementState s;
    ASSERT_TRUE(EvaluateRodElement(c.g1, c.g2, c.eta1, c.eta2, &s));
    const auto strain = [&](double t) -> Vector6 {
      return LogSE3(Inverse(c.g1 * ExpSE3(t * c.eta1)) * (c.g2 * ExpSE3(t * c.eta2)));
    };
    EXPECT_TRUE(tests::JacobianMatches(s.d_dot, tests::DifferenceRate(strain, 1e-3), kDifferences))
        << rotation;
  }
}

TEST(RodElement, RestShapeIsFreeOfStressCurvedToo) {
  RandomValues random(3);
  const RodElement e = TypicalElement(true);
  const Pose g1 = random.AnyPose(1.0);
  const Pose g2 = g1 * ExpSE3(e.length * e.reference_strain);
  const Vector6 twist = random.Twist(2, 1);  // of g1; the element moves rigidly
  const Vector6 other = AdjointInverseTimes(ExpSE3(e.length * e.reference_strain), twist);
  RodElementState s;
  ASSERT_TRUE(EvaluateRodElement(g1, g2, twist, other, &s));
  const Vector6 scale = e.stiffness + e.viscosity / e.length;
  EXPECT_LT(RodStress(e, s).cwiseQuotient(scale).norm(), 100 * kRoundOff);
}

TEST(RodElement, HelicalFieldIsExact) {
  // Nodes on g(X) = exp(X xi^): any subdivision sees the same strain, bit for bit up to round-off.
  Vector6 xi;
  xi << 3.0, -5.0, 8.0, 1.1, 0.05, -0.1;
  for (int pieces : {1, 3, 10, 100}) {
    const double length = 0.2 / pieces;
    RodElement e = TypicalElement(false);
    e.length = length;
    RodElementState s;
    ASSERT_TRUE(EvaluateRodElement(ExpSE3(0.05 * xi), ExpSE3((0.05 + length) * xi), Vector6::Zero(),
                                   Vector6::Zero(), &s));
    EXPECT_LT((s.Strain(e) - xi).norm(), 1e-12 * xi.norm()) << pieces;
  }
}

TEST(RodElement, StressIsFrameInvariant) {
  RandomValues random(4);
  const RodElement e = TypicalElement(true);
  for (int i = 0; i < 20; ++i) {
    const Case c = RandomCase(&random, random.Between(0.0, 2.0));
    const Pose h = random.AnyPose(2.0);
    RodElementState s, moved;
    ASSERT_TRUE(EvaluateRodElement(c.g1, c.g2, c.eta1, c.eta2, &s));
    ASSERT_TRUE(EvaluateRodElement(h * c.g1, h * c.g2, c.eta1, c.eta2, &moved));
    const Vector6 a = RodStress(e, s), b = RodStress(e, moved);
    // positions of order 2 m carry 4e-16 m, an element of 0.03 m strains by 1e-14 of it
    EXPECT_LT((a - b).cwiseQuotient(e.stiffness).norm(), 1e-12);
  }
}

TEST(RodElement, RefusesAnElementThatTurnsTooFar) {
  Vector6 d = Vector6::Zero();
  d << kMaxElementRotation + 0.01, 0, 0, 0.03, 0, 0;
  RodElementState s;
  const Vector6 zero = Vector6::Zero();
  EXPECT_FALSE(EvaluateRodElement(Pose(), ExpSE3(d), zero, zero, &s));
  d(0) = kMaxElementRotation - 0.01;
  EXPECT_TRUE(EvaluateRodElement(Pose(), ExpSE3(d), zero, zero, &s));
  Pose broken;
  broken.position.x() = std::nan("");
  EXPECT_FALSE(EvaluateRodElement(Pose(), broken, zero, zero, &s));
}

// -(df/dzeta + s df/deta) against differences, with or without viscosity and a stress that depends
// on d as a cable's does.
void ExpectTangentsMatchDifferences(bool viscous, bool cable, double damping_scale,
                                    double rotation) {
  RandomValues random(5);
  const RodElement e = TypicalElement(viscous);
  const Case c = RandomCase(&random, rotation);
  Matrix6 cable_tangent = Matrix6::Zero();
  if (cable) {
    for (int i = 0; i < 6; ++i) cable_tangent.row(i) = random.Twist(1, 1).transpose();
    cable_tangent = (cable_tangent + cable_tangent.transpose()).eval();
  }
  const Vector6 tension = cable ? Vector6(random.Twist(0.1, 1.0)) : Vector6(Vector6::Zero());
  RodElementState s;
  ASSERT_TRUE(EvaluateRodElement(c.g1, c.g2, c.eta1, c.eta2, &s));
  const Vector6 d0 = s.d;
  const auto stress = [&](const RodElementState& at) -> Vector6 {
    return RodStress(e, at) + tension + cable_tangent * (at.d - d0);
  };
  // Increment zeta of both nodes with eta -> eta + s zeta.
  const auto force = [&](const Eigen::VectorXd& zeta) -> Eigen::VectorXd {
    RodElementState at;
    EXPECT_TRUE(EvaluateRodElement(c.g1 * ExpSE3(zeta.head<6>()), c.g2 * ExpSE3(zeta.tail<6>()),
                                   c.eta1 + damping_scale * zeta.head<6>(),
                                   c.eta2 + damping_scale * zeta.tail<6>(), &at));
    Vector6 f1 = Vector6::Zero(), f2 = Vector6::Zero();
    AddRodElementForces(at, stress(at), &f1, &f2);
    Eigen::VectorXd f(12);
    f << f1, f2;
    return f;
  };
  Eigen::VectorXd step = Eigen::VectorXd::Constant(12, 1e-3);
  for (int i : {3, 4, 5, 9, 10, 11}) step(i) = 1e-5;
  const Eigen::MatrixXd numeric =
      -tests::DifferenceJacobian(force, Eigen::VectorXd::Zero(12), step);
  RodElementTangent t;
  const Matrix6* cable_part = cable ? &cable_tangent : nullptr;
  RodElementTangents(e, s, c.eta1, c.eta2, stress(s), cable_part, damping_scale, &t);
  Eigen::MatrixXd analytic(12, 12);
  analytic << t.a11, t.a12, t.a21, t.a22;
  EXPECT_TRUE(tests::JacobianMatches(analytic, numeric, kDifferences))
      << "viscous " << viscous << " cable " << cable << " s " << damping_scale << " rotation "
      << rotation;
}

TEST(RodElement, TangentsMatchDifferences) {
  for (double rotation : {1e-6, 0.14, 0.9, 1.7, 2.6}) {
    for (bool viscous : {false, true}) {
      for (bool cable : {false, true}) {
        for (double s : {0.0, 341.0}) ExpectTangentsMatchDifferences(viscous, cable, s, rotation);
      }
    }
  }
}

TEST(RodElement, StiffnessOfAConservativeElementIsSymmetricUnstressed) {
  const RodElement e = TypicalElement(false);
  const Pose g2 = ExpSE3(e.length * e.reference_strain);
  RodElementState s;
  const Vector6 zero = Vector6::Zero();
  ASSERT_TRUE(EvaluateRodElement(Pose(), g2, zero, zero, &s));
  RodElementTangent t;
  RodElementTangents(e, s, zero, zero, RodStress(e, s), nullptr, 0.0, &t);
  EXPECT_LT((t.a12 - t.a21.transpose()).norm(), 1e-11 * t.a12.norm());
  EXPECT_LT((t.a11 - t.a11.transpose()).norm(), 1e-11 * t.a11.norm());
}

}  // namespace
}  // namespace mantle::model
