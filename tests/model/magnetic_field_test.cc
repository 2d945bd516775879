#include "model/effects/magnetic_field.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "model/simulation.h"
#include "model/statics.h"
#include "tests/support/gradient_checker.h"
#include "tests/support/paper_robot.h"
#include "tests/support/random_values.h"
#include "tests/support/reduced_pair.h"

namespace mantle::model {
namespace {

constexpr double kRoundOff = 1e-12;    // relative, sums of some tens of terms
constexpr double kDifferences = 1e-8;  // fourth-order differences with step 1e-3 of the scale

Robot Magnetic(Robot robot, const Vector3& field, const Vector3& root, const Vector3& arm) {
  robot.effects.named.Set(MagneticField{field, root, arm});
  return robot;
}

TEST(MagneticLoad, TorqueIsMomentTimesFieldWhateverTheFrame) {
  tests::RandomValues random(1);
  for (int i = 0; i < 10; ++i) {
    const SectionMotion motion{random.AnyPose(1).rotation, random.Twist(1, 1)};
    const MagneticTorque load{random.Cube(), random.Cube()};
    const Vector3 world = motion.rotation * Vector3(load.Torque(motion).head<3>());
    const Vector3 expected = (motion.rotation * load.moment).cross(load.field_t);
    EXPECT_LT((world - expected).norm(), kRoundOff);
    EXPECT_EQ(load.Torque(motion).tail<3>(), Vector3::Zero());
  }
}

TEST(MagneticLoad, TangentsMatchDifferences) {
  tests::RandomValues random(2);
  for (int i = 0; i < 5; ++i) {
    const SectionMotion motion{random.AnyPose(1).rotation, Vector6::Zero()};
    const MagneticTorque load{random.Cube(), random.Cube()};
    const auto by_rotation = [&](const Eigen::VectorXd& zeta) -> Eigen::VectorXd {
      return load.Torque({motion.rotation * ExpSO3(zeta), motion.twist}).head<3>();
    };
    EXPECT_TRUE(
        tests::JacobianMatches(load.TorqueByRotation(motion),
                               tests::DifferenceJacobian(by_rotation, Eigen::VectorXd::Zero(3),
                                                         Eigen::VectorXd::Constant(3, 1e-3)),
                               kDifferences, kDifferences));
  }
}

TEST(MagneticLoad, CompassNeedleSwingsAtItsFrequency) {  // J angle'' = -m B sin(angle)
  constexpr double kMoment = 0.1, kField = 0.01, kInertia = 1e-5, kRate = 1e-2;
  constexpr double kTolerance = 1e-4;  // steps of 1/600 of the period, second order
  Robot robot;
  robot.name = "needle";
  robot.rigid_body =
      RigidBody{"body", GivenInertia{0.1, Vector3::Zero(), kInertia * Matrix3::Identity(), 1e-4}};
  robot.root_twist(2) = kRate;
  const double omega = std::sqrt(kMoment * kField / kInertia);
  const double quarter = 0.5 * std::numbers::pi / omega;
  const Plant plant(Magnetic(robot, Vector3(kField, 0, 0), Vector3(kMoment, 0, 0), {0, 0, 0}));
  RunSettings settings;
  settings.duration_s = settings.output_interval_s = quarter;
  settings.step_s = quarter / 150;
  Simulation run(plant, settings);
  const RunResult result = run.Run();
  ASSERT_TRUE(result.ok) << result.reason;
  const double angle = LogSO3(run.state().pose[0].rotation).z();
  EXPECT_NEAR(angle, kRate / omega, kTolerance * kRate / omega);
  EXPECT_NEAR(run.state().velocity(2), 0.0, kTolerance * kRate);
  // All of the kinetic energy has gone into the field's work, under its own name.
  ASSERT_EQ(result.work_names, std::vector<std::string>{"magnetic.root"});
  const double kinetic = 0.5 * kInertia * kRate * kRate;
  EXPECT_NEAR(result.work_j[0], -kinetic, kTolerance * kinetic);
}

TEST(MagneticLoad, RodBendsAsUnderAUniformTorquePerLength) {  // EI angle' = m B (L - x)
  Robot robot;
  robot.name = "rod";
  robot.root = ClampedRoot{};
  Arm arm = tests::PaperArm(80);
  arm.mount = Pose::Identity();
  arm.radius_base_m = arm.radius_tip_m = 0.01;
  robot.arms = {arm};
  const double bending =
      arm.material.young_pa * std::numbers::pi * std::pow(arm.radius_base_m, 4) / 4;
  const double length = arm.length_m, torque = 2e-3 * bending / (length * length);  // tip: 1e-3 rad
  constexpr double kTolerance = 2e-4;  // midpoints of 80 elements: 1/80^2 / 2
  const Plant plant(Magnetic(robot, Vector3(0, 0.02, 0), {0, 0, 0}, Vector3(torque / 0.02, 0, 0)));
  const StaticsResult result = SolveStatics(plant, {});
  ASSERT_TRUE(result.ok);
  const Pose tip = result.state.pose[plant.ArmPose(0, arm.elements)];
  const double angle = torque * length * length / (2 * bending);
  const double deflection = torque * std::pow(length, 3) / (3 * bending);
  EXPECT_NEAR(LogSO3(tip.rotation).z(), angle, kTolerance * angle);
  EXPECT_NEAR(tip.position.y(), deflection, kTolerance * deflection);
}

// A free star of arm and cone in a field, and the same without.
Robot Star(double field) {
  Robot robot;
  robot.name = "star";
  robot.arms = {tests::PaperArm(8)};
  robot.rigid_body = tests::PaperCone();
  return Magnetic(robot, field * Vector3(1, -2, 3), Vector3(0.3, 0.1, -0.2),
                  Vector3(0.2, -0.1, 0.4));
}

TEST(MagneticLoad, ReducedModelFeelsThePowerThatThePlantAccounts) {
  const tests::ReducedPair pair(Star(0.01), Star(0));
  const double power = pair.PlantPower({"magnetic.arm", "magnetic.root"});
  EXPECT_NEAR(-pair.Added(pair.state).dot(pair.state.v), power, 1e-10 * std::abs(power));
  EXPECT_GT(std::abs(power), 1e-6);
}

TEST(MagneticLoad, ReducedStiffnessMatchesDifferences) {
  const tests::ReducedPair pair(Star(0.01), Star(0));
  const int n = pair.with.velocity_count();
  Eigen::MatrixXd stiffness[2];
  const reduced::ReducedPlant* models[2] = {&pair.without, &pair.with};
  for (int i = 0; i < 2; ++i) {
    PlantInputs inputs;
    EvaluateInputs(*models[i], 0.0, false, &inputs);
    reduced::ReducedWork work(*models[i]);
    reduced::ReducedJacobians jacobians(*models[i]);
    const VectorX rest = VectorX::Zero(n);
    ASSERT_FALSE(EvaluateResidual(*models[i], pair.state, rest, inputs, &work));
    Linearise(*models[i], pair.state, rest, inputs, false, &work, &jacobians);
    stiffness[i] = jacobians.stiffness;
  }
  const auto moved = [&](const Eigen::VectorXd& by) -> Eigen::VectorXd {
    reduced::ReducedState s = pair.state;
    s.root = s.root * ExpSE3(Vector6(by.head<6>()));
    s.q += by.tail(n - 6);
    return pair.Added(s);
  };
  EXPECT_TRUE(tests::JacobianMatches(stiffness[1] - stiffness[0],
                                     tests::DifferenceJacobian(moved, Eigen::VectorXd::Zero(n),
                                                               Eigen::VectorXd::Constant(n, 1e-3)),
                                     kDifferences, 1e-9));
}

}  // namespace
}  // namespace mantle::model
