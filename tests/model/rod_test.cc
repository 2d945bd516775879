#include "model/rod.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "tests/support/gradient_checker.h"
#include "tests/support/paper_robot.h"
#include "tests/support/random_values.h"

namespace mantle::model {
namespace {

using tests::PaperArm;
using tests::RandomValues;

constexpr double kPi = std::numbers::pi;
constexpr double kRoundOff = 1e-13;  // relative: sums over some hundred nodes

Rod Make(const Arm& arm, const Effects& effects = {}) { return MakeRod(arm, Water{}, effects); }

// Integral over all places of what a place has.
template <typename Value>
double Sum(const Rod& rod, Value value) {
  double sum = 0;
  for (const auto* places : {&rod.nodes, &rod.middles}) {
    for (const RodNode& n : *places) sum += value(n);
  }
  return sum;
}

// Integral of x^k r^2 along a frustum of radii a and b, in closed form.
double FrustumMoment(double length, double a, double b, int k) {
  const double slope = (b - a) / length;
  const auto power = [&](int n) { return std::pow(length, n) / n; };
  return a * a * power(k + 1) + 2.0 * a * slope * power(k + 2) + slope * slope * power(k + 3);
}

TEST(Rod, TaperedArmHasItsMassAndItsMomentsWithAnyMesh) {
  // Tapered as the paper's, uniform, and needles, which few elements can hardly follow.
  for (double tip : {0.006, 0.015, 0.0003}) {
    for (int n : {1, 2, 4, 7, 20}) {
      Arm arm = PaperArm(n);
      arm.radius_tip_m = tip;
      Effects effects;
      effects.added_mass = true;
      const Rod rod = Make(arm, effects);
      const double a = 0.015, density = 1022.0 * kPi;
      const double mass = density * FrustumMoment(0.42, a, tip, 0);
      for (int k : {0, 1, 2, 3}) {
        const auto moment = [k](const RodNode& p) {
          return std::pow(p.section.x_m, k) * p.inertia(5);
        };
        EXPECT_NEAR(Sum(rod, moment), density * FrustumMoment(0.42, a, tip, k), kRoundOff * mass)
            << tip << ", " << n << " elements, moment " << k;
      }
      // Loads and added mass at the same places: in proportion to length, and to displaced mass.
      EXPECT_NEAR(Sum(rod, [](const RodNode& p) { return p.weight_m; }), 0.42, kRoundOff);
      EXPECT_NEAR(Sum(rod, [](const RodNode& p) { return p.weight_m * p.section.x_m; }),
                  0.5 * 0.42 * 0.42, kRoundOff);
      for (const auto* places : {&rod.nodes, &rod.middles}) {
        for (const RodNode& p : *places) {
          EXPECT_GT(p.inertia.minCoeff(), 0.0);
          EXPECT_GT(p.weight_m, 0.0);
          EXPECT_NEAR(p.weight_m * p.section.area_m2 * 1022.0, p.inertia(5), kRoundOff * mass);
          EXPECT_NEAR(p.added_mass_kg, 1.5 * p.inertia(5), kRoundOff * mass);
        }
      }
    }
  }
}

TEST(Rod, SectionsKeepTheirRotaryInertia) {
  const double a = 0.015, b = 0.006;
  // integral of rho pi r^4/2 over the frustum
  const double r5 = (std::pow(a, 5) - std::pow(b, 5)) / (5.0 * (a - b));
  EXPECT_NEAR(Sum(Make(PaperArm(7)), [](const RodNode& p) { return p.inertia(0); }),
              1022.0 * 0.5 * kPi * 0.42 * r5, kRoundOff);
}

TEST(Rod, UniformMassIsSimpsons) {
  Arm arm = PaperArm(3);
  arm.radius_tip_m = arm.radius_base_m;
  const Rod rod = Make(arm);
  const double mass = Sum(rod, [](const RodNode& p) { return p.inertia(5); });
  EXPECT_NEAR(rod.nodes[0].inertia(5), mass / 18, kRoundOff);
  EXPECT_NEAR(rod.nodes[1].inertia(5), mass / 9, kRoundOff);
  EXPECT_NEAR(rod.middles[1].inertia(5), mass * 2 / 9, kRoundOff);
  EXPECT_NEAR(rod.middles[1].ahead_m, 0.0, kRoundOff);
}

TEST(Rod, ArmOfThePaperWeighs158Grams) {  // [physics.md] 1
  EXPECT_NEAR(Sum(Make(PaperArm()), [](const RodNode& p) { return p.inertia(5); }), 0.158, 0.0005);
}

TEST(Rod, ElementsHaveTheShearThatTheirBendingLeavesOut) {
  Arm arm = PaperArm(6);
  arm.radius_tip_m = arm.radius_base_m;
  Effects effects;
  effects.viscosity = true;
  const RodElement e = Make(arm, effects).elements[2];
  const Vector6 section = ArmStiffness(arm, 0.1), viscosity = ArmViscosity(arm, effects, 0.1);
  for (int k : {4, 5}) {
    const double flexibility = 1.0 / section(k) + e.length * e.length / (12.0 * section(6 - k));
    EXPECT_NEAR(e.stiffness(k) * flexibility, 1.0, kRoundOff);
    EXPECT_NEAR(e.shear_share(k - 4) * section(k), e.stiffness(k), kRoundOff * section(k));
    // Under a force that rises slowly the two flexibilities in series creep as this viscosity says.
    const double rate =
        viscosity(k) / std::pow(section(k), 2) +
        viscosity(6 - k) * e.length * e.length / (12.0 * std::pow(section(6 - k), 2));
    EXPECT_NEAR(e.viscosity(k), std::pow(e.stiffness(k), 2) * rate, kRoundOff * viscosity(3));
  }
  EXPECT_LT((e.stiffness - section).head<4>().norm(), kRoundOff * section.norm());
}

TEST(Rod, SectionsAreIntegratedExactlyOverEachElement) {
  const Rod rod = Make(PaperArm(4));
  for (int i = 0; i < 4; ++i) {
    const double a = 0.015 - 0.009 * i / 4, b = 0.015 - 0.009 * (i + 1) / 4;
    const double r2 = (a * a + a * b + b * b) / 3.0;
    const double r4 = (std::pow(a, 5) - std::pow(b, 5)) / (5.0 * (a - b));
    EXPECT_NEAR(rod.elements[i].stiffness(3), 110e3 * kPi * r2, 1e-11);
    EXPECT_NEAR(rod.elements[i].stiffness(1), 110e3 * kPi * r4 / 4.0, 1e-14);
  }
}

TEST(Rod, CurvedReferenceFollowsItsCurvature) {
  // Constant curvature: a circle. Linear curvature in a plane: theta = k0 x + (k1 - k0) x^2 / 2L.
  Arm arm = PaperArm(10);
  arm.curvature_base = arm.curvature_tip = {0, 0, 2.0};
  const Rod circle = Make(arm);
  const double angle = 0.42 * 2.0;
  EXPECT_LT((circle.reference.back().position -
             Vector3(std::sin(angle) / 2.0, (1 - std::cos(angle)) / 2.0, 0))
                .norm(),
            kRoundOff);
  for (const RodElement& e : circle.elements) {
    EXPECT_LT((e.reference_strain - (Vector6() << 0, 0, 2, 1, 0, 0).finished()).norm(), 1e-11);
  }
  arm.curvature_base = {0, 0, 1.0};
  arm.curvature_tip = {0, 0, 9.0};
  const Rod spiral = Make(arm);
  Vector3 reference = Vector3::Zero();  // midpoint sum: error 1e-10
  const int steps = 100000;
  for (int i = 0; i < steps; ++i) {
    const double x = 0.42 * (i + 0.5) / steps;
    const double theta = x + 8.0 * x * x / (2 * 0.42);
    reference += 0.42 / steps * Vector3(std::cos(theta), std::sin(theta), 0);
  }
  EXPECT_LT((spiral.reference.back().position - reference).norm(), 1e-9);
}

TEST(Rod, ReferenceTwistAndCurvatureMakeAHelix) {
  Arm arm = PaperArm(30);
  arm.curvature_base = arm.curvature_tip = {4.0, 3.0, 0};
  const Rod rod = Make(arm);
  Vector6 xi;
  xi << 4, 3, 0, 1, 0, 0;
  const Pose tip = ExpSE3(0.42 * xi);
  EXPECT_LT((rod.reference.back().position - tip.position).norm(), kRoundOff);
  EXPECT_LT(rod.reference.back().rotation.angularDistance(tip.rotation), 1e-7);
}

TEST(Rod, UniformHelixOfAnyMeshIsTheSameRod) {
  Arm arm = PaperArm(5);
  arm.curvature_base = arm.curvature_tip = {4.0, 3.0, 1.0};
  const Pose coarse = Make(arm).reference.back();
  arm.elements = 77;
  EXPECT_LT((Make(arm).reference.back().position - coarse.position).norm(), kRoundOff);
}

TEST(Rod, AddedMassIsLateralAndOnlyWhereNamed) {
  Effects effects;
  EXPECT_EQ(Make(PaperArm(), effects).nodes[3].added_mass_kg, 0.0);
  effects.added_mass = true;
  double added = 0, mass = 0;
  const Rod rod = Make(PaperArm(), effects);
  for (const auto* places : {&rod.nodes, &rod.middles}) {
    for (const RodNode& n : *places) {
      added += n.added_mass_kg;
      mass += n.inertia(5);
      const Vector6 full = n.FullInertia();
      EXPECT_EQ(full(3), n.inertia(3));
      EXPECT_EQ(full(4), n.inertia(4) + n.added_mass_kg);
      EXPECT_EQ(full(5), n.inertia(5) + n.added_mass_kg);
    }
  }
  EXPECT_NEAR(added, 1.5 * mass, kRoundOff);  // B_b = 1.5, same density
}

TEST(Rod, PointsMoveTheNearestNodeOntoThem) {
  Arm arm = PaperArm(10);
  arm.points = {{"a", 0.1, Vector6::Zero(), LoadFrame::kWorld, ConstantSchedule{1}},
                {"tip", 0.42, Vector6::Zero(), LoadFrame::kWorld, ConstantSchedule{1}}};
  const Rod rod = Make(arm);
  EXPECT_EQ(rod.points[0].node, 2);
  EXPECT_EQ(rod.x_m[2], 0.1);
  EXPECT_EQ(rod.points[1].node, 10);
  double length = 0;
  for (const RodElement& e : rod.elements) length += e.length;
  EXPECT_NEAR(length, 0.42, kRoundOff);
}

TEST(Rod, ImpossibleArmsAreRefusedWithValueAndBound) {
  const auto message = [](const Arm& arm) -> std::string {
    try {
      Make(arm);
    } catch (const BadRobot& error) {
      return error.what();
    }
    return "accepted";
  };
  Arm arm = PaperArm();
  arm.length_m = -1;
  EXPECT_EQ(message(arm), "length = -1 m, must be > 0");
  arm = PaperArm();
  arm.elements = 0;
  EXPECT_EQ(message(arm), "elements = 0, must be >= 1");
  arm = PaperArm();
  arm.radius_tip_m = std::nan("");
  EXPECT_NE(message(arm).find("radius = 0.015, nan m, must be > 0"), std::string::npos);
  arm = PaperArm(3);
  arm.curvature_base = {0, 0, 20};
  EXPECT_NE(message(arm).find("mesh is too coarse"), std::string::npos);
  arm = PaperArm();
  arm.cables = {{"c", 1.2, 0, 0, 0.42, {}, {}}};
  EXPECT_NE(message(arm).find("fraction = 1.2, must be in [0, 1]"), std::string::npos);
  arm.cables = {{"c", 0.6, 0, 0, 0.5, {}, {}}};
  EXPECT_NE(message(arm).find("end = 0.5 m, must be in (0, 0.42]"), std::string::npos);
  arm = PaperArm(2);
  arm.points = {{"a", 0.41, Vector6::Zero(), LoadFrame::kWorld, ConstantSchedule{1}}};
  EXPECT_NE(message(arm).find("points: at = 0.41 m"), std::string::npos);
}

// --- cables

Vector6 SmoothStrain(double x) {
  Vector6 xi;
  xi << 3 * std::sin(5 * x), 4 * std::cos(7 * x), 6 * x, 1 + 0.1 * x, 0.05 * x, -0.1 * x;
  return xi;
}

// Arc length of the cable's path on a rod of strain SmoothStrain, by quadrature of the path's
// points: chords between positions computed from finely integrated poses (no cable formula enters).
double PathLengthByChords(const Arm& arm, const ArmCable& cable) {
  constexpr int kSteps = 40000;
  Pose g;
  Vector3 previous = Vector3::Zero();
  double length = 0;
  for (int i = 0; i <= kSteps; ++i) {
    const double x = cable.end_m * i / kSteps;
    const double angle = cable.angle_rad + 2 * kPi * cable.turns * x / arm.length_m;
    const double radius =
        arm.radius_base_m + (arm.radius_tip_m - arm.radius_base_m) * x / arm.length_m;
    const Vector3 offset = cable.fraction * radius * Vector3(0, std::cos(angle), std::sin(angle));
    const Vector3 point = g.position + g.rotation * offset;
    if (i > 0) length += (point - previous).norm();
    previous = point;
    const double h = cable.end_m / kSteps;
    g = g * ExpSE3(h * SmoothStrain(x + 0.5 * h));
  }
  return length;
}

// The same for a path given by points.
double RoutedLengthByChords(const ArmCable& cable) {
  constexpr int kSteps = 40000;
  const auto offset = [&](double x) -> Vector3 {
    for (std::size_t i = 0; i + 1 < cable.path.size(); ++i) {
      const Vector3 &a = cable.path[i], &b = cable.path[i + 1];
      if (x > b.x()) continue;
      const Vector3 p = a + (x - a.x()) / (b.x() - a.x()) * (b - a);
      return {0, p.y(), p.z()};
    }
    return {0, cable.path.back().y(), cable.path.back().z()};
  };
  Pose g;
  Vector3 previous = offset(0);
  double length = 0;
  for (int i = 1; i <= kSteps; ++i) {
    const double h = cable.end_m / kSteps;
    g = g * ExpSE3(h * SmoothStrain((i - 0.5) * h));
    const Vector3 point = g.position + g.rotation * offset(i * h);
    length += (point - previous).norm();
    previous = point;
  }
  return length;
}

double DiscreteLength(const Rod& rod) {
  double length = 0;
  for (std::size_t i = 0; i < rod.cables[0].pieces.size(); ++i) {
    const double middle = 0.5 * (rod.x_m[i] + rod.x_m[i + 1]);
    const RodElement& e = rod.elements[i];
    length += CablePieceLength(rod.cables[0].pieces[i], e, e.length * SmoothStrain(middle), nullptr,
                               nullptr);
  }
  return length;
}

TEST(RodCable, RoutedPathHasTheLengthOfItsPoints) {
  constexpr double kTolerance = 2e-5;  // h^2 of 64 elements, kinks of the path on nodes
  Arm arm = PaperArm(64);
  arm.cables = {{"c", 0.6, 0, 0, 0.42, {}, {}}};
  arm.cables[0].path = {{0, 6e-3, 0}, {0.21, 0, 4e-3}, {0.42, -4e-3, 0}};
  const double exact = RoutedLengthByChords(arm.cables[0]);
  EXPECT_NEAR(DiscreteLength(MakeRod(arm, {}, {})), exact, kTolerance * exact);
  arm.cables[0].path[1].z() = 0.0106;  // the section's radius there is 10.5 mm
  EXPECT_THROW(MakeRod(arm, {}, {}), BadRobot);
}

TEST(RodCable, LengthConvergesToThePathOnADeformedRod) {
  Arm arm = PaperArm(20);
  arm.cables = {{"c", 0.6, 0.7, 1.5, 0.42, {}, {}}};
  const double exact = PathLengthByChords(arm, arm.cables[0]);
  double previous = 0;
  for (int n : {20, 40, 80}) {
    arm.elements = n;
    const double error = std::abs(DiscreteLength(Make(arm)) - exact);
    EXPECT_LT(error, 1e-3 * 0.42 * std::pow(20.0 / n, 2)) << n;
    if (n > 20) {
      EXPECT_NEAR(previous / error, 4.0, 0.3) << n;  // second order
    }
    previous = error;
  }
}

TEST(RodCable, MayEndInsideAnElement) {
  Arm arm = PaperArm(10);
  arm.cables = {{"c", 0.6, 0.0, 0.0, 0.2, {}, {}}};
  const Rod rod = Make(arm);
  EXPECT_EQ(rod.cables[0].pieces.size(), 5u);
  EXPECT_NEAR(rod.cables[0].pieces.back().share, (0.2 - 0.168) / 0.042, 1e-12);
  // straight at rest, inclined by the taper alone
  EXPECT_NEAR(rod.cables[0].rest_length_m, 0.2 * std::hypot(1.0, 0.6 * 0.009 / 0.42), 1e-12);
}

TEST(RodCable, PathThroughPointsIsTheSameCable) {
  // fraction 0.4 on the taper is the straight line from y = 6 mm to 2.4 mm
  Arm arm = PaperArm(10);
  arm.cables = {{"layout", 0.4, 0.0, 0.0, 0.3, {}, {}}, {"points", 0.6, 1.0, 2.0, 0.3, {}, {}}};
  arm.cables[1].path = {{0, 0.006, 0}, {0.42, 0.0024, 0}};
  const Rod rod = Make(arm);
  ASSERT_EQ(rod.cables[0].pieces.size(), rod.cables[1].pieces.size());
  for (std::size_t i = 0; i < rod.cables[0].pieces.size(); ++i) {
    const CablePiece &a = rod.cables[0].pieces[i], &b = rod.cables[1].pieces[i];
    EXPECT_LT((a.offset_m - b.offset_m).norm(), 1e-15) << i;
    EXPECT_LT((a.slope - b.slope).norm(), 1e-14) << i;
    EXPECT_EQ(a.share, b.share) << i;
  }
}

TEST(RodCable, GradientAndHessianMatchDifferences) {
  RandomValues random(1);
  constexpr double kDifferences = 1e-9;
  Arm arm = PaperArm(20);
  arm.cables = {{"c", 0.6, 0.7, 1.5, 0.405, {}, {}}};
  const Rod rod = Make(arm);
  for (std::size_t i : {std::size_t{0}, std::size_t{9}, rod.cables[0].pieces.size() - 1}) {
    const CablePiece& piece = rod.cables[0].pieces[i];
    const RodElement& e = rod.elements[i];
    const Vector6 d = e.length * (e.reference_strain + random.Twist(5.0, 0.2));
    Vector6 gradient;
    Matrix6 hessian;
    CablePieceLength(piece, e, d, &gradient, &hessian);
    const auto length = [&](const Eigen::VectorXd& x) {
      return CablePieceLength(piece, e, x, nullptr, nullptr);
    };
    const auto slope = [&](const Eigen::VectorXd& x) -> Eigen::VectorXd {
      Vector6 g;
      CablePieceLength(piece, e, x, &g, nullptr);
      return g;
    };
    Eigen::VectorXd step(6);
    step << 1e-3, 1e-3, 1e-3, 2e-5, 2e-5, 2e-5;
    EXPECT_TRUE(tests::JacobianMatches(gradient.transpose(),
                                       tests::DifferenceJacobian(length, d, step), kDifferences));
    EXPECT_TRUE(
        tests::JacobianMatches(hessian, tests::DifferenceJacobian(slope, d, step), kDifferences));
    // [physics.md] 2: resultant u [d x t; t], t the unit tangent
    EXPECT_NEAR(gradient.tail<3>().norm(), piece.share, kRoundOff);
    EXPECT_LT((gradient.head<3>() - piece.offset_m.cross(gradient.tail<3>())).norm(), kRoundOff);
  }
}

}  // namespace
}  // namespace mantle::model
