#include "model/mantle_loads.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "model/rigid_body.h"
#include "tests/support/gradient_checker.h"
#include "tests/support/paper_robot.h"
#include "tests/support/random_values.h"

namespace mantle::model {
namespace {

using tests::RandomValues;

constexpr double kPi = std::numbers::pi;
constexpr double kRoundOff = 1e-12;

constexpr double kDifferences = 1e-9;  // fourth-order differences with step 1e-3 of the scale

JetLoad PaperJet() {
  const Mantle m = tests::PaperMantle();
  return {1022, m.nozzle_radius_m, m.outlets, m.inlets, FluxReading::kVolume};
}

SectionMotion Moving(const Vector6& twist) { return {Eigen::Quaterniond::Identity(), twist}; }

RigidDrag::RootLoad ConeDrag() {
  Robot robot;
  robot.rigid_body = tests::PaperCone();
  robot.effects.named.Set(RigidDrag{});
  return RigidDrag::RootLoad::From(*robot.effects.named.Get<RigidDrag>(), robot).value();
}

// Tangents of a load on the root against differences in its rotation and twist.
template <typename Load>
void ExpectTangentMatchesDifferences(const Load& load, unsigned seed) {
  RandomValues random(seed);
  for (int trial = 0; trial < 5; ++trial) {
    const SectionMotion root{random.AnyPose(1).rotation, random.Twist(1.0, 0.5)};
    RootTangent t;
    load.AddTangent(root, 0.7, &t);
    const auto by_rotation = [&](const Eigen::VectorXd& zeta) -> Eigen::VectorXd {
      return 0.7 * load.Wrench({root.rotation * ExpSO3(zeta), root.twist});
    };
    const auto by_twist = [&](const Eigen::VectorXd& v) -> Eigen::VectorXd {
      return 0.7 * load.Wrench({root.rotation, v});
    };
    EXPECT_TRUE(
        tests::JacobianMatches(t.by_rotation,
                               tests::DifferenceJacobian(by_rotation, Eigen::VectorXd::Zero(3),
                                                         Eigen::VectorXd::Constant(3, 1e-3)),
                               kDifferences, kDifferences));
    EXPECT_TRUE(tests::JacobianMatches(
        t.by_twist,
        tests::DifferenceJacobian(by_twist, root.twist, Eigen::VectorXd::Constant(6, 1e-3)),
        kDifferences, kDifferences));
  }
}

TEST(JetLoad, ThrustIsTheMomentumFluxThroughTheOpenings) {  // erratum 10
  const JetLoad jet = PaperJet();
  const double nozzle = kPi * 0.01 * 0.01;
  // 100 mL/s out of one nozzle: 0.318 m/s, 1022 Q^2/A = 0.0325 N forward
  EXPECT_NEAR(jet.Evaluate(-1e-4).thrust_n, 1022 * 1e-8 / nozzle, kRoundOff);
  EXPECT_NEAR(jet.Evaluate(1e-4).thrust_n, -1022 * 1e-8 / (3 * nozzle), kRoundOff);
  EXPECT_EQ(jet.Evaluate(0.0).thrust_n, 0.0);
}

TEST(JetLoad, SlopeMatchesDifferences) {
  const JetLoad jet = PaperJet();
  for (double q : {-3e-4, -1e-5, 2e-5, 4e-4}) {
    const double h = 1e-3 * q;
    const double slope = (jet.Evaluate(q + h).thrust_n - jet.Evaluate(q - h).thrust_n) / (2 * h);
    EXPECT_NEAR(jet.Evaluate(q).thrust_by_flux, slope, 1e-10 * std::abs(slope));
  }
}

TEST(AxialDragLoad, IsThePapersFormulaAndOpposesMotion) {
  const AxialDragLoad drag{1022, 1.7};
  const double expected = 0.5 * 1022 * 1.7 * kPi * 0.031 * 0.031 * 0.04;
  EXPECT_NEAR(drag.Force(0.031, 0.2), -expected, kRoundOff);
  EXPECT_NEAR(drag.Force(0.031, -0.2), expected, kRoundOff);
  EXPECT_NEAR(drag.ForceBySpeed(0.031, -0.2), -2 * expected / 0.2, kRoundOff);
}

TEST(LateralDragLoad, IsStripTheoryOnACylinder) {
  // Cylinder R from z = 0 to -L moving sideways at u: 1/2 rho C 2R L u^2 at -L/2.
  const LateralDragLoad drag{1022, 1.1};
  std::vector<Vector3> q;
  for (int i = 0; i <= 400; ++i) q.emplace_back(0.03, -0.1 * i / 400, 0);
  Vector6 twist = Vector6::Zero();
  twist(3) = 0.2;
  const double force = 0.5 * 1022 * 1.1 * 2 * 0.03 * 0.1 * 0.04;
  Vector6 w = drag.Wrench(q, twist);
  EXPECT_NEAR(w(3), -force, kRoundOff);
  EXPECT_NEAR(w(1), 0.05 * force, kRoundOff);  // z x f
  // Pitching about the root: integral of rho C R w^2 z^2 |z| = rho C R w^2 L^4/4
  twist.setZero();
  twist(0) = 2.0;
  w = drag.Wrench(q, twist);
  const double moment = 1022 * 1.1 * 0.03 * 4.0 * 1e-4 / 4.0;
  EXPECT_NEAR(w(0), -moment, 1e-4 * moment);  // midpoints of 400 slices
}

TEST(LateralDragLoad, AlwaysTakesPower) {
  RandomValues random(1);
  const Shell shell = MakeShell(tests::PaperMantle(16), Water{}, Effects{});
  for (int i = 0; i < 50; ++i) {
    const Vector6 twist = random.Twist(3, 0.5);
    EXPECT_LT((LateralDragLoad{1022, 1.1}.Wrench(shell.reference, twist)).dot(twist), 0.0);
  }
}

TEST(RigidDragLoad, ActsOnTheConesProjections) {
  Vector6 twist = Vector6::Zero();
  twist(5) = -0.3;
  Vector6 w = ConeDrag().Wrench(Moving(twist));
  EXPECT_NEAR(w(5), 0.5 * 1022 * kPi * 0.015 * 0.015 * 0.09, kRoundOff);
  twist.setZero();
  twist(4) = 0.3;
  w = ConeDrag().Wrench(Moving(twist));
  const double force = 0.5 * 1022 * 1.1 * 0.015 * 0.112 * 0.09;
  EXPECT_NEAR(w(4), -force, kRoundOff);
  EXPECT_NEAR(w(0), -2.0 / 3.0 * 0.112 * force, kRoundOff);  // -z f_y with z = -2L/3, f_y = -force
}

TEST(RollDragLoad, IsQuadraticAboutTheAxis) {
  Vector6 twist;
  twist << 1, 2, -3, 4, 5, 6;
  const Vector6 w = RollDrag::RootLoad{1.2e-3}.Wrench(Moving(twist));
  Vector6 expected = Vector6::Zero();
  expected(2) = 1.2e-3 * 9;
  EXPECT_LT((w - expected).norm(), 1e-16);
}

TEST(RootLoads, TangentsMatchDifferences) {
  ExpectTangentMatchesDifferences(
      RigidGravityLoad{Vector3(1, 2, -9.81), 0.5, 0.2, Vector3(0.1, -0.2, 0.3)}, 3);
  ExpectTangentMatchesDifferences(RollDrag::RootLoad{1.2e-3}, 4);
  ExpectTangentMatchesDifferences(ConeDrag(), 5);
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
