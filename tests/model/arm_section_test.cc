#include "model/arm_section.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "model/modes.h"
#include "model/statics.h"
#include "tests/support/paper_robot.h"
#include "tests/support/rich_robot.h"
#include "tests/support/runs.h"

namespace mantle::model {
namespace {

using std::numbers::pi;
constexpr double kRoundOff = 1e-12;  // relative, sums of some tens of terms
constexpr double kYoung = 2e6, kPoisson = 0.3, kDensity = 1200;
const Material kMaterial{kYoung, kPoisson, 0.0, kDensity};

ArmPiece Piece(double length, std::variant<RoundOutline, RectangularOutline> outline) {
  ArmPiece piece;
  piece.length_m = length;
  piece.outline = outline;
  piece.material = kMaterial;
  return piece;
}
std::variant<RoundOutline, RectangularOutline> Tube(double outer, double inner) {
  return RoundOutline{{outer, outer}, {inner, inner}};
}
std::variant<RoundOutline, RectangularOutline> Box(double width, double height) {
  return RectangularOutline{{width, width}, {height, height}};
}

// Clamped at the base, x along the world's x.
Robot Clamped(std::vector<ArmPiece> pieces, int elements) {
  Robot robot;
  robot.name = "rod";
  robot.root = ClampedRoot{};
  Arm arm;
  arm.name = "rod";
  for (const ArmPiece& p : pieces) arm.length_m += p.length_m;
  arm.pieces = std::move(pieces);
  arm.elements = elements;
  robot.arms = {arm};
  return robot;
}

Vector3 TipUnder(Robot robot, const Vector3& moment, const Vector3& force) {
  robot.arms[0].points = {tests::TipLoad(robot.arms[0], moment, force, LoadFrame::kWorld)};
  const StaticsResult r = tests::Equilibrium(robot, 1);
  return r.state.pose.back().position - Vector3(robot.arms[0].length_m, 0, 0);
}

TEST(ArmSection, TorsionOfRectanglesIsTimoshenkos) {
  // Timoshenko & Goodier, art. 109: J = k a c^3.
  constexpr double kTabulated = 6e-4;  // three digits
  const double table[][2] = {
      {1.0, 0.1406}, {1.5, 0.196}, {2.0, 0.229}, {4.0, 0.281}, {10.0, 0.312}};
  for (const auto& [ratio, k] : table) {
    EXPECT_NEAR(RectangleTorsion(ratio * 0.3, 0.3) / (ratio * std::pow(0.3, 4)), k, kTabulated);
    EXPECT_EQ(RectangleTorsion(ratio * 0.3, 0.3), RectangleTorsion(0.3, ratio * 0.3));
  }
  EXPECT_NEAR(RectangleTorsion(1.0, 1e-4) / 1e-12, 1.0 / 3.0, 1e-4);
}

TEST(ArmSection, HollowAndRectangularSectionsAreTheirDimensions) {
  const Matrix6 tube = PieceStiffness(Piece(1, Tube(0.02, 0.015)), 0.5);
  const double shear = kYoung / (2 * (1 + kPoisson));
  const double area = pi * (4e-4 - 2.25e-4);
  const double second = pi / 4 * (std::pow(0.02, 4) - std::pow(0.015, 4));
  Vector6 expected;
  expected << 2 * shear * second, kYoung * second, kYoung * second, kYoung * area, shear * area,
      shear * area;
  EXPECT_LT((tube.diagonal() - expected).cwiseQuotient(expected).norm(), kRoundOff);
  const Matrix6 box = PieceStiffness(Piece(1, Box(0.03, 0.01)), 0.5);
  EXPECT_NEAR(box(1, 1), kYoung * 0.03 * 1e-6 / 12, kRoundOff);    // about y: z^2
  EXPECT_NEAR(box(2, 2), kYoung * 0.01 * 2.7e-5 / 12, kRoundOff);  // about z: y^2
  const Vector6 inertia = PieceInertia(Piece(1, Box(0.03, 0.01)), 0.5);
  EXPECT_NEAR(inertia(0), inertia(1) + inertia(2), kRoundOff);
  EXPECT_NEAR(inertia(3), kDensity * 3e-4, kRoundOff);
}

TEST(ArmSection, SteppedCantileverBendsAsBeamTheorySays) {
  // Tip force F: delta = F/(E I_2) a^3/3 + F/(E I_1) ((L^3 - a^3)/3), a the outer piece.
  const double force = 1e-7;  // deflection 1e-5 of the length
  const double i1 = pi / 4 * std::pow(0.01, 4),
               i2 = pi / 4 * (std::pow(0.008, 4) - std::pow(0.006, 4));
  const double a = 0.3, length = 0.5;
  const double bending =
      force / kYoung * (std::pow(a, 3) / 3 / i2 + (std::pow(length, 3) - std::pow(a, 3)) / 3 / i1);
  const double shear = kYoung / (2 * (1 + kPoisson));
  const double shearing = force / shear * (a / (pi * (6.4e-5 - 3.6e-5)) + 0.2 / (pi * 1e-4));
  constexpr double kMesh = 1.1e-3;  // 20 elements, second order
  for (int k : {1, 2}) {
    const Vector3 tip =
        TipUnder(Clamped({Piece(0.2, Tube(0.01, 0)), Piece(a, Tube(0.008, 0.006))}, 20 * k),
                 {0, 0, 0}, {0, force, 0});
    EXPECT_NEAR(tip.y() / (bending + shearing), 1.0, kMesh / (k * k)) << k;
  }
}

TEST(ArmSection, StripBendsAboutBothAxes) {
  const Robot robot = Clamped({Piece(0.4, Box(0.03, 0.006))}, 16);
  const double moment = 1e-6;
  const double angle_y = moment * 0.4 / (kYoung * 0.03 * std::pow(0.006, 3) / 12);
  const double angle_z = moment * 0.4 / (kYoung * 0.006 * std::pow(0.03, 3) / 12);
  // A tip couple bends it into a circle: constant strain, exact on any mesh.
  const Vector3 about_y = TipUnder(robot, {0, moment, 0}, {0, 0, 0});
  EXPECT_NEAR(about_y.z(), -0.4 / angle_y * (1 - std::cos(angle_y)), 1e-10);
  const Vector3 about_z = TipUnder(robot, {0, 0, moment}, {0, 0, 0});
  EXPECT_NEAR(about_z.y(), 0.4 / angle_z * (1 - std::cos(angle_z)), 1e-10);
  EXPECT_GT(std::abs(about_y.z()), 20 * std::abs(about_z.y()));
}

TEST(ArmSection, FrequenciesOfTubeAndStripAreEulersAndBernoullis) {
  // f = 1.875104^2 / (2 pi L^2) sqrt(E I / rho A), slender: shear and rotary inertia below 1e-3.
  constexpr double kSlender = 2e-3;
  const double length = 1.0, wave = std::pow(1.8751040687, 2) / (2 * pi * length * length);
  const auto frequencies = [](const Robot& robot) {
    const Plant plant(robot);
    std::vector<double> f;
    for (const Mode& m : VibrationModes(plant, InitialState(plant), 2)) {
      f.push_back(m.angular_frequency_rad_s / (2 * pi));
    }
    return f;
  };
  const double tube =
      wave * std::sqrt(kYoung * (std::pow(0.01, 2) + std::pow(0.008, 2)) / 4 / kDensity);
  EXPECT_NEAR(frequencies(Clamped({Piece(length, Tube(0.01, 0.008))}, 60))[0] / tube, 1, kSlender);
  const auto strip = frequencies(Clamped({Piece(length, Box(0.02, 0.01))}, 60));
  EXPECT_NEAR(strip[0] / (wave * std::sqrt(kYoung * 1e-4 / 12 / kDensity)), 1, kSlender);
  EXPECT_NEAR(strip[1] / (wave * std::sqrt(kYoung * 4e-4 / 12 / kDensity)), 1, kSlender);
}

TEST(ArmSection, CoupledStrainsAnswerWithTheWholeMatrix) {
  // A dead tip wrench small enough to be linear: strain S^-1 w, constant for a couple and a pull.
  ArmPiece piece = Piece(0.5, Tube(0.01, 0));
  piece.stiffness = tests::CoupledStiffness();
  Robot robot = Clamped({piece}, 8);
  Vector6 wrench;
  wrench << 1e-11, -2e-11, 1.5e-11, 3e-7, 0, 0;
  robot.arms[0].points = {
      tests::TipLoad(robot.arms[0], wrench.head<3>(), wrench.tail<3>(), LoadFrame::kBody)};
  const StaticsResult r = tests::Equilibrium(robot, 1);
  Vector6 strain = piece.stiffness->ldlt().solve(wrench);
  strain(3) += 1.0;
  const Pose expected = ExpSE3(0.5 * strain);
  const Pose tip = r.state.pose.back();
  constexpr double kQuadratic = 1e-12;  // squares of strains of 1e-7 and their levers
  EXPECT_LT(LogSE3(Inverse(expected) * tip).norm(), kQuadratic);
  EXPECT_GT(std::abs(strain(0)), 1e-9);
}

TEST(ArmSection, RigidPieceCarriesWithoutStraining) {
  // Flexible - rigid - flexible, tip force F: the middle turns as one.
  const double force = 1e-7, a = 0.2, b = 0.15, c = 0.1, ei = kYoung * pi / 4 * 1e-8;
  ArmPiece middle = Piece(b, Tube(0.01, 0));
  middle.rigid = true;
  const Robot robot = Clamped({Piece(a, Tube(0.01, 0)), middle, Piece(c, Tube(0.01, 0))}, 90);
  const Vector3 tip = TipUnder(robot, {0, 0, 0}, {0, force, 0});
  const auto cube = [](double x) { return x * x * x; };
  const double length = a + b + c;
  const double shear = kYoung / (2 * (1 + kPoisson)) * pi * 1e-4;
  const double expected =
      force / ei * ((cube(length) - cube(b + c)) / 3 + cube(c) / 3) + force * (a + c) / shear;
  constexpr double kMesh = 2e-4;  // 90 elements
  EXPECT_NEAR(tip.y() / expected, 1.0, kMesh);
}

TEST(ArmSection, ProfileByTableEqualsTheTaperItSamples) {
  Robot taper, table;
  for (Robot* r : {&taper, &table}) {
    r->name = "rod";
    r->root = ClampedRoot{};
    r->arms = {tests::PaperArm(20)};
    r->arms[0].mount = Pose::Identity();
    r->effects.weight = r->effects.drag = r->effects.added_mass = r->effects.buoyancy = true;
    r->effects.gravity_m_s2 = {0, 0, -9.81};
    r->arms[0].material.density_kg_m3 = 1100;
  }
  const Arm& arm = taper.arms[0];
  for (int i = 0; i < 3; ++i) {  // three pieces of the same cone, none ending at a node
    const double from = 0.37 * i, to = i == 2 ? 1.0 : 0.37 * (i + 1);
    const auto radius = [&](double share) {
      return arm.radius_base_m + (arm.radius_tip_m - arm.radius_base_m) * share;
    };
    ArmPiece piece =
        Piece((to - from) * arm.length_m, RoundOutline{{radius(from), radius(to)}, {}});
    piece.material = arm.material;
    piece.node_at_end = false;
    table.arms[0].pieces.push_back(piece);
  }
  const Plant a(taper), b(table);
  for (int i = 0; i < 20; ++i) {
    EXPECT_LT((a.rods[0].elements[i].stiffness - b.rods[0].elements[i].stiffness)
                  .cwiseQuotient(a.rods[0].elements[i].stiffness)
                  .norm(),
              kRoundOff);
    EXPECT_LT((a.rods[0].nodes[i].FullInertia() - b.rods[0].nodes[i].FullInertia())
                  .cwiseQuotient(a.rods[0].nodes[i].FullInertia())
                  .norm(),
              kRoundOff);
  }
  const StaticsResult x = tests::Equilibrium(taper, 4), y = tests::Equilibrium(table, 4);
  EXPECT_LT((x.state.pose.back().position - y.state.pose.back().position).norm(), 1e-10);
}

TEST(ArmSection, PiecesWeighWhatTheyAre) {
  Robot robot = Clamped({Piece(0.2, Tube(0.01, 0.004)), Piece(0.3, Box(0.02, 0.01))}, 10);
  robot.effects.weight = robot.effects.buoyancy = true;
  robot.arms[0].pieces[1].material.density_kg_m3 = 900;
  for (bool flooded : {false, true}) {
    robot.arms[0].pieces[0].flooded = flooded;
    const Plant plant(robot);
    PlantWork work(plant);
    PlantInputs inputs;
    EvaluateInputs(plant, 0.0, false, &inputs);
    ASSERT_FALSE(EvaluateForces(plant, InitialState(plant), inputs, &work));
    double sum = 0;
    for (int i = 1; i <= 10; ++i) sum += work.force(plant.ArmVelocity(0, i) + 5);
    sum += work.force(5);
    const double wall = pi * (1e-4 - 1.6e-5), whole = pi * 1e-4;
    const double mass = 0.2 * kDensity * wall + 0.3 * 900 * 2e-4;
    const double displaced = 1022 * (0.2 * (flooded ? wall : whole) + 0.3 * 2e-4);
    EXPECT_NEAR(sum, -9.81 * (mass - displaced), kRoundOff);
  }
}

std::string WhyNot(const Robot& robot) {
  try {
    const Plant plant(robot);
  } catch (const BadRobot& error) {
    return error.what();
  }
  return "";
}

TEST(ArmSection, ImpossiblePiecesAreRefusedByName) {
  const auto fine = Piece(0.2, Tube(0.01, 0.004));
  EXPECT_EQ(WhyNot(Clamped({fine, fine}, 4)), "");
  Robot longer = Clamped({fine, fine}, 4);
  longer.arms[0].length_m = 0.5;
  EXPECT_NE(WhyNot(longer).find("pieces: their lengths add up to 0.4 m"), std::string::npos);
  ArmPiece rigid = fine;
  rigid.rigid = true;
  EXPECT_NE(WhyNot(Clamped({rigid}, 4)).find("all are rigid"), std::string::npos);
  EXPECT_NE(WhyNot(Clamped({Piece(0.2, Tube(0.01, 0.011))}, 4)).find("inner_radius"),
            std::string::npos);
  ArmPiece skew = fine;
  skew.stiffness = tests::CoupledStiffness();
  (*skew.stiffness)(0, 1) *= 2;
  EXPECT_NE(WhyNot(Clamped({skew}, 4)).find("symmetric"), std::string::npos);
  skew.stiffness = -tests::CoupledStiffness();
  EXPECT_NE(WhyNot(Clamped({skew}, 4)).find("positive definite"), std::string::npos);
  EXPECT_NE(WhyNot(Clamped({fine, Piece(1e-3, Tube(0.01, 0))}, 4)).find("use more elements"),
            std::string::npos);
}

}  // namespace
}  // namespace mantle::model
