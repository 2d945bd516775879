#include "model/loads.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "tests/support/gradient_checker.h"
#include "tests/support/random_values.h"

namespace mantle::model {
namespace {

using tests::RandomValues;

constexpr double kPi = std::numbers::pi;
constexpr double kRoundOff = 1e-14;    // relative, a handful of operations
constexpr double kDifferences = 1e-9;  // fourth-order differences with step 1e-3 of the scale

const SectionGeometry kSection{0.1, kPi * 0.012 * 0.012, 0.012};

SectionMotion RandomMotion(RandomValues* random) {
  return {random->AnyPose(1).rotation, random->Twist(1.0, 0.5)};
}

// Tangents of any load against differences in the body rotation increment and in the velocity.
template <typename Load>
void ExpectTangentMatchesDifferences(const Load& load, unsigned seed) {
  RandomValues random(seed);
  for (int trial = 0; trial < 5; ++trial) {
    const SectionMotion motion = RandomMotion(&random);
    LoadTangent tangent;
    load.AddTangent(kSection, motion, &tangent);
    const auto by_rotation = [&](const Eigen::VectorXd& zeta) -> Eigen::VectorXd {
      return load.Density(kSection, {motion.rotation * ExpSO3(zeta), motion.twist});
    };
    const auto by_velocity = [&](const Eigen::VectorXd& v) -> Eigen::VectorXd {
      SectionMotion m = motion;
      m.twist.tail<3>() = v;
      return load.Density(kSection, m);
    };
    const Eigen::VectorXd step = Eigen::VectorXd::Constant(3, 1e-3);
    const Eigen::MatrixXd rotation =
        tests::DifferenceJacobian(by_rotation, Eigen::VectorXd::Zero(3), step);
    const Eigen::MatrixXd velocity =
        tests::DifferenceJacobian(by_velocity, motion.twist.tail<3>(), step);
    Eigen::MatrixXd analytic(6, 3);
    analytic << tangent.moment_by_rotation, tangent.force_by_rotation;
    EXPECT_TRUE(tests::JacobianMatches(analytic, rotation, kDifferences, kDifferences));
    analytic << Matrix3::Zero(), tangent.force_by_velocity;
    EXPECT_TRUE(tests::JacobianMatches(analytic, velocity, kDifferences, kDifferences));
  }
}

TEST(GravityLoad, IsWeightMinusBuoyancyInTheWorldFrame) {  // erratum 4
  RandomValues random(1);
  const GravityLoad load{Vector3(0, 0, -9.81), 1100.0, 1022.0};
  const SectionMotion motion = RandomMotion(&random);
  const Vector6 w = load.Density(kSection, motion);
  const Vector3 world = motion.rotation * w.tail<3>();
  const double expected = -78.0 * kSection.area_m2 * 9.81;
  EXPECT_LT((world - Vector3(0, 0, expected)).norm(), kRoundOff * std::abs(expected) * 10);
  EXPECT_TRUE(w.head<3>().isZero(0.0));
}

TEST(GravityLoad, NeutralBodyFeelsExactlyNothing) {
  RandomValues random(2);
  const GravityLoad load{Vector3(0, 0, -9.81), 1022.0, 1022.0};
  EXPECT_TRUE(load.Density(kSection, RandomMotion(&random)).isZero(0.0));
}

TEST(GravityLoad, TangentMatchesDifferences) {
  ExpectTangentMatchesDifferences(GravityLoad{Vector3(1, 2, -9.81), 1100.0, 1022.0}, 3);
}

TEST(DragLoad, IsThePapersFormula) {  // [Renda] 2.6: -rho_w |v| h diag(pi/2 C_x, C_y, C_z) v
  const DragLoad load{1022.0, Vector3(0.01, 2.5, 2.0)};
  SectionMotion motion{Eigen::Quaterniond::Identity(), Vector6::Zero()};
  motion.twist << 5, 6, 7, 0.3, -0.4, 1.2;  // speed 1.3; rotation rate does not count
  const Vector6 w = load.Density(kSection, motion);
  const double k = -1022.0 * 1.3 * 0.012;
  EXPECT_NEAR(w(3), k * 0.5 * kPi * 0.01 * 0.3, 1e-14);
  EXPECT_NEAR(w(4), k * 2.5 * -0.4, 1e-12);
  EXPECT_NEAR(w(5), k * 2.0 * 1.2, 1e-12);
  EXPECT_TRUE(w.head<3>().isZero(0.0));
}

TEST(DragLoad, AlwaysTakesPower) {
  RandomValues random(4);
  const DragLoad load{1022.0, Vector3(0.01, 2.5, 2.5)};
  for (int i = 0; i < 100; ++i) {
    const SectionMotion motion = RandomMotion(&random);
    EXPECT_LT(load.Density(kSection, motion).dot(motion.twist), 0.0);
  }
}

TEST(DragLoad, TangentMatchesDifferencesAndVanishesAtRest) {
  const DragLoad load{1022.0, Vector3(0.01, 2.5, 2.0)};
  ExpectTangentMatchesDifferences(load, 5);
  LoadTangent tangent;
  load.AddTangent(kSection, {Eigen::Quaterniond::Identity(), Vector6::Zero()}, &tangent);
  EXPECT_TRUE(tangent.force_by_velocity.isZero(0.0));
}

TEST(DistributedLoad, FollowsTheBodyOrTheWorld) {
  RandomValues random(6);
  const Vector6 direction = random.Twist(1, 1);
  const SectionMotion motion = RandomMotion(&random);
  const DistributedLoad follower{direction, 1.0, 0.0, 0.42, LoadFrame::kBody};
  const double shape = 1.0 - kSection.x_m / 0.42;  // erratum 14: 0.05 (1 - X/L)
  EXPECT_LT((follower.Density(kSection, motion) - shape * direction).norm(), kRoundOff);
  const DistributedLoad dead{direction, 1.0, 0.0, 0.42, LoadFrame::kWorld};
  const Vector6 w = dead.Density(kSection, motion);
  EXPECT_LT((motion.rotation * w.head<3>() - shape * direction.head<3>()).norm(), kRoundOff);
  EXPECT_LT((motion.rotation * w.tail<3>() - shape * direction.tail<3>()).norm(), kRoundOff);
  ExpectTangentMatchesDifferences(follower, 7);
  ExpectTangentMatchesDifferences(dead, 8);
}

TEST(Section, MatchesCircularSectionFormulas) {  // [Renda] eq. 7 and 2.4, the 3 kept
  const Material m{110e3, 0.25, 300.0, 1022.0};
  const double r = 0.01, area = kPi * r * r, j = kPi * r * r * r * r / 4.0, g = 44e3;
  Vector6 expected;
  expected << 2 * g * j, 110e3 * j, 110e3 * j, 110e3 * area, 0.9 * g * area, 0.9 * g * area;
  EXPECT_LT((SectionStiffness(m, 0.9, r) - expected).cwiseQuotient(expected).norm(), kRoundOff);
  expected << 2 * j, 3 * j, 3 * j, 3 * area, area, area;
  expected *= 300.0;
  EXPECT_LT((SectionViscosity(m, r) - expected).cwiseQuotient(expected).norm(), kRoundOff);
  expected << 2 * j, j, j, area, area, area;
  expected *= 1022.0;
  EXPECT_LT((SectionInertia(1022.0, r) - expected).cwiseQuotient(expected).norm(), kRoundOff);
  EXPECT_NEAR(SectionAddedMass(1000.0, 1.5, r), 1500.0 * area, kRoundOff);
}

}  // namespace
}  // namespace mantle::model
