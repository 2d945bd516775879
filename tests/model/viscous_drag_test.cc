#include "model/effects/viscous_drag.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "model/simulation.h"
#include "model/statics.h"
#include "tests/support/paper_robot.h"
#include "tests/support/random_values.h"
#include "tests/support/reduced_pair.h"

namespace mantle::model {
namespace {

constexpr double kTangential = 0.4, kNormal = 0.7;  // Pa s

// A straight cylinder along x of the root, 2 cm thick.
Robot Cylinder(const RootMotion& root, int elements) {
  Robot robot;
  robot.name = "cylinder";
  robot.root = root;
  Arm arm = tests::PaperArm(elements);
  arm.mount = Pose::Identity();
  arm.radius_base_m = arm.radius_tip_m = 0.01;
  arm.material.density_kg_m3 = 1100;
  robot.arms = {arm};
  robot.effects.named.Set(ViscousDrag{kTangential, kNormal, 0, 0});
  return robot;
}

RunSettings For(double duration_s, double step_s) {
  RunSettings settings;
  settings.duration_s = settings.output_interval_s = duration_s;
  settings.step_s = step_s;
  return settings;
}

TEST(ViscousDrag, OpposesEachPartOfTheVelocityWithItsCoefficient) {
  tests::RandomValues random(1);
  const auto arm =
      ViscousDrag::SectionLoad::From({kTangential, kNormal, 0, 0}, Arm{}, Water{}).value();
  const auto root = ViscousDrag::RootLoad::From({0, 0, 2, 3}, Bodies{}).value();
  for (int i = 0; i < 5; ++i) {
    const SectionMotion motion{random.AnyPose(1).rotation, random.Twist(1, 1)};
    const Vector3 v = motion.twist.tail<3>();
    const Vector6 w = arm.Density({}, motion);
    EXPECT_EQ(Vector3(w.head<3>()), Vector3::Zero());
    EXPECT_EQ(Vector3(w.tail<3>()), Vector3(-kTangential * v(0), -kNormal * v(1), -kNormal * v(2)));
    LoadTangent t;
    arm.AddTangent({}, motion, &t);
    EXPECT_EQ(Vector3(t.force_by_velocity * v), Vector3(w.tail<3>()));  // it is linear
    RootTangent rt;
    root.AddTangent(motion, 1, &rt);
    EXPECT_EQ(Vector6(rt.by_twist * motion.twist), root.Wrench(motion));
    EXPECT_EQ(Vector3(root.Wrench(motion).tail<3>()), Vector3(-2 * v));
  }
  EXPECT_FALSE(ViscousDrag::SectionLoad::From({0, 0, 2, 3}, Arm{}, Water{}));
  EXPECT_FALSE(ViscousDrag::RootLoad::From({kTangential, kNormal, 0, 0}, Bodies{}));
}

TEST(ViscousDrag, CylinderSinksAlongItsAxisAsItsTangentialCoefficientSays) {  // m g / (c_t L)
  Robot robot = Cylinder(FreeRoot{}, 4);
  robot.effects.weight = robot.effects.buoyancy = true;
  const Arm& arm = robot.arms[0];
  const double area = std::numbers::pi * arm.radius_base_m * arm.radius_base_m;
  const double net = (arm.material.density_kg_m3 - robot.water.density_kg_m3) * area;  // kg/m
  const double settle = arm.material.density_kg_m3 * area / kTangential;  // of the speed [s]
  for (const auto& [gravity, coefficient, axis] :
       {std::tuple{Vector3(9.81, 0, 0), kTangential, 0}, {Vector3(0, 9.81, 0), kNormal, 1}}) {
    robot.effects.gravity_m_s2 = gravity;
    const Plant plant(robot);
    Simulation run(plant, For(20 * settle, settle / 4));
    ASSERT_TRUE(run.Run().ok);
    const Vector6 twist = run.state().velocity.head<6>();
    const double expected = net * 9.81 / coefficient;
    EXPECT_NEAR(twist(3 + axis), expected, 1e-6 * std::abs(expected));  // e^-20, twice damped
  }
}

TEST(ViscousDrag, ClampedRodCreepsBackAtTheRateOfResistiveForceTheory) {
  // Without inertia EI y'''' = -c_n y_t: the first mode decays at EI beta^4 / c_n, beta L = 1.8751.
  // What inertia changes is rate m / c_n: 1e-4 here.
  Robot robot = Cylinder(ClampedRoot{}, 40);
  Arm& arm = robot.arms[0];
  const double area = std::numbers::pi * arm.radius_base_m * arm.radius_base_m;
  const double bending =
      arm.material.young_pa * std::numbers::pi * std::pow(arm.radius_base_m, 4) / 4;
  const double beta = 1.8751041 / arm.length_m, mass = arm.material.density_kg_m3 * area;
  const double normal = std::sqrt(bending * std::pow(beta, 4) * mass / 1e-4);
  const double rate = bending * std::pow(beta, 4) / normal;
  robot.effects.named.Set(ViscousDrag{normal, normal, 0, 0});
  arm.initial_mode1_tip_speed_m_s = 1e-3;
  const Plant plant(robot);
  // The speed dies at once; what it leaves, a small bend, creeps back.
  Simulation run(plant, For(2 / rate, 0.01 / rate));
  const auto tip = [&] {
    return run.state().pose[plant.ArmPose(0, plant.rods[0].element_count())].position.y();
  };
  ASSERT_TRUE(run.AdvanceTo(0.5 / rate).ok);
  const double early = tip();
  ASSERT_TRUE(run.AdvanceTo(1.5 / rate).ok);
  // 2 % for shear, axial stretch and the bend's first part: slenderness (r / L)^2 is 6e-4.
  EXPECT_NEAR(std::log(early / tip()), 1.0, 0.02);
}

TEST(ViscousDrag, ARunInACurrentSettlesWhereStaticsHasIt) {
  Robot robot = Cylinder(ClampedRoot{}, 10);
  robot.effects.viscosity = true;
  robot.effects.current_m_s = Vector3(0.1, 0.2, -0.1);
  const Plant plant(robot);
  const StaticsResult still = SolveStatics(plant, {});
  ASSERT_TRUE(still.ok);
  Simulation run(plant, For(30, 0.05));
  ASSERT_TRUE(run.Run().ok);
  const int tip = plant.ArmPose(0, 10);
  const Vector3 bend = still.state.pose[tip].position - Vector3(robot.arms[0].length_m, 0, 0);
  EXPECT_GT(bend.norm(), 0.01);
  EXPECT_LT((run.Observe().tips[0].position - still.state.pose[tip].position).norm(),
            1e-6 * bend.norm());
}

TEST(ViscousDrag, ReducedModelLosesThePowerThatThePlantAccounts) {
  Robot without = Cylinder(FreeRoot{}, 8);
  without.rigid_body = tests::PaperCone();
  Robot with = without;
  with.effects.named.Set(ViscousDrag{kTangential, kNormal, 0.3, 0.01});
  without.effects.named.Get<ViscousDrag>().reset();
  const tests::ReducedPair pair(with, without);
  const double power = pair.PlantPower({"viscous_drag.arm", "viscous_drag.root"});
  EXPECT_LT(power, -1e-3);
  EXPECT_NEAR(-pair.Added(pair.state).dot(pair.state.v), power, 1e-10 * std::abs(power));
}

}  // namespace
}  // namespace mantle::model
