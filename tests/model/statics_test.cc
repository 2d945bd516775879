#include "model/statics.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "model/simulation.h"
#include "tests/support/runs.h"

/// Equilibria against closed forms, and what statics must say when there is none or an unstable
/// one.

namespace mantle::model {
namespace {

using tests::ClampedRod;
using tests::TipLoad;

constexpr double kPi = std::numbers::pi;

Vector6 Stiffness(double gi, double ei, double ea) {
  Vector6 s;
  s << gi, ei, ei, ea, ea, ea;
  return s;
}

// Thin enough that the rotary inertia that an element carries does not matter.
Robot UnitRod(double ea, int elements) {
  Robot robot = ClampedRod(1.0, Stiffness(1, 1, ea), elements);
  Vector6 inertia;
  inertia << 1e-6, 1e-6, 1e-6, 1, 1, 1;
  robot.arms[0].inertia = inertia;
  return robot;
}

void Load(Robot* robot, const Vector3& moment, const Vector3& force, LoadFrame frame) {
  PointWrench load = TipLoad(robot->arms[0], moment, force, frame);
  load.name += std::to_string(robot->arms[0].points.size());
  robot->arms[0].points.push_back(load);
}

StaticsResult Solve(const Robot& robot, int load_steps,
                    StaticBranch branch = StaticBranch::kPrimary, bool arc_length = false) {
  StaticsSettings settings;
  settings.load_steps = load_steps;
  settings.branch = branch;
  settings.arc_length = arc_length;
  return SolveStatics(Plant(robot), settings);
}

constexpr double kEuler = kPi * kPi / 4.0;  // of a unit cantilever

TEST(Statics, CountsEveryUnstableDirectionOfAStraightColumn) {
  // A clamped column has critical loads (2k - 1)^2 pi^2 EI / 4 L^2, each in two planes. The sign of
  // a determinant misses all of them.
  const std::pair<double, int> cases[] = {{0.9, 0}, {1.1, 2}, {8.5, 2}, {9.5, 4}, {26.0, 6}};
  for (const auto& [factor, directions] : cases) {
    Robot robot = UnitRod(1e7, 80);
    Load(&robot, Vector3::Zero(), {-factor * kEuler, 0, 0}, LoadFrame::kWorld);
    const StaticsResult result = Solve(robot, 10);
    ASSERT_TRUE(result.ok) << result.reason;
    EXPECT_EQ(result.stability.unstable_directions, directions) << factor;
    EXPECT_EQ(result.stability.test, StabilityTest::kInertia);
    EXPECT_EQ(result.bifurcation_load_factors.size(), static_cast<std::size_t>(directions / 2));
    if (directions > 0) {
      // 80 elements: their critical load is 1e-4 off; located to a thousandth of a load step.
      EXPECT_NEAR(result.bifurcation_load_factors[0] * factor, 1.0, 1e-3 + 1e-3 * 0.1 * factor);
    }
    EXPECT_NEAR(result.path.back().tips_m[0].tail<2>().norm(), 0.0, 1e-9) << "stays straight";
  }
}

TEST(Statics, CountsOnePlaneWhereTheOtherIsStiffer) {
  Robot robot = UnitRod(1e7, 40);
  (*robot.arms[0].stiffness)(1) = 10.0;
  Load(&robot, Vector3::Zero(), {-2.0 * kEuler, 0, 0}, LoadFrame::kWorld);
  EXPECT_EQ(Solve(robot, 10).stability.unstable_directions, 1);
}

// Tip of the elastica under an axial load P = k^2 EI of a clamped column, k = K(m), m = sin^2(a/2),
// a the angle of the tip: (x, y) = (2 E(m) / K(m) - 1, 2 sqrt(m) / K(m)).
struct Buckled {
  double x, y;
};
Buckled BuckledColumn(double load) {
  double low = 0, high = 1 - 1e-12;
  for (int i = 0; i < 200; ++i) {
    const double m = 0.5 * (low + high);
    (std::comp_ellint_1(std::sqrt(m)) < std::sqrt(load) ? low : high) = m;
  }
  const double k = std::sqrt(low), first = std::comp_ellint_1(k);
  return {2.0 * std::comp_ellint_2(k) / first - 1.0, 2.0 * k / first};
}

// Elements' error h^2 at 60 of them; the side load of 1e-5 EI / L^2 moves the tip by 1e-5.
constexpr double kBuckled = 1e-3;

TEST(Statics, ASideLoadLeadsToTheStableBranch) {
  for (double factor : {1.2, 2.04, 4.0, 8.0}) {
    const Buckled exact = BuckledColumn(factor * kEuler);
    for (bool arc_length : {false, true}) {
      for (double side : {1e-3, -1e-2}) {
        Robot robot = UnitRod(1e7, 60);
        Load(&robot, Vector3::Zero(), {-factor * kEuler, 0, 0}, LoadFrame::kWorld);
        Load(&robot, Vector3::Zero(), {0, side, 0}, LoadFrame::kWorld);
        const StaticsResult result = Solve(robot, 10, StaticBranch::kPrimary, arc_length);
        ASSERT_TRUE(result.ok) << result.reason;
        EXPECT_EQ(result.stability.unstable_directions, 0) << factor;
        EXPECT_TRUE(result.bifurcation_load_factors.empty());
        const Vector3 tip = result.path.back().tips_m[0];
        EXPECT_NEAR(tip.x(), exact.x, kBuckled + 2 * std::abs(side)) << factor;
        EXPECT_NEAR(tip.y(), std::copysign(exact.y, side), kBuckled + 2 * std::abs(side)) << factor;
      }
    }
  }
}

TEST(Statics, TheStableBranchIsLeftForOnRequest) {
  for (double ratio : {4.0, 1.0}) {  // of the bending stiffnesses: 1 can turn about its axis
    Robot robot = UnitRod(1e6, 40);
    (*robot.arms[0].stiffness)(1) = ratio;
    Load(&robot, Vector3::Zero(), {-2.04 * kEuler, 0, 0}, LoadFrame::kWorld);
    const StaticsResult result = Solve(robot, 10, StaticBranch::kStable);
    ASSERT_TRUE(result.ok) << result.reason;
    EXPECT_EQ(result.stability.unstable_directions, 0) << ratio;
    const Buckled exact = BuckledColumn(2.04 * kEuler);
    const Vector3 tip = result.path.back().tips_m[0];
    EXPECT_NEAR(tip.x(), exact.x, 2 * kBuckled);
    EXPECT_NEAR(tip.tail<2>().norm(), exact.y, 2 * kBuckled);
  }
}

TEST(Statics, NearlyInextensibleRodsTakeNoMoreIterations) {
  // Bisshopp & Drucker: P L^2 / EI = 10. 200 elements are 2e-4 off, EA = 1e4 stretches by 1e-3.
  int all = 0;
  for (double ea : {1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10}) {
    Robot robot = UnitRod(ea, 100);
    Load(&robot, Vector3::Zero(), {0, 10, 0}, LoadFrame::kWorld);
    const StaticsResult result = Solve(robot, 10);
    ASSERT_TRUE(result.ok) << ea << ": " << result.reason;
    EXPECT_LE(result.iterations, 80) << ea;
    all = std::max(all, result.iterations);
    const Vector3 tip = result.path.back().tips_m[0];
    EXPECT_NEAR(tip.y(), 0.8106090, 2e-4 + 10 / ea) << ea;
    EXPECT_NEAR(tip.x(), 1.0 - 0.5550, 2e-4 + 10 / ea) << ea;
  }
  RecordProperty("iterations", all);
}

TEST(Statics, TypicalLoadStepsTakeAtMostEightIterations) {
  const auto per_step = [](const StaticsResult& r) {
    EXPECT_TRUE(r.ok) << r.reason;
    return static_cast<double>(r.iterations) / static_cast<double>(r.path.size() - 1);
  };
  for (double load : {1.0, 5.0, 10.0, 50.0}) {
    Robot robot = UnitRod(1e6, 60);
    Load(&robot, Vector3::Zero(), {0, load, 0}, LoadFrame::kWorld);
    const StaticsResult dead = Solve(robot, 10);
    EXPECT_EQ(dead.path.size(), 11u) << "no step needs to be halved";
    EXPECT_LE(per_step(dead), 8.0) << load;
    robot.arms[0].points[0].frame = LoadFrame::kBody;
    EXPECT_LE(per_step(Solve(robot, 10)), 8.0) << "follower " << load;
  }
}

TEST(Statics, TenTurnsOfAHelixByACoupleAtTheTip) {
  // Where torsion and bending are equally stiff the strain is constant: exact on any mesh.
  for (int elements : {40, 100}) {
    Robot robot = UnitRod(1e9, elements);
    const Vector3 curvature(12.0, 0, 2.0 * kPi * 10 * 0.95);
    Load(&robot, curvature, Vector3::Zero(), LoadFrame::kBody);
    const StaticsResult result = Solve(robot, 20);
    ASSERT_TRUE(result.ok) << result.reason;
    EXPECT_LE(result.iterations, 200);
    Vector6 strain;
    strain << curvature, 1, 0, 0;
    const Vector3 exact = ExpSE3(strain).position;
    // A stiffness of 1e9 lets moments of 60 stretch nothing; Newton's tolerance and round-off.
    EXPECT_LT((result.path.back().tips_m[0] - exact).norm(), 1e-7);
  }
}

TEST(Statics, BecksColumnFluttersAtItsLoad) {
  // M. Beck, ZAMP 3 (1952) 225: a follower load makes a cantilever flutter at 20.05 EI / L^2; its
  // stiffness never becomes singular.
  for (double load : {19.0, 21.0}) {
    Robot robot = UnitRod(1e6, 40);
    Load(&robot, Vector3::Zero(), {-load, 0, 0}, LoadFrame::kBody);
    const StaticsResult result = Solve(robot, 4);
    ASSERT_TRUE(result.ok) << result.reason;
    EXPECT_EQ(result.stability.test, StabilityTest::kLinearisedMotion);
    EXPECT_EQ(result.without_potential.size(), 1u);
    // Two planes, two growing solutions in each.
    EXPECT_EQ(result.stability.unstable_directions, load > 20.05 ? 4 : 0) << load;
    EXPECT_EQ(result.stability.frequency_hz > 0, load > 20.05);
  }
}

TEST(Statics, AnArcLengthPathThatDoesNotArriveIsIncomplete) {
  Robot robot = UnitRod(1e6, 40);
  Load(&robot, Vector3::Zero(), {-2.04 * kEuler, 0, 0}, LoadFrame::kWorld);
  Load(&robot, Vector3::Zero(), {0, 1e-3, 0}, LoadFrame::kWorld);
  StaticsSettings settings;
  settings.arc_length = true;
  settings.max_points = 8;
  const StaticsResult result = SolveStatics(Plant(robot), settings);
  EXPECT_FALSE(result.ok);
  EXPECT_NE(result.reason.find("max_points"), std::string::npos) << result.reason;
  EXPECT_LT(result.load_factor, 1.0);
}

TEST(Statics, AnArmIsNotTurnedInsideOut) {
  for (bool arc_length : {false, true}) {
    Robot robot = UnitRod(10, 20);  // short of stiffness: EA = 10 N pushed with 30 N
    (*robot.arms[0].stiffness).head<3>().setConstant(100.0);
    Load(&robot, Vector3::Zero(), {-30, 0, 0}, LoadFrame::kWorld);
    const StaticsResult result = Solve(robot, 10, StaticBranch::kPrimary, arc_length);
    EXPECT_FALSE(result.ok);
    EXPECT_NE(result.reason.find("inside out"), std::string::npos) << result.reason;
    EXPECT_NEAR(result.load_factor, 1.0 / 3.0, 1e-3);
  }
}

TEST(Statics, EachKindOfFailureHasItsOwnMessage) {
  Robot column = UnitRod(1e6, 20);
  Load(&column, Vector3::Zero(), {0, 10, 0}, LoadFrame::kWorld);
  const auto reason = [&](const auto& change) {
    StaticsSettings settings;
    Robot robot = column;
    change(&robot, &settings);
    const StaticsResult result = SolveStatics(Plant(robot), settings);
    EXPECT_FALSE(result.ok);
    return result.reason;
  };
  EXPECT_NE(reason([](Robot*, StaticsSettings* s) {
              s->max_iterations = 1;
              s->tolerance = 1e-14;
            }).find("max_iterations = 1"),
            std::string::npos);
  EXPECT_NE(reason([](Robot* r, StaticsSettings*) {
              (*r->arms[0].stiffness)(0) = 0.0;
            }).find("direction without stiffness"),
            std::string::npos);
  EXPECT_NE(
      reason([](Robot* r, StaticsSettings*) {
        r->arms[0].elements = 2;
        r->arms[0].points[0] = TipLoad(r->arms[0], {0, 0, 20}, Vector3::Zero(), LoadFrame::kBody);
      }).find("rotation across one element"),
      std::string::npos);
}

// What a scene names must act in statics as it does in time. The settled run is the judge.
class StaticsEffects : public ::testing::TestWithParam<const char*> {};

Robot EffectRobot(const std::string& effect) {
  Robot robot;
  robot.name = "effects";
  robot.root = ClampedRoot{};
  robot.root_pose.rotation = ExpSO3(Vector3(0.2, 0.4, -0.3));
  Arm arm;
  arm.name = "arm";
  arm.length_m = 0.4;
  arm.radius_base_m = 0.012;
  arm.radius_tip_m = 0.008;
  arm.material = {2e5, 0.3, 2e4, 1200};
  arm.elements = 8;
  arm.drag_coefficients = {0.1, 1.5, 2.0};
  arm.added_mass_coefficient = 1.5;
  robot.arms = {arm};
  robot.effects.viscosity = true;
  Effects& e = robot.effects;
  if (effect == "weight") e.weight = true;
  if (effect == "buoyancy") e.buoyancy = true;
  if (effect == "drag") {
    e.drag = true;
    e.current_m_s = Vector3(0.2, 0.3, -0.1);
  }
  if (effect == "added_mass") {
    e.added_mass = true;
    e.current_m_s = Vector3(0.2, 0.3, -0.1);
  }
  if (effect == "everything") {
    e.weight = e.buoyancy = e.drag = e.added_mass = true;
    e.current_m_s = Vector3(-0.1, 0.4, 0.2);
    ArmCable cable;
    cable.name = "reel";
    cable.end_m = 0.4;
    cable.drive = ReeledLength{ConstantSchedule{-0.01}, 200.0, 1.0};
    robot.arms[0].cables = {cable};
    Load(&robot, {0.002, 0.001, 0.003}, {0.01, 0.02, -0.01}, LoadFrame::kBody);
  }
  return robot;
}

TEST_P(StaticsEffects, SettleInTimeWhereStaticsSaysTheyDo) {
  // Backward Euler over forty seconds of a heavily damped arm leaves nothing of the transient; what
  // is left is Newton's tolerance in both.
  constexpr double kSettled = 1e-6;  // m
  const Robot robot = EffectRobot(GetParam());
  const StaticsResult equilibrium = Solve(robot, 4);
  ASSERT_TRUE(equilibrium.ok) << equilibrium.reason;
  EXPECT_EQ(equilibrium.stability.unstable_directions, 0);
  RunSettings settings = tests::Settings(Integrator::kBackwardEuler, 0.1, 40.0);
  const Plant plant(robot);
  Simulation simulation(plant, settings);
  Vector3 tip = Vector3::Zero();
  const RunResult run = simulation.Run([&](const Sample& sample) {
    tip = sample.tips[0].position;
    return true;
  });
  ASSERT_TRUE(run.ok) << run.reason;
  const Vector3 said = equilibrium.path.back().tips_m[0];
  EXPECT_LT((said - tip).norm(), kSettled) << said.transpose() << " and " << tip.transpose();
  const Vector3 rest = equilibrium.path.front().tips_m[0];
  EXPECT_GT((said - rest).norm(), 1e-4) << "the effect acts at all";
}

INSTANTIATE_TEST_SUITE_P(Effects, StaticsEffects,
                         ::testing::Values("weight", "buoyancy", "drag", "added_mass",
                                           "everything"));

}  // namespace
}  // namespace mantle::model
