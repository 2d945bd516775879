#include "model/shell.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "model/meridian.h"
#include "model/rigid_body.h"
#include "model/rod.h"
#include "tests/support/gradient_checker.h"
#include "tests/support/paper_robot.h"
#include "tests/support/random_values.h"

namespace mantle::model {
namespace {

using tests::kApexAngle;
using tests::kMantleRadius;
using tests::PaperMantle;
using tests::RandomValues;

constexpr double kPi = std::numbers::pi;
constexpr double kDifferences = 1e-9;  // fourth-order differences, step 1e-3 of the scale

Shell Make(const Mantle& m, const Effects& effects = {}) { return MakeShell(m, Water{}, effects); }

std::vector<Vector3> Deformed(const Shell& shell, RandomValues* random) {
  std::vector<Vector3> q = shell.reference;
  for (Vector3& x : q) x += Vector3(2e-3, 4e-3, 0.2).cwiseProduct(random->Cube());
  return q;
}

Eigen::VectorXd Flat(const std::vector<Vector3>& q) {
  return Eigen::Map<const Eigen::VectorXd>(q.front().data(), 3 * static_cast<long>(q.size()));
}
std::vector<Vector3> Nodes(const Eigen::VectorXd& flat) {
  std::vector<Vector3> q(flat.size() / 3);
  for (std::size_t i = 0; i < q.size(); ++i) q[i] = flat.segment<3>(3 * static_cast<long>(i));
  return q;
}

TEST(Shell, PaperMantleHasItsAreaMassAndWater) {
  const Shell shell = Make(PaperMantle(128));
  EXPECT_NEAR(shell.area_m2, 0.022720, 5e-7);  // erratum 16
  const double exact =
      2 * kPi * kMantleRadius *
      (kMantleRadius * (std::cos(kApexAngle) - std::cos(kApexAngle + 0.044 / kMantleRadius)) +
       0.086);
  EXPECT_NEAR(shell.area_m2, exact, 1e-9);  // three Gauss points per element on the dome
  EXPECT_NEAR(shell.mass_kg, 0.046, 0.0005);
  double area = 0, mass = 0;
  for (const ShellNode& n : shell.nodes) {
    area += n.area_m2;
    mass += n.mass_kg;
  }
  EXPECT_NEAR(area, shell.area_m2, 1e-15);
  EXPECT_NEAR(mass, 1022.0 * 0.002 * exact, 1e-8);
  // Water in the cavity without the cone: hemisphere less the cap of the hole, and cylinder.
  const double c = std::cos(kApexAngle);
  const double cap = kPi * std::pow(kMantleRadius, 3) * (2.0 / 3.0 - c + c * c * c / 3.0);
  const double cavity = kPi * kMantleRadius * kMantleRadius * 0.086 +
                        2.0 / 3.0 * kPi * std::pow(kMantleRadius, 3) - cap;
  const double water = (shell.rest_volume_m3 - RigidVolume(tests::PaperCone())) * 1e6;
  EXPECT_NEAR(shell.rest_volume_m3, cavity, 1e-4 * cavity);  // chords of the dome
  EXPECT_NEAR(water, 296.0, 1.0) << "mL";                    // [physics.md] 1
  EXPECT_NEAR(RigidMass(tests::PaperCone()), 0.027, 0.0005);
}

TEST(Shell, VolumeConvergesToTheSphere) {
  Mantle m;
  m.name = "sphere";
  m.pieces = {{kPi * 0.5 * kMantleRadius, -1.0 / kMantleRadius}};
  m.half_thickness_m = 1e-3;
  m.material = {40e3, 0, 0, 1022};
  const double exact = 2.0 / 3.0 * kPi * std::pow(kMantleRadius, 3);
  double previous = 0;
  for (int n : {16, 32, 64}) {
    m.elements = n;
    const double error = std::abs(Make(m).rest_volume_m3 - exact) / exact;
    if (n > 16) {
      EXPECT_NEAR(previous / error, 4.0, 0.1);
    }
    previous = error;
  }
  EXPECT_LT(previous, 2e-4);
}

TEST(Shell, VolumeIsThatOfItsCones) {
  // Frusta of a zigzag profile, by Simpson (exact for quadratics).
  RandomValues random(1);
  const std::vector<Vector3> q = Deformed(Make(PaperMantle(16)), &random);
  double volume = 0;
  for (std::size_t i = 0; i + 1 < q.size(); ++i) {
    const double a = q[i](0), b = q[i + 1](0), mid = 0.5 * (a + b);
    volume -= kPi / 6.0 * (a * a + 4 * mid * mid + b * b) * (q[i + 1](1) - q[i](1));
  }
  EXPECT_NEAR(ShellVolume(q), volume, 1e-12 * volume);
}

TEST(Shell, VolumeGradientsMatchDifferences) {
  RandomValues random(2);
  const std::vector<Vector3> q = Deformed(Make(PaperMantle(16)), &random);
  const Eigen::VectorXd x = Flat(q), step = Eigen::VectorXd::Constant(x.size(), 1e-5);
  std::vector<Vector3> gradient(q.size());
  ShellVolumeGradient(q, &gradient);
  const auto volume = [&](const Eigen::VectorXd& y) { return ShellVolume(Nodes(y)); };
  // a row of very unlike entries (apex and lip): absolute floor at 1e-12 of the cylinder's 2 pi r
  // z'
  EXPECT_TRUE(tests::JacobianMatches(
      Flat(gradient).transpose(), tests::DifferenceJacobian(volume, x, step), kDifferences, 1e-12));
}

TEST(Shell, WallVolumeGradientIsTheForceOfAUnitPressure) {
  // integral of 2 pi r N_i (-z', r') dX against each shape function, by Simpson (quadratic: exact).
  RandomValues random(3);
  const std::vector<Vector3> q = Deformed(Make(PaperMantle(16)), &random);
  std::vector<Vector3> expected(q.size(), Vector3::Zero()), gradient(q.size());
  for (std::size_t i = 0; i + 1 < q.size(); ++i) {
    const double a = q[i](0), b = q[i + 1](0), mid = 0.5 * (a + b);
    const Vector3 normal(q[i](1) - q[i + 1](1), b - a, 0);
    expected[i] += 2 * kPi / 6.0 * (a + 4 * 0.5 * mid) * normal;
    expected[i + 1] += 2 * kPi / 6.0 * (b + 4 * 0.5 * mid) * normal;
  }
  ShellWallVolumeGradient(q, &gradient);
  for (std::size_t i = 0; i < q.size(); ++i) {
    EXPECT_LT((gradient[i] - expected[i]).norm(), 1e-15) << i;  // of 6e-3 m^2 at the end planes
  }
}

TEST(Shell, ReferenceShapeIsInEquilibrium) {
  for (double grading : {1.0, 6.0}) {
    const Shell shell = Make(PaperMantle(64, grading));
    std::vector<Vector3> f(shell.nodes.size(), Vector3::Zero());
    for (int i = 0; i < shell.element_count(); ++i) {
      ShellElementState s;
      EvaluateShellElement(shell.elements[i], shell.material, shell.reference[i],
                           shell.reference[i + 1], Vector3::Zero(), Vector3::Zero(), &s);
      AddShellElementForces(shell.elements[i], s, &f[i], &f[i + 1]);
    }
    constexpr double kRoundOff_n = 1e-11;  // 2 h E 2 pi R = 16 N times 1e-16 times a few digits
    for (const Vector3& x : f) EXPECT_LT(x.norm(), kRoundOff_n);
  }
}

TEST(Shell, MassesCarryAddedMassOnlyWhereNamed) {
  Effects effects;
  const Shell dry = Make(PaperMantle(), effects);
  effects.added_mass = true;
  const Shell wet = Make(PaperMantle(), effects);
  for (int j = 0; j < dry.node_count(); ++j) {
    EXPECT_EQ(dry.nodes[j].inertia(0), dry.nodes[j].mass_kg);
    EXPECT_NEAR(wet.nodes[j].inertia(1), 2.1 * dry.nodes[j].mass_kg, 1e-17);
    // J = h^2/3 (erratum 8 and [physics.md] 3), water does not turn with the fibre
    EXPECT_NEAR(wet.nodes[j].inertia(2), 1e-6 / 3.0 * dry.nodes[j].mass_kg, 1e-22);
  }
}

TEST(Shell, StripHasTheAreaOfThePaper) {  // erratum 12: 0.015355 m^2, 5 N are 325 Pa
  Mantle m = PaperMantle(128);
  m.strips = {{"pulse", 0.025, 0.105, ConstantSchedule{325}}};
  const Shell shell = Make(m);
  EXPECT_NEAR(shell.strips[0].strip.total_m2, 0.015355, 1e-6);
  EXPECT_NEAR(325.0 * shell.strips[0].strip.total_m2, 5.0, 0.02);
  for (int j = 0; j < shell.node_count(); ++j) {
    const bool inside = shell.nodes[j].x_m > 0.025 - 1e-9 && shell.nodes[j].x_m < 0.105 + 1e-9;
    EXPECT_EQ(shell.strips[0].strip.area_m2[j] > 0.0, inside);
  }
}

TEST(Shell, SpokesMakeThePressureOfPhysics) {  // n = 8: 521 Pa/N
  Mantle m = PaperMantle(64);
  m.spokes = {{"winch", 0.025, 0.105, 8, GivenTension{ConstantSchedule{1}}}};
  const Shell shell = Make(m);
  EXPECT_NEAR(8.0 / shell.spokes[0].strip.total_m2, 521.0, 0.5);
  // mean of r over the strip's area: integral of r dA / A, on sphere and cylinder
  const double a = kApexAngle + 0.025 / kMantleRadius, b = kPi / 2, r = kMantleRadius;
  const double sphere =
      2 * kPi * r * r * r * (0.5 * (b - a) - 0.25 * (std::sin(2 * b) - std::sin(2 * a)));
  const double cylinder = 2 * kPi * r * r * 0.061;
  const double area = 2 * kPi * r * r * (std::cos(a) - std::cos(b)) + 2 * kPi * r * 0.061;
  EXPECT_NEAR(shell.spokes[0].rest_length_m, 8 * (sphere + cylinder) / area, 1e-4 * 0.25);
}

TEST(Shell, ThrustSharesAddUpToOne) {
  for (ThrustPlace place : {ThrustPlace::kUniform, ThrustPlace::kDome}) {
    Effects effects;
    effects.jet_thrust = JetThrust{FluxReading::kVolume, place};
    const Shell shell = Make(PaperMantle(), effects);
    double sum = shell.thrust_share_root;
    for (double s : shell.thrust_share) {
      EXPECT_GE(s, 0.0);
      sum += s;
    }
    EXPECT_NEAR(sum, 1.0, 1e-14);
    if (place == ThrustPlace::kDome) {
      EXPECT_NEAR(shell.thrust_share_root, std::pow(std::sin(kApexAngle), 2), 1e-12);
      EXPECT_NEAR(shell.thrust_share.back(), 0.0, 1e-12);  // nothing on the cylinder
    } else {
      EXPECT_EQ(shell.thrust_share_root, 0.0);
      EXPECT_NEAR(shell.thrust_share[30], shell.nodes[30].area_m2 / shell.area_m2, 1e-15);
    }
  }
}

TEST(Shell, EndsHoldTheirCoordinates) {
  Mantle m;
  m.name = "plate";
  m.pieces = {{0.05, 0.0}};
  m.half_thickness_m = 1e-3;
  m.material = {40e3, 0, 0, 1022};
  m.elements = 10;
  m.start = ShellEnd::kSymmetric;  // on the axis: r and theta
  m.end = ShellEnd::kSupported;
  Shell shell = Make(m);
  EXPECT_EQ(shell.nodes.front().held, Vector3(1, 0, 1));
  EXPECT_EQ(shell.nodes.back().held, Vector3(1, 1, 0));
  m.r0_m = 0.02;
  m.end = ShellEnd::kFree;
  shell = Make(m);
  EXPECT_EQ(shell.nodes.front().held, Vector3(0, 1, 1));  // a mirror plane off the axis
  EXPECT_EQ(shell.nodes.back().held, Vector3(0, 0, 0));
  m.start = ShellEnd::kClamped;
  EXPECT_EQ(Make(m).nodes.front().held, Vector3(1, 1, 1));
}

TEST(Shell, ImpossibleMantlesAreRefusedWithValueAndBound) {
  const auto message = [](const Mantle& m) -> std::string {
    try {
      Make(m);
    } catch (const BadRobot& error) {
      return error.what();
    }
    return "accepted";
  };
  Mantle m = PaperMantle();
  m.half_thickness_m = 0;
  EXPECT_EQ(message(m), "half_thickness = 0 m, must be > 0");
  m = PaperMantle();
  m.half_thickness_m = std::nan("");
  EXPECT_NE(message(m).find("half_thickness = nan m"), std::string::npos);
  m = PaperMantle(5);
  EXPECT_NE(message(m).find("too coarse for its own geometry"), std::string::npos);
  m = PaperMantle();
  m.strips = {{"pulse", 0.1, 0.2, ConstantSchedule{1}}};
  EXPECT_NE(message(m).find("strips.pulse: strip [0.1, 0.2] m"), std::string::npos);
  m = PaperMantle();
  m.pieces.clear();
  EXPECT_NE(message(m).find("profile: is empty"), std::string::npos);
  m = PaperMantle();
  m.r0_m = -0.01;
  EXPECT_NE(message(m).find("must be >= 0"), std::string::npos);
}

}  // namespace
}  // namespace mantle::model
