#include "model/plant.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "model/energy.h"
#include "model/mantle_loads.h"
#include "tests/support/gradient_checker.h"
#include "tests/support/paper_robot.h"
#include "tests/support/plant_state.h"

namespace mantle::model {
namespace {

using tests::EveryEffect;
using tests::ForceAt;
using tests::PaperRobot;
using tests::RandomState;
using tests::RandomValues;

constexpr double kRoundOff = 1e-11;  // relative to the largest force: sums over some hundred nodes
constexpr double kDifferences = 1e-8;  // fourth-order differences along the motion

constexpr double kStep_s = 1e-5;  // of the fastest motion, 1/s times 1e3

// A cable reeled short enough to pull, a given one, and spokes.
Robot Actuated(Robot robot) {
  robot.arms[0].cables = {
      {"given", 0.6, 0.3, 0.4, 0.42, GivenTension{ConstantSchedule{0.7}}, {}},
      {"reeled", 0.6, 2.0, 0.0, 0.30, ReeledLength{ConstantSchedule{-0.01}, 200.0, 1.0}, {}}};
  robot.mantle->spokes = {{"spokes", 0.025, 0.105, 8, GivenTension{ConstantSchedule{0.3}}}};
  return robot;
}

struct Evaluated {
  explicit Evaluated(const Robot& robot, double size, unsigned seed)
      : plant(robot), state(RandomState(plant, size, seed)), work(plant) {
    EvaluateInputs(plant, state.time_s, false, &inputs);
    Evaluate();
  }
  void Evaluate() {
    const auto failure = EvaluateForces(plant, state, inputs, &work);
    EXPECT_FALSE(failure) << failure.Message();
  }
  Plant plant;
  PlantState state;
  PlantInputs inputs;
  PlantWork work;
};

// Sum of generalised momenta or forces as a wrench about the world's origin, world axes: the
// virtual power in a rigid motion of everything (the mantle's shape then does not change).
Vector6 InWorld(const Plant& plant, const PlantState& state, const VectorX& f) {
  Vector6 sum = AdjointInverseTransposeTimes(state.pose[0], f.head<6>());
  for (int a = 0; a < static_cast<int>(plant.rods.size()); ++a) {
    for (int i = 1; i <= plant.rods[a].element_count(); ++i) {
      sum += AdjointInverseTransposeTimes(state.pose[plant.ArmPose(a, i)],
                                          f.segment<6>(plant.ArmVelocity(a, i)));
    }
  }
  return sum;
}

TEST(Plant, InternalForcesAndCablesPutNoNetWrenchOnTheVehicle) {
  Evaluated e(Actuated(PaperRobot(10, 16)), 1.0, 1);
  e.state.velocity.setZero();
  e.Evaluate();
  ASSERT_GT(e.work.cable_tension_n[1], 0.1);  // the reel pulls
  const double scale = e.work.force.cwiseAbs().maxCoeff();
  EXPECT_GT(scale, 0.1);
  EXPECT_LT(InWorld(e.plant, e.state, e.work.force).norm(), kRoundOff * scale);
}

TEST(Plant, WeightIsTheWeightOfEveryPart) {
  Robot robot = PaperRobot(10, 16);
  robot.effects.weight = true;
  Evaluated e(robot, 1.0, 2);
  e.state.velocity.setZero();
  e.Evaluate();
  const Vector3 g(0, 0, -9.81);
  Vector6 expected = Vector6::Zero();
  const auto add = [&](double mass, const Vector3& at) {
    expected.head<3>() += at.cross(mass * g);
    expected.tail<3>() += mass * g;
  };
  const Pose& root = e.state.pose[0];
  add(e.plant.rigid_inertia(5, 5), root.position + root.rotation * Vector3(0, 0, -0.75 * 0.112));
  for (int i = 0; i <= 10; ++i) {
    add(e.plant.rods[0].nodes[i].inertia(5), e.state.pose[e.plant.ArmPose(0, i)].position);
  }
  for (int i = 0; i < 10; ++i) {
    add(e.plant.rods[0].middles[i].inertia(5),
        AbsoluteMiddle(e.plant, e.state, 0, i).pose.position);
  }
  for (int j = 0; j < e.plant.shape_count(); ++j) {
    add(e.plant.shell->nodes[j].mass_kg,
        root.position + root.rotation * Vector3(0, 0, e.state.shape[j](1)));
  }
  const double scale = e.work.force.cwiseAbs().maxCoeff();
  EXPECT_LT((InWorld(e.plant, e.state, e.work.force) - expected).norm(), kRoundOff * scale);
}

// d/dt of the total momentum along the motion that the plant predicts, by differences.
Vector6 MomentumRate(Evaluated& e) {
  VectorX a = VectorX::Zero(e.plant.velocity_size());
  SolveAcceleration(e.plant, e.inputs, &e.work, &a);
  PlantWork work(e.plant);
  const auto momentum = [&](double t) -> Vector6 {
    PlantState s = e.state;
    Retract(e.plant, e.state, t * e.state.velocity, &s);
    s.velocity += t * a;
    EXPECT_FALSE(EvaluateForces(e.plant, s, e.inputs, &work));
    VectorX p = VectorX::Zero(s.velocity.size());
    ApplyMass(e.plant, work, s.velocity, &p);
    return InWorld(e.plant, s, p);
  };
  return tests::DifferenceRate(momentum, kStep_s);
}

TEST(Plant, MomentumIsKeptWithoutExternalLoads) {
  for (bool water : {false, true}) {
    Robot robot = Actuated(PaperRobot(10, 16));
    robot.effects.viscosity = true;
    robot.effects.added_mass = water;  // ideal fluid: added mass is an inertia like any other
    robot.effects.lateral_added_mass = water;
    Evaluated e(robot, 1.0, 3);
    const double scale = e.work.force.norm();
    EXPECT_LT(MomentumRate(e).norm(), kDifferences * scale) << "water " << water;
  }
}

TEST(Plant, ContainedWaterChangesMomentumByItsOutflowAlone) {
  for (double sign : {1.0, -1.0}) {
    Robot robot = PaperRobot(10, 16);
    robot.effects.contained_water = true;
    Evaluated e(robot, 1.0, 4);
    // make the wall move so that water flows in, or out
    for (int j = 1; j < e.plant.shape_count(); ++j) {
      e.state.velocity.segment<3>(e.plant.ShellVelocity(j)) = Vector3(sign * 0.05, 0, 0);
    }
    e.Evaluate();
    ASSERT_EQ(e.work.mantle_inertia.contained_rate_kg_s > 0, sign > 0);
    const Vector6 outflow = AdjointInverseTransposeTimes(
        e.state.pose[0],
        OutflowWrench(e.work.mantle_inertia, e.state.shape.back()(1), e.state.velocity.head<6>()));
    EXPECT_EQ(outflow.norm() > 0, sign < 0);
    EXPECT_LT((MomentumRate(e) - outflow).norm(), kDifferences * e.work.force.norm()) << sign;
  }
}

TEST(Plant, MomentumChangesByTheExternalLoadsAlone) {
  // Drag on everything: its net wrench, once from the generalised forces with and without drag,
  // once from the momentum.
  Robot robot = PaperRobot(10, 16);
  robot.effects = EveryEffect();
  robot.effects.contained_water = false;
  Evaluated e(robot, 1.0, 5);
  robot.effects = Effects{};
  robot.effects.added_mass = robot.effects.lateral_added_mass = robot.effects.viscosity = true;
  Evaluated bare(robot, 1.0, 5);
  const Vector6 loads = InWorld(e.plant, e.state, e.work.force - bare.work.force);
  EXPECT_GT(loads.norm(), 0.1);
  EXPECT_LT((MomentumRate(e) - loads).norm(), kDifferences * e.work.force.norm());
}

// d/dt of kinetic and elastic energy along the predicted motion.
double EnergyRate(Evaluated& e) {
  VectorX a = VectorX::Zero(e.plant.velocity_size());
  SolveAcceleration(e.plant, e.inputs, &e.work, &a);
  PlantWork work(e.plant);
  const auto energy = [&](double t) {
    PlantState s = e.state;
    Retract(e.plant, e.state, t * e.state.velocity, &s);
    s.velocity += t * a;
    EXPECT_FALSE(EvaluateForces(e.plant, s, e.inputs, &work));
    return EvaluateEnergies(e.plant, s, work).total();
  };
  return tests::DifferenceRate(energy, kStep_s);
}

TEST(Plant, EnergyIsKeptWithoutLoadsFreeAndClamped) {
  for (bool free : {true, false}) {
    Robot robot = PaperRobot(10, 16);
    if (!free) robot.root = ClampedRoot{};
    robot.effects.added_mass = robot.effects.lateral_added_mass = true;  // ideal fluid
    Evaluated e(robot, 1.0, 6);
    const double turnover = e.work.force.norm() * e.state.velocity.norm();
    EXPECT_LT(std::abs(EnergyRate(e)), kDifferences * turnover) << "free " << free;
  }
}

TEST(Plant, KineticEnergyIsThatOfTheMassMatrix) {
  Robot robot = PaperRobot(10, 16);
  robot.effects.added_mass = robot.effects.lateral_added_mass = robot.effects.contained_water =
      true;
  Evaluated e(robot, 1.0, 7);
  VectorX p = VectorX::Zero(e.plant.velocity_size());
  ApplyMass(e.plant, e.work, e.state.velocity, &p);
  const Energies energies = EvaluateEnergies(e.plant, e.state, e.work);
  EXPECT_NEAR(energies.kinetic_solid_j + energies.kinetic_water_j, 0.5 * p.dot(e.state.velocity),
              1e-13);
}

TEST(Plant, SolveAccelerationInvertsApplyMass) {
  for (Coupling coupling : {Coupling::kExact, Coupling::kFrozen}) {
    for (bool free : {true, false}) {
      Robot robot = PaperRobot(10, 16);
      robot.coupling = coupling;
      if (!free) robot.root = ClampedRoot{};
      robot.effects = EveryEffect();
      Evaluated e(robot, 1.0, 8);
      VectorX a = VectorX::Zero(e.plant.velocity_size()), f = a;
      SolveAcceleration(e.plant, e.inputs, &e.work, &a);
      ApplyMass(e.plant, e.work, a, &f);
      VectorX expected = e.work.force;
      if (!free) {
        EXPECT_TRUE(a.head<6>().isZero(0.0));
        expected.head<6>() = f.head<6>();  // reaction of the clamp
      }
      EXPECT_LT((f - expected).norm(), 1e-12 * expected.norm());
      for (int k : {0, 1, 2}) EXPECT_EQ(a(e.plant.ShellVelocity(0) + k), 0.0);  // clamped apex
    }
  }
}

TEST(Plant, ForcesAreFrameInvariant) {
  Robot robot = Actuated(PaperRobot(10, 16));
  robot.effects = EveryEffect();
  robot.effects.weight = robot.effects.buoyancy =
      false;  // gravity would have to turn with the frame
  for (Coupling coupling : {Coupling::kExact, Coupling::kFrozen}) {
    robot.coupling = coupling;
    Evaluated e(robot, 1.0, 9);
    const VectorX before = e.work.force;
    RandomValues random(10);
    const Pose h = random.AnyPose(1.0);
    for (std::size_t i = 0; i < e.state.pose.size(); ++i) {
      if (i > 0 && coupling == Coupling::kFrozen) break;  // relative to the root
      e.state.pose[i] = h * e.state.pose[i];
    }
    e.Evaluate();
    // Positions of order 1 m in double give element strains to 1e-14, times EA = 34 N and more.
    EXPECT_LT((e.work.force - before).norm(), 1e-10 * before.norm());
  }
}

TEST(Plant, GravityTurnsWithTheFrame) {
  Robot robot = PaperRobot(10, 16);
  robot.effects = EveryEffect();
  robot.arms[0].material.density_kg_m3 = 1300;
  robot.rigid_body->shape = Cone{0.015, 0.112, 2000.0};
  Evaluated e(robot, 1.0, 11);
  RandomValues random(12);
  const Pose h = random.AnyPose(1.0);
  robot.effects.gravity_m_s2 = h.rotation * robot.effects.gravity_m_s2;
  Evaluated turned(robot, 1.0, 11);
  for (Pose& g : turned.state.pose) g = h * g;
  turned.Evaluate();
  EXPECT_LT((e.work.force - turned.work.force).norm(), 1e-10 * e.work.force.norm());
}

TEST(Plant, NeutralBodyFeelsExactlyNothing) {
  Robot robot = PaperRobot(10, 16);
  Evaluated without(robot, 1.0, 13);
  robot.effects.weight = robot.effects.buoyancy = true;
  Evaluated with(robot, 1.0, 13);
  EXPECT_EQ(with.work.force, without.work.force);
}

TEST(Plant, ParametersOfEffectsThatAreOffChangeNoBit) {
  Robot full = PaperRobot(10, 16);  // every coefficient given, no effect named
  Robot bare = full;
  bare.arms[0].drag_coefficients.setZero();
  bare.arms[0].added_mass_coefficient = 0;
  bare.arms[0].material.viscosity_pa_s = 0;
  bare.mantle->material.viscosity_pa_s = 0;
  bare.mantle->added_mass_coefficient = bare.mantle->drag_coefficient = 0;
  bare.mantle->nozzle_radius_m = 0;
  bare.water.density_kg_m3 = 0;
  Evaluated a(full, 1.0, 14), b(bare, 1.0, 14);
  EXPECT_EQ(a.work.force, b.work.force);
  VectorX x = VectorX::Zero(a.work.force.size()), y = x;
  SolveAcceleration(a.plant, a.inputs, &a.work, &x);
  SolveAcceleration(b.plant, b.inputs, &b.work, &y);
  EXPECT_EQ(x, y);
}

TEST(Plant, EveryEffectChangesTheForces) {
  // The other half of the claim: each effect named does something at a moving, deformed state.
  Robot base = PaperRobot(10, 16);
  base.arms[0].material.density_kg_m3 = 1100;
  Evaluated off(base, 1.0, 15);
  VectorX a0 = off.work.force;
  SolveAcceleration(off.plant, off.inputs, &off.work, &a0);
  const Effects all = EveryEffect();
  const auto expect_change = [&](const char* name, auto enable) {
    Robot robot = base;
    enable(&robot.effects);
    Evaluated on(robot, 1.0, 15);
    VectorX a = a0;
    SolveAcceleration(on.plant, on.inputs, &on.work, &a);
    EXPECT_GT((a - a0).norm(), 1e-6) << name;
  };
  expect_change("weight", [](Effects* e) { e->weight = true; });
  expect_change("buoyancy", [](Effects* e) { e->buoyancy = true; });
  expect_change("drag", [](Effects* e) { e->drag = true; });
  expect_change("added_mass", [](Effects* e) { e->added_mass = true; });
  expect_change("viscosity", [](Effects* e) { e->viscosity = true; });
  expect_change("contained_water", [](Effects* e) { e->contained_water = true; });
  expect_change("lateral_added_mass", [](Effects* e) { e->lateral_added_mass = true; });
  expect_change("jet_thrust", [&](Effects* e) { e->jet_thrust = all.jet_thrust; });
  expect_change("normal_pressure",
                [](Effects* e) { e->normal_pressure = NormalPressure{ConstantSchedule{10.0}}; });
  expect_change("lateral_drag", [&](Effects* e) { e->lateral_drag = all.lateral_drag; });
  all.named.ForEach([&](const auto& effect) {
    using Effect = EffectType<decltype(effect)>;
    if (effect) expect_change(Effect::kName, [&](Effects* e) { e->named.Set(*effect); });
  });
}

TEST(Plant, PrescribedRootMovesAsItsSchedulesSay) {
  Robot robot = PaperRobot(4, 16);
  PrescribedRoot motion;
  motion.x_m = SineSchedule{0.1, 0.7, 0.3, 0.0, 0.0};
  motion.z_m = SineSchedule{0.2, 0.4, 0.1, 0.0, 0.0};
  motion.angle_rad = SineSchedule{0.8, 0.5, 0.2, 0.0, 0.0};
  motion.rotation_axis = Vector3(1, 2, -1).normalized();
  robot.root = motion;
  robot.root_pose.rotation = ExpSO3(Vector3(0.3, -0.2, 0.5));
  robot.effects.current_m_s = Vector3(0.1, -0.2, 0.05);
  const Plant plant(robot);
  const auto at = [&](double t) {
    PlantInputs in;
    EvaluateInputs(plant, t, false, &in);
    return in;
  };
  constexpr double t = 0.37, h = 1e-4;
  const PlantInputs now = at(t), next = at(t + h), last = at(t - h);
  const Vector6 twist = (LogSE3(Inverse(now.root_pose) * next.root_pose) -
                         LogSE3(Inverse(now.root_pose) * last.root_pose)) /
                        (2 * h);
  EXPECT_LT((twist - now.root_twist).norm(), 1e-6);  // h^2 w^3
  const Vector6 acceleration = (next.root_twist - last.root_twist) / (2 * h);
  EXPECT_LT((acceleration - now.root_acceleration).norm(), 1e-5);
}

TEST(Plant, BreakPointsOfEverySchedulesAreFound) {
  Robot robot = Actuated(PaperRobot(4, 16));
  robot.arms[0].distributed = {
      {"torque", Vector6::Unit(2), 0.05, 0, LoadFrame::kBody, IntervalSchedule{1, {0.5}, {0.9}}}};
  robot.mantle->strips = {{"pulse", 0.025, 0.105, TriangularSchedule{0, 325, 0.66, 0}}};
  robot.arms[0].cables[0].drive = GivenTension{TableSchedule{{0.2, 0.4}, {0, 1}}};
  const Plant plant(robot);
  std::vector<double> found;
  for (double t = 0; t < 0.95;) found.push_back(t = NextBreakpoint(plant, t));
  const std::vector<double> expected = {0.2, 0.33, 0.4, 0.5, 0.66, 0.9, 0.99};
  ASSERT_EQ(found.size(), expected.size());
  for (std::size_t i = 0; i < expected.size(); ++i) EXPECT_NEAR(found[i], expected[i], 1e-12);
}

TEST(Plant, StatesBeyondTheModelAreRefusedByName) {
  Evaluated e(PaperRobot(10, 16), 0.0, 16);
  PlantState state = e.state;
  state.pose[e.plant.ArmPose(0, 4)].rotation =
      state.pose[e.plant.ArmPose(0, 4)].rotation * ExpSO3(Vector3(0, 0, 2.9));
  EvaluationFailure failure = EvaluateForces(e.plant, state, e.inputs, &e.work);
  ASSERT_TRUE(failure);
  EXPECT_STREQ(failure.body, "arm");
  EXPECT_EQ(failure.node, 3);
  state = e.state;
  state.shape[7](0) = -1e-6;
  failure = EvaluateForces(e.plant, state, e.inputs, &e.work);
  ASSERT_TRUE(failure);
  EXPECT_STREQ(failure.body, "mantle");
  EXPECT_EQ(failure.node, 7);
  state = e.state;
  state.velocity(2) = std::numeric_limits<double>::quiet_NaN();
  EXPECT_TRUE(EvaluateForces(e.plant, state, e.inputs, &e.work));
}

TEST(Plant, RobotsThatCannotBeAreRefused) {
  EXPECT_THROW(Plant{Robot{}}, BadRobot);
  Robot weightless;
  weightless.arms = {tests::PaperArm(4)};
  weightless.arms[0].material.density_kg_m3 = 0;
  EXPECT_THROW(Plant{weightless}, BadRobot);
}

}  // namespace
}  // namespace mantle::model
