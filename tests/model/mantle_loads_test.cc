#include "model/mantle_loads.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "model/rigid_body.h"
#include "tests/support/paper_robot.h"
#include "tests/support/random_values.h"

namespace mantle::model {
namespace {

using tests::RandomValues;

constexpr double kPi = std::numbers::pi;
constexpr double kRoundOff = 1e-12;

TEST(Jet, ThrustIsTheMomentumFluxThroughTheOpenings) {  // erratum 10
  const Mantle m = tests::PaperMantle();
  const double nozzle = kPi * 0.01 * 0.01;
  // 100 mL/s out of one nozzle: 0.318 m/s, 1022 Q^2/A = 0.0325 N forward
  EXPECT_NEAR(EvaluateJet(m, 1022, -1e-4).thrust_n, 1022 * 1e-8 / nozzle, kRoundOff);
  EXPECT_NEAR(EvaluateJet(m, 1022, 1e-4).thrust_n, -1022 * 1e-8 / (3 * nozzle), kRoundOff);
  EXPECT_EQ(EvaluateJet(m, 1022, 0.0).thrust_n, 0.0);
}

TEST(Jet, SlopeMatchesDifferences) {
  const Mantle m = tests::PaperMantle();
  for (double q : {-3e-4, -1e-5, 2e-5, 4e-4}) {
    const double h = 1e-3 * q;
    const double slope =
        (EvaluateJet(m, 1022, q + h).thrust_n - EvaluateJet(m, 1022, q - h).thrust_n) / (2 * h);
    EXPECT_NEAR(EvaluateJet(m, 1022, q).thrust_by_flux, slope, 1e-10 * std::abs(slope));
  }
}

TEST(MantleDrag, IsThePapersFormulaAndOpposesMotion) {
  const Mantle m = tests::PaperMantle();
  const double expected = 0.5 * 1022 * 1.7 * kPi * 0.031 * 0.031 * 0.04;
  EXPECT_NEAR(MantleDrag(m, 1022, 0.031, 0.2), -expected, kRoundOff);
  EXPECT_NEAR(MantleDrag(m, 1022, 0.031, -0.2), expected, kRoundOff);
}

TEST(MantleLateralDrag, IsStripTheoryOnACylinder) {
  // Cylinder R from z = 0 to -L moving sideways at u: 1/2 rho C 2R L u^2 at -L/2.
  std::vector<Vector3> q;
  for (int i = 0; i <= 400; ++i) q.emplace_back(0.03, -0.1 * i / 400, 0);
  Vector6 twist = Vector6::Zero();
  twist(3) = 0.2;
  const double force = 0.5 * 1022 * 1.1 * 2 * 0.03 * 0.1 * 0.04;
  Vector6 w = MantleLateralDrag(q, 1022, 1.1, twist);
  EXPECT_NEAR(w(3), -force, kRoundOff);
  EXPECT_NEAR(w(1), 0.05 * force, kRoundOff);  // z x f
  // Pitching about the root: integral of rho C R w^2 z^2 |z| = rho C R w^2 L^4/4
  twist.setZero();
  twist(0) = 2.0;
  w = MantleLateralDrag(q, 1022, 1.1, twist);
  const double moment = 1022 * 1.1 * 0.03 * 4.0 * 1e-4 / 4.0;
  EXPECT_NEAR(w(0), -moment, 1e-4 * moment);  // midpoints of 400 slices
}

TEST(MantleLateralDrag, AlwaysTakesPower) {
  RandomValues random(1);
  const Shell shell = MakeShell(tests::PaperMantle(16), Water{}, Effects{});
  for (int i = 0; i < 50; ++i) {
    const Vector6 twist = random.Twist(3, 0.5);
    EXPECT_LT(MantleLateralDrag(shell.reference, 1022, 1.1, twist).dot(twist), 0.0);
  }
}

TEST(RigidBodyDrag, ActsOnTheConesProjections) {
  Vector6 twist = Vector6::Zero();
  twist(5) = -0.3;
  Vector6 w = RigidBodyDrag(tests::PaperCone(), RigidDrag{}, 1022, twist);
  EXPECT_NEAR(w(5), 0.5 * 1022 * kPi * 0.015 * 0.015 * 0.09, kRoundOff);
  twist.setZero();
  twist(4) = 0.3;
  w = RigidBodyDrag(tests::PaperCone(), RigidDrag{}, 1022, twist);
  const double force = 0.5 * 1022 * 1.1 * 0.015 * 0.112 * 0.09;
  EXPECT_NEAR(w(4), -force, kRoundOff);
  EXPECT_NEAR(w(0), -2.0 / 3.0 * 0.112 * force, kRoundOff);  // -z f_y with z = -2L/3, f_y = -force
}

TEST(RollDrag, IsQuadraticAboutTheAxis) {
  Vector6 twist;
  twist << 1, 2, -3, 4, 5, 6;
  const Vector6 w = RollDragWrench(RollDrag{}, twist);
  Vector6 expected = Vector6::Zero();
  expected(2) = 1.2e-3 * 9;
  EXPECT_LT((w - expected).norm(), 1e-16);
}

TEST(RigidBody, ConeHasTheInertiaOfThePaper) {
  // Independent: integrate discs from the apex down.
  const RigidBody cone = tests::PaperCone();
  Matrix6 sum = Matrix6::Zero();
  const int n = 20000;
  for (int i = 0; i < n; ++i) {
    const double z = -0.112 * (i + 0.5) / n, r = -0.015 * z / 0.112;
    const double m = 1022 * kPi * r * r * 0.112 / n;
    Matrix6 disc = Matrix6::Zero();
    disc.topLeftCorner<3, 3>() =
        m * Vector3(r * r / 4 + z * z, r * r / 4 + z * z, r * r / 2).asDiagonal();
    const Matrix3 u = m * Hat(Vector3(0, 0, z));
    disc.topRightCorner<3, 3>() = u;
    disc.bottomLeftCorner<3, 3>() = -u;
    disc.bottomRightCorner<3, 3>() = m * Matrix3::Identity();
    sum += disc;
  }
  EXPECT_LT((RigidInertia(cone) - sum).norm(), 1e-8 * sum.norm());  // midpoints: 1/n^2
  EXPECT_NEAR(RigidMass(cone), 0.027, 0.0005);
}

TEST(RigidBody, GivenInertiaIsMovedToTheRoot) {
  GivenInertia given{2.0, Vector3(0.1, -0.2, 0.3), Vector3(1, 2, 3).asDiagonal(), 1e-3};
  const Matrix6 m = RigidInertia({"body", given});
  RandomValues random(2);
  const Vector6 eta = random.Twist(1, 1);
  const Vector3 w = eta.head<3>();
  const Vector3 centre = eta.tail<3>() + w.cross(given.centre_m);
  const double energy = 0.5 * 2.0 * centre.squaredNorm() + 0.5 * w.dot(given.inertia_kg_m2 * w);
  EXPECT_NEAR(0.5 * eta.dot(m * eta), energy, kRoundOff);
}

}  // namespace
}  // namespace mantle::model
