#include "model/newton_matrix.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <tuple>

#include "model/statics.h"
#include "tests/support/gradient_checker.h"
#include "tests/support/paper_robot.h"
#include "tests/support/plant_state.h"

namespace mantle::model {
namespace {

using tests::RandomState;
using tests::RandomValues;

// SDIRK2 at 10 ms: s = 1/(gamma h).
constexpr double kGamma = 0.29289321881345254;
constexpr double kStep_s = 0.01;
// A x = b, checked as |x - A_differences^-1 b| / |x| (what one Newton correction leaves).
// Fourth-order differences are good to 1e-10 of the largest force; the inverse of stiff blocks
// amplifies that.
constexpr double kExact = 1e-6;
// What is left out of a moving arm are squares of rates beside s^2: of the twists' differences
// across an element, 4/s here, times gamma h = 3 ms.
constexpr double kSquareOfRates = 2e-4;

struct Problem {
  Problem(const Robot& robot, double size, unsigned seed)
      : plant(robot),
        state(RandomState(plant, size, seed)),
        acceleration(VectorX::Zero(plant.velocity_size())),
        work(plant),
        matrix(plant) {
    EvaluateInputs(plant, state.time_s, false, &inputs);
    Evaluate();
  }
  void Evaluate() {
    const auto failure = EvaluateForces(plant, state, inputs, &work);
    EXPECT_FALSE(failure) << failure.Message();
  }
  // Of the arms' nodes, as large as the velocities change within a step.
  void Accelerate(double size, unsigned seed) {
    RandomValues random(seed);
    for (int a = 0; a < static_cast<int>(plant.rods.size()); ++a) {
      for (int i = 1; i <= plant.rods[a].element_count(); ++i) {
        acceleration.segment<6>(plant.ArmVelocity(a, i)) = size * random.Twist(300.0, 30.0);
      }
    }
  }
  Plant plant;
  PlantState state;
  VectorX acceleration;
  PlantInputs inputs;
  PlantWork work;
  NewtonMatrix matrix;
};

double Size(const Plant& plant, const VectorX& x) {  // rad and body lengths
  double size = 0;
  const auto pose = [&](const Vector6& z) {
    size = std::max({size, z.head<3>().norm(), z.tail<3>().norm() / plant.body_length_m});
  };
  pose(x.head<6>());
  for (int a = 0; a < static_cast<int>(plant.rods.size()); ++a) {
    for (int i = 1; i <= plant.rods[a].element_count(); ++i) {
      pose(x.segment<6>(plant.ArmVelocity(a, i)));
    }
  }
  for (int j = 0; j < plant.shape_count(); ++j) {
    const Vector3 q = x.segment<3>(plant.ShellVelocity(j));
    size = std::max({size, q.head<2>().norm() / plant.body_length_m, std::abs(q(2))});
  }
  return size;
}

// Solves A x = b for random b, then measures what A really is along x: the derivative of
// M(q (+) x) (a + s^2 x) - f(q (+) x, v + s x). Returns the relative error of x, one Newton
// correction's leftover.
double LeftoverOfOneCorrection(Problem* p, double s, unsigned seed) {
  EXPECT_TRUE(p->matrix.Factor(p->plant, p->state, p->inputs, p->work, p->acceleration, s, 0.0));
  RandomValues random(seed);
  VectorX b(p->plant.velocity_size());
  for (double& v : b) v = random.Uniform();
  if (!p->plant.root_free()) b.head<6>().setZero();
  for (int j = 0; j < p->plant.shape_count(); ++j) {
    const Vector3 free = Vector3::Ones() - p->plant.shell->nodes[j].held;
    auto f = b.segment<3>(p->plant.ShellVelocity(j));
    f = f.cwiseProduct(free);
    f(2) *= 1e-2;  // a moment
  }
  for (int a = 0; a < static_cast<int>(p->plant.rods.size()); ++a) {
    for (int i = 1; i <= p->plant.rods[a].element_count(); ++i) {
      b.segment<3>(p->plant.ArmVelocity(a, i)) *= 1e-2;
    }
  }
  VectorX x = b;
  p->matrix.Solve(p->plant, &x);
  // Scale the direction so that differences see smooth forces.
  const double scale = 1e-5 / Size(p->plant, x);
  PlantWork work(p->plant);
  VectorX inertia = VectorX::Zero(x.size());
  const auto residual = [&](double t) -> VectorX {
    const VectorX force =
        tests::ForceAt(p->plant, p->state, p->inputs, (t * scale) * x, (t * scale * s) * x, &work);
    ApplyMass(p->plant, work, p->acceleration + (t * scale * s * s) * x, &inertia);
    return inertia - force;
  };
  VectorX rest = tests::DifferenceRate(residual, 1.0) / scale - b;
  if (!p->plant.root_free()) rest.head<6>().setZero();
  p->matrix.Solve(p->plant, &rest);
  return Size(p->plant, rest) / Size(p->plant, x);
}

Robot ClampedArm(int elements = 12) {
  Robot robot;
  robot.name = "arm";
  robot.arms = {tests::PaperArm(elements)};
  robot.root = ClampedRoot{};
  robot.effects.viscosity = robot.effects.added_mass = robot.effects.drag = true;
  robot.effects.weight = robot.effects.buoyancy = true;
  robot.arms[0].material.density_kg_m3 = 1200;
  return robot;
}
ArmCable Reeled(const char* name, double angle, double change, double stiffness) {
  return {name, 0.6, angle, 0.3, 0.40, ReeledLength{ConstantSchedule{change}, stiffness, 2.0}, {}};
}
Robot ClampedMantle(int elements = 24) {
  Robot robot;
  robot.name = "mantle";
  robot.mantle = tests::PaperMantle(elements);
  robot.root = ClampedRoot{};
  robot.effects.viscosity = robot.effects.added_mass = true;
  return robot;
}

void ExpectExact(const Robot& robot, double size) {
  const double s = 1.0 / (kGamma * kStep_s);
  for (unsigned seed : {1u, 2u}) {
    Problem p(robot, size, seed);
    p.Accelerate(size, seed);
    const double moving = LeftoverOfOneCorrection(&p, s, seed);
    EXPECT_LT(moving, robot.arms.empty() ? kExact : kSquareOfRates) << "step, seed " << seed;
    if (!robot.arms.empty()) {
      // Where the mass outweighs elasticity and viscosity (steps of 0.3 ms), half the step leaves a
      // quarter; a term of s times a rate would leave half.
      constexpr double kQuarter = 0.3;
      const double small = LeftoverOfOneCorrection(&p, 32.0 * s, seed);
      const double halved = LeftoverOfOneCorrection(&p, 64.0 * s, seed);
      EXPECT_LT(halved, kQuarter * small) << "half the step, seed " << seed;
    }
    p.state.velocity.setZero();
    p.Evaluate();
    EXPECT_LT(LeftoverOfOneCorrection(&p, 1.0 / (kGamma * kStep_s), seed), 10.0 * kExact)
        << "implicit step from rest, seed " << seed;
    EXPECT_LT(LeftoverOfOneCorrection(&p, 0.0, seed), kExact) << "statics, seed " << seed;
  }
}

TEST(NewtonMatrix, ClampedArmIsExactAtRest) { ExpectExact(ClampedArm(), 0.7); }

TEST(NewtonMatrix, ArmWithGivenTensionIsExactAtRest) {
  Robot robot = ClampedArm();
  robot.arms[0].cables = {{"a", 0.6, 0.3, 0.4, 0.40, GivenTension{ConstantSchedule{0.8}}, {}}};
  ExpectExact(robot, 0.7);
}

TEST(NewtonMatrix, ArmWithReeledCablesActiveAndSlackIsExactAtRest) {
  for (double stiffness : {100.0, 1e5}) {
    Robot robot = ClampedArm();
    robot.arms[0].cables = {Reeled("pulls", 0.3, -0.1, stiffness),
                            Reeled("slack", 2.0, 0.2, stiffness),
                            Reeled("pulls too", 4.0, -0.1, 0.1 * stiffness)};
    Problem p(robot, 0.7, 1);
    ASSERT_GT(p.work.cable_tension_n[0], 0.0);
    ASSERT_EQ(p.work.cable_tension_n[1], 0.0);
    ASSERT_GT(p.work.cable_tension_n[2], 0.0);
    // In motion the damping's tension d l_dot also varies with the shape at given twists. That is
    // left out: relative gamma h times the strain rates, some 3 ms times 0.3/s.
    EXPECT_LT(LeftoverOfOneCorrection(&p, 1.0 / (kGamma * kStep_s), 1), 3e-3);
    p.state.velocity.setZero();
    p.Evaluate();
    // The stiffer reel amplifies the round-off of the differences.
    EXPECT_LT(LeftoverOfOneCorrection(&p, 1.0 / (kGamma * kStep_s), 1), 10.0 * kExact);
    EXPECT_LT(LeftoverOfOneCorrection(&p, 0.0, 1), kExact);
  }
}

TEST(NewtonMatrix, ArmWithDeadAndFollowerLoadsIsExactAtRest) {
  Robot robot = ClampedArm();
  RandomValues random(3);
  for (LoadFrame frame : {LoadFrame::kBody, LoadFrame::kWorld}) {
    robot.arms[0].points.push_back(
        {"p", 0.42, random.Twist(0.05, 0.5), frame, ConstantSchedule{1}});
    robot.arms[0].distributed.push_back(
        {"d", random.Twist(0.05, 0.5), 1, 0, frame, ConstantSchedule{1}});
  }
  ExpectExact(robot, 0.7);
}

TEST(NewtonMatrix, ClampedMantleIsExact) { ExpectExact(ClampedMantle(), 0.7); }

TEST(NewtonMatrix, MantleWithNormalPressureIsExact) {
  Robot robot = ClampedMantle();
  robot.effects.normal_pressure = NormalPressure{ConstantSchedule{-200.0}};
  ExpectExact(robot, 0.7);
}

TEST(NewtonMatrix, MantleWithReeledSpokesIsExact) {
  for (double stiffness : {100.0, 1e5}) {
    Robot robot = ClampedMantle();
    robot.mantle->spokes = {
        {"winch", 0.025, 0.105, 8, ReeledLength{ConstantSchedule{-0.05}, stiffness, 2.0}},
        {"slack", 0.025, 0.105, 8, ReeledLength{ConstantSchedule{0.05}, stiffness, 2.0}}};
    Problem p(robot, 0.3, 1);
    ASSERT_GT(p.work.cable_tension_n[0], 0.0);
    ASSERT_EQ(p.work.cable_tension_n[1], 0.0);
    ExpectExact(robot, 0.3);
  }
}

TEST(NewtonMatrix, MantleWithSymmetricAndSupportedEndsIsExact) {
  Robot robot = ClampedMantle();
  robot.mantle->pieces = {{0.06, 0.0}};
  robot.mantle->stations_m.clear();
  robot.mantle->r0_m = 0.0;
  robot.mantle->theta0_rad = 0.0;
  robot.mantle->start = ShellEnd::kSymmetric;
  robot.mantle->end = ShellEnd::kSupported;
  ExpectExact(robot, 0.3);
}

TEST(NewtonMatrix, ThrustAndDragOfTheMantleLeaveTheirVariationInShapeOut) {
  // Rank-one blocks hold the dependence on the flux and on the axial speed; dU_dot/dq at fixed
  // rates and d max(r) are left out. Both are of the order gamma h times the rates of strain (2/s
  // here).
  Robot robot = ClampedMantle();
  robot.effects.drag = true;
  for (FluxReading flux : {FluxReading::kVolume, FluxReading::kRadial}) {
    for (ThrustPlace place : {ThrustPlace::kUniform, ThrustPlace::kDome}) {
      robot.effects.jet_thrust = JetThrust{flux, place};
      Problem p(robot, 0.7, 5);
      ASSERT_GT(std::abs(p.work.thrust_n), 1e-4);
      const double leftover = LeftoverOfOneCorrection(&p, 1.0 / (kGamma * kStep_s), 5);
      EXPECT_LT(leftover, 2e-2);
      RecordProperty("leftover", std::to_string(leftover));
    }
  }
}

TEST(NewtonMatrix, FreeRobotLeavesOnlyBordersThatAreNotStiff) {
  // [newton_matrix.h]: what is left out couples bodies through the root's motion, and costs a
  // factor of about gamma h |eta| per iteration: 3 ms times 2 rad/s and the arms' 3 rad/s.
  Robot robot = tests::PaperRobot(12, 24);
  robot.effects.viscosity = robot.effects.added_mass = true;
  Problem p(robot, 0.7, 6);
  const double leftover = LeftoverOfOneCorrection(&p, 1.0 / (kGamma * kStep_s), 6);
  EXPECT_LT(leftover, 2e-2);
  // and with the step it vanishes in proportion
  const double halved = LeftoverOfOneCorrection(&p, 2.0 / (kGamma * kStep_s), 6);
  EXPECT_LT(halved, 0.8 * leftover);
  RecordProperty("leftover", std::to_string(leftover));
}

TEST(NewtonMatrix, FreeRobotAtRestIsExact) {
  Robot robot = tests::PaperRobot(12, 24);
  robot.effects.viscosity = robot.effects.added_mass = true;
  robot.arms[0].cables = {Reeled("pulls", 0.3, -0.02, 100)};
  robot.mantle->spokes = {
      {"winch", 0.025, 0.105, 8, ReeledLength{ConstantSchedule{-0.05}, 100, 2.0}}};
  Problem p(robot, 0.7, 7);
  p.state.velocity.setZero();
  p.Evaluate();
  EXPECT_LT(LeftoverOfOneCorrection(&p, 1.0 / (kGamma * kStep_s), 7), kExact);
}

TEST(NewtonMatrix, EveryEffectStillContracts) {
  Robot robot = tests::PaperRobot(12, 24);
  robot.effects = tests::EveryEffect();
  Problem p(robot, 0.5, 8);
  const double leftover = LeftoverOfOneCorrection(&p, 1.0 / (kGamma * kStep_s), 8);
  EXPECT_LT(leftover, 5e-2);
  RecordProperty("leftover", std::to_string(leftover));
}

TEST(NewtonMatrix, FrozenCouplingContracts) {
  Robot robot = tests::PaperRobot(12, 24);
  robot.coupling = Coupling::kFrozen;
  robot.effects = tests::EveryEffect();
  Problem p(robot, 0.5, 9);
  EXPECT_LT(LeftoverOfOneCorrection(&p, 1.0 / (kGamma * kStep_s), 9), 5e-2);
}

TEST(NewtonMatrix, CountsNegativeEigenvaluesOfAColumnHeldBySprings) {
  // A straight column past Euler's load in both planes, which a stiff reeled cable on either side
  // holds in its own plane: the border of the cables takes one direction off the chain's two.
  const double young = 110e3, radius = 0.01, length = 0.42;
  const double ei = young * M_PI * std::pow(radius, 4) / 4;
  const double euler = M_PI * M_PI * ei / (4 * length * length);
  for (const auto& [factor, held, directions] :
       {std::tuple{0.9, false, 0}, {1.2, false, 2}, {1.2, true, 1}}) {
    Robot robot = ClampedArm(20);
    robot.effects = Effects{};
    robot.arms[0].cables.clear();
    robot.arms[0].radius_tip_m = robot.arms[0].radius_base_m = radius;
    Vector6 load = Vector6::Zero();
    load(5) = factor * euler;  // the arm hangs along -e3: this pushes
    robot.arms[0].points = {{"push", length, load, LoadFrame::kWorld, ConstantSchedule{1}}};
    // Reels short enough to stay taut where the load shortens the column. A cable inside it follows
    // it and does not buckle it.
    const double stiffness = 300.0;
    for (double angle : {0.0, M_PI}) {
      if (!held) break;
      ArmCable cable;
      cable.name = angle == 0.0 ? "left" : "right";
      cable.angle_rad = angle;
      cable.end_m = length;
      cable.drive = ReeledLength{ConstantSchedule{-1e-3}, stiffness, 0.0};
      robot.arms[0].cables.push_back(cable);
    }
    const StaticsResult result = SolveStatics(Plant(robot), {});
    ASSERT_TRUE(result.ok) << result.reason;
    EXPECT_EQ(result.stability.unstable_directions, directions) << factor << held;
  }
}

TEST(NewtonMatrix, CostIsLinearInNodes) {
  const auto seconds = [](int elements) {
    Problem p(ClampedArm(elements), 0.0, 1);
    double best = 1e9;
    for (int k = 0; k < 7; ++k) {
      const auto start = std::chrono::steady_clock::now();
      VectorX x = p.work.force;
      p.matrix.Factor(p.plant, p.state, p.inputs, p.work, p.acceleration, 341.0, 0.5);
      p.matrix.Solve(p.plant, &x);
      best = std::min(
          best, std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
    }
    return best;
  };
  // 4 times the nodes: 4 where linear, 16 where quadratic; half way in between for a busy machine.
  EXPECT_LT(seconds(2000) / seconds(500), 8.0);
}

}  // namespace
}  // namespace mantle::model
