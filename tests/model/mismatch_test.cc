#include "model/mismatch.h"

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <set>
#include <string>

#include "model/energy.h"
#include "tests/support/paper_robot.h"
#include "tests/support/random_values.h"

namespace mantle::model {
namespace {

constexpr double kFactor = 1.3;
constexpr double kRoundOff = 1e-12;  // of sums of a few hundred terms, each scaled

// Every effect, on an arm, a mantle and a rigid body that are lighter than water.
Robot Everything(const Mismatch& mismatch) {
  Robot robot = tests::PaperRobot(4, 12);
  robot.arms[0].material.density_kg_m3 = 900;
  robot.arms[0].distributed = {{"twist", Vector6::Unit(0), 1, 1, LoadFrame::kWorld, {}}};
  robot.arms[0].distributed[0].schedule = ConstantSchedule{0.01};
  robot.arms[0].points = {{"pull", 0.42, Vector6::Unit(4), LoadFrame::kWorld, {}}};
  robot.arms[0].points[0].schedule = ConstantSchedule{0.02};
  robot.mantle->material.density_kg_m3 = 900;
  Effects& e = robot.effects;
  e.weight = e.buoyancy = e.drag = e.added_mass = e.viscosity = true;
  e.contained_water = e.lateral_added_mass = true;
  e.jet_thrust = JetThrust{};
  e.normal_pressure = NormalPressure{ConstantSchedule{5.0}};
  e.lateral_drag = LateralDrag{};
  e.named.Set(RollDrag{});
  e.named.Set(RigidDrag{});
  robot.mismatch = mismatch;
  return robot;
}

// Powers of every load by name and what the bodies themselves do, at one moving state.
std::map<std::string, double> Observe(const Robot& robot) {
  const Plant plant(robot);
  PlantState state = InitialState(plant);
  tests::RandomValues random(7);
  for (double& v : state.velocity) v = 0.1 * random.Uniform();
  // A shrinking mantle, so that contained water leaves, and a strained arm.
  for (int j = 1; j < plant.shape_count(); ++j) state.velocity(plant.ShellVelocity(j)) = -0.02;
  PlantState bent = state;
  VectorX increment = VectorX::Zero(plant.velocity_size());
  increment.segment<6>(plant.ArmVelocity(0, 2)) << 0.01, 0.02, -0.01, 1e-3, 2e-3, -1e-3;
  for (int j = 1; j < plant.shape_count(); ++j) increment(plant.ShellVelocity(j)) = -1e-3;
  Retract(plant, state, increment, &bent);
  PlantInputs inputs;
  EvaluateInputs(plant, 0.0, false, &inputs);
  PlantWork work(plant);
  EXPECT_FALSE(EvaluateForces(plant, bent, inputs, &work));
  EnergyAccount account(plant);
  account.EvaluatePowers(plant, bent, inputs, work, VectorX::Zero(plant.velocity_size()));
  std::map<std::string, double> out;
  for (std::size_t i = 0; i < account.names().size(); ++i) {
    out[account.names()[i]] = account.power_w()[i];
  }
  out["stress.arms"] = account.stress_power_arms_w();
  out["stress.mantle"] = account.stress_power_mantle_w();
  double arms = 0;
  for (int i = 0; i < plant.rods[0].element_count(); ++i) {
    const Vector6 rate = work.rod[0][i].StrainRate(plant.rods[0].elements[i]);
    arms += plant.rods[0].elements[i].length *
            rate.dot(plant.rods[0].elements[i].viscosity.cwiseProduct(rate));
  }
  out["dissipation.arms"] = arms;
  out["dissipation.mantle"] = account.dissipation_w() - arms;
  out["added_mass.arms"] = plant.rods[0].nodes[2].added_mass_kg;
  out["added_mass.mantle"] = plant.shell->added_mass_factor;
  return out;
}

struct Row {
  const char* name;
  double Mismatch::*factor;
  std::set<std::string> scaled;  ///< by the factor; nothing else changes
};

const Row kTable[] = {
    {"young", &Mismatch::young, {"stress.arms", "stress.mantle"}},
    {"viscosity", &Mismatch::viscosity, {"dissipation.arms", "dissipation.mantle"}},
    {"drag",
     &Mismatch::drag,
     {"drag.arm", "drag.mantle", "lateral_drag", "roll_drag", "rigid_drag"}},
    {"added_mass", &Mismatch::added_mass, {"added_mass.arms", "added_mass.mantle"}},
    {"jet", &Mismatch::jet, {"jet_thrust"}},
};
static_assert(sizeof(Mismatch) == std::size(kTable) * sizeof(double), "a factor has no row");

TEST(Mismatch, EveryFactorScalesExactlyWhatItNames) {
  const std::map<std::string, double> described = Observe(Everything({}));
  for (const auto& [name, value] : described) {
    EXPECT_NE(value, 0.0) << name << ": a power of zero shows nothing";
  }
  for (const Row& row : kTable) {
    Mismatch m;
    m.*row.factor = kFactor;
    for (const auto& [name, value] : Observe(Everything(m))) {
      const double expected = described.at(name) * (row.scaled.contains(name) ? kFactor : 1.0);
      EXPECT_NEAR(value, expected, kRoundOff * std::abs(expected)) << row.name << ": " << name;
    }
    for (const std::string& name : row.scaled) {
      EXPECT_TRUE(described.contains(name)) << row.name << ": " << name;
    }
  }
}

TEST(Mismatch, AlsoScalesSectionsGivenAsDiagonals) {
  Robot robot = Everything({});
  robot.arms[0].stiffness = Vector6::Constant(2.0);
  robot.arms[0].viscosity = Vector6::Constant(3.0);
  robot.mismatch.young = 1.1;
  robot.mismatch.viscosity = 1.2;
  const Plant plant(robot);
  EXPECT_NEAR(plant.rods[0].elements[0].stiffness(3), 2.2, kRoundOff);
  EXPECT_NEAR(plant.rods[0].elements[0].viscosity(3), 3.6, kRoundOff);
}

TEST(Mismatch, IsAppliedOnceWhateverIsBuiltFromThePlantsRobot) {
  Mismatch m;
  m.young = 1.2;
  m.drag = 1.3;
  m.jet = 1.4;
  const std::map<std::string, double> once = Observe(Everything(m));
  EXPECT_EQ(Observe(Plant(Everything(m)).robot), once);
}

}  // namespace
}  // namespace mantle::model
