#include "model/energy.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <string>

#include "model/observation.h"
#include "tests/support/paper_robot.h"
#include "tests/support/runs.h"

/// Energies, works and momentum are the earth's; their figures name what they are relative to.

namespace mantle::model {
namespace {

using tests::CompleteRun;
using tests::Settings;

// A swimmer on which everything external works: weight, buoyancy, drag, jet, loads of both frames.
Robot Swimmer() {
  Robot robot = tests::PaperRobot(6, 24);
  robot.effects = tests::EveryEffect();
  robot.effects.jet_thrust->place = ThrustPlace::kDome;
  robot.arms[0].material.density_kg_m3 = 1100;
  robot.rigid_body->shape = Cone{0.015, 0.112, 1300.0};
  robot.mantle->strips = {{"pulse", 0.025, 0.105, TriangularSchedule{0, 200, 0.66, 0}}};
  robot.arms[0].distributed = {
      {"torque", Vector6::Unit(2), 0.05, 0, LoadFrame::kBody, ConstantSchedule{1}},
      {"pull", 0.1 * Vector6::Unit(4), 1, 1, LoadFrame::kWorld, ConstantSchedule{1}}};
  robot.arms[0].points = {
      {"tip", 0.42, 0.02 * Vector6::Unit(4), LoadFrame::kBody, ConstantSchedule{1}},
      {"root", 0.0, 0.02 * Vector6::Unit(3), LoadFrame::kWorld, ConstantSchedule{1}}};
  return robot;
}

const Vector3 kCurrent(0.2, -0.1, 0.3);

TEST(Energies, AreTheEarthsUnderACurrent) {
  // Swimming in still water, seen from a carriage that moves at -c, is swimming in a current c.
  const double duration = 0.1;
  const Robot still = Swimmer();
  Robot carried = still;
  carried.effects.current_m_s = kCurrent;
  carried.root_twist.tail<3>() = kCurrent;
  const RunSettings settings = Settings(Integrator::kSdirk2, 0.005, duration);
  const RunResult a = CompleteRun(still, settings), b = CompleteRun(carried, settings);
  const Plant plant(still);
  const SolidMotion solid = EvaluateSolidMotion(plant, InitialState(plant), PlantWork(plant));
  const Vector3 impulse = a.last.momentum.tail<3>();
  constexpr double kRoundOff = 1e-11;
  EXPECT_GT(impulse.norm(), 1e-3);
  EXPECT_LT((b.last.momentum.tail<3>() - impulse - solid.mass_kg * kCurrent).norm(), kRoundOff);
  const Vector3 spin = a.last.momentum.head<3>() + duration * kCurrent.cross(impulse) +
                       solid.mass_kg * a.last.centre_of_mass_m.cross(kCurrent);
  EXPECT_LT((b.last.momentum.head<3>() - spin).norm(), kRoundOff);
  EXPECT_NEAR(b.last.energies.total(),
              a.last.energies.total() + kCurrent.dot(impulse) +
                  0.5 * solid.mass_kg * kCurrent.squaredNorm(),
              kRoundOff);
  // All works together gain c . impulse, each external one, none that is internal.
  double gained = 0;
  ASSERT_EQ(a.work_names, b.work_names);
  for (std::size_t i = 0; i < a.work_j.size(); ++i) {
    const double more = b.work_j[i] - a.work_j[i];
    gained += more;
    const std::string& name = a.work_names[i];
    const bool internal =
        name.starts_with("strip") || name == "distributed.arm.torque" || name == "roll_drag";
    if (internal) {
      EXPECT_NEAR(more, 0.0, 1e-9) << name;
    } else {
      EXPECT_GT(std::abs(more), 1e-7) << name;
    }
  }
  EXPECT_NEAR(gained, kCurrent.dot(impulse), 3e-5 * std::abs(kCurrent.dot(impulse)))
      << "to the step's error";
  EXPECT_LT((a.last.root_acceleration - b.last.root_acceleration).norm(),
            1e-9 + (a.last.root_twist.head<3>().cross(kCurrent)).norm());
}

TEST(Energies, BalanceClosesInACurrentForEveryRoot) {
  Robot swimmer = Swimmer();
  swimmer.effects.current_m_s = kCurrent;
  PrescribedRoot moved;
  moved.y_m = SineSchedule{0.02, 2, 0, 0, 0};
  moved.angle_rad = SineSchedule{0.2, 1, 0, 0, 0};
  for (const RootMotion& root :
       {RootMotion(FreeRoot{}), RootMotion(ClampedRoot{}), RootMotion(moved)}) {
    swimmer.root = root;
    const RunResult coarse = CompleteRun(swimmer, Settings(Integrator::kSdirk2, 0.004, 0.1));
    const RunResult fine = CompleteRun(swimmer, Settings(Integrator::kSdirk2, 0.002, 0.1));
    EXPECT_LT(coarse.power_balance_residual, 1e-10) << root.index();
    EXPECT_GT(coarse.power_balance_residual, 0.0);
    constexpr double kStepError = 3e-4;  // loads that start at once leave fast layers unresolved
    EXPECT_LT(fine.energy_drift, kStepError) << root.index();
  }
}

TEST(Energies, NothingWorksOnABodyHeldStillInAStream) {
  // A rod settled across a stream is at rest: no load works on it, and no support.
  Robot robot;
  robot.name = "rod";
  robot.root = ClampedRoot{};
  robot.arms = {tests::PaperArm(6)};
  robot.arms[0].mount = Pose::Identity();
  robot.arms[0].material.young_pa = 1e6;
  robot.arms[0].material.viscosity_pa_s = 3e4;  // creeps to rest within a second
  robot.effects.drag = robot.effects.added_mass = robot.effects.viscosity = true;
  robot.effects.current_m_s = Vector3(0, 0.1, 0);
  const Plant plant(robot);
  Simulation simulation(plant, Settings(Integrator::kSdirk2, 0.02, 6.0));
  ASSERT_TRUE(simulation.AdvanceTo(4.0).ok);
  const std::vector<double> before = simulation.energy().work_j();
  ASSERT_TRUE(simulation.AdvanceTo(6.0).ok);
  const std::vector<double> after = simulation.energy().work_j();
  const Sample s = simulation.Observe();
  EXPECT_GT(s.energies.elastic_arms_j, 1e-6);
  for (std::size_t i = 0; i < after.size(); ++i) {
    EXPECT_LT(std::abs(after[i] - before[i]), 1e-3 * s.energies.elastic_arms_j)
        << simulation.energy().names()[i];
  }
  EXPECT_NEAR(s.energies.kinetic_solid_j, 0.0, 1e-12);
  EXPECT_LT(s.momentum.tail<3>().y(), -1e-3) << "it keeps that water from flowing";
}

TEST(Energies, MomentumInACurrentChangesByTheExternalForceAlone) {
  Robot robot = tests::PaperRobot(6, 24);
  robot.effects.weight = robot.effects.added_mass = true;
  robot.effects.lateral_added_mass = true;
  robot.effects.current_m_s = kCurrent;
  robot.root_twist << 0.4, -0.3, 0.5, 0.1, 0, 0;
  const Plant plant(robot);
  const auto error_of = [&](double step) {
    Simulation simulation(plant, Settings(Integrator::kSdirk3, step, 0.1));
    const Vector3 start = simulation.Observe().momentum.tail<3>();
    EXPECT_TRUE(simulation.AdvanceTo(0.1).ok);
    const Vector3 end = simulation.Observe().momentum.tail<3>();
    const double mass = EvaluateSolidMotion(plant, simulation.state(), PlantWork(plant)).mass_kg;
    const double error = (end - start - 0.1 * mass * robot.effects.gravity_m_s2).norm();
    return error;
  };
  // Of 0.2 N s, and at the integrator's order.
  const double coarse = error_of(0.002), fine = error_of(0.0005);
  EXPECT_LT(coarse, 1e-5);
  EXPECT_LT(fine, coarse / 24.0);  // 64 for the third order; stages resolve the stiff part less
}

TEST(Headlines, BalanceOfASpinningStarIsNotRelativeToNothing) {
  // Eight arms spun at 5 rad/s in ideal fluid: all powers vanish by symmetry but for round-off.
  Robot robot;
  robot.name = "star";
  robot.rigid_body =
      RigidBody{"hub", GivenInertia{0.2, Vector3::Zero(), 1e-4 * Matrix3::Identity(), 1.957e-4}};
  for (int i = 0; i < 8; ++i) {
    Arm arm = tests::PaperArm(6);
    arm.name = "arm" + std::to_string(i);
    arm.length_m = 0.2;
    arm.radius_base_m = 0.006;
    arm.radius_tip_m = 0.0025;
    arm.mount.rotation = ExpSO3(i * std::numbers::pi / 4 * Vector3::UnitZ());
    arm.mount.position = arm.mount.rotation * Vector3(0.03, 0, 0);
    robot.arms.push_back(arm);
  }
  robot.effects.added_mass = true;
  robot.root_twist(2) = 5.0;
  const RunResult result = CompleteRun(robot, Settings(Integrator::kSdirk3, 0.002, 0.05));
  EXPECT_LT(result.power_balance_residual, 1e-12);
  EXPECT_GT(result.power_balance_scale_w, 1e-3) << "of the star's energy over the run";
  EXPECT_TRUE(result.warnings.empty());
}

TEST(Headlines, AMotionThatTheStepsDoNotResolveIsWarnedOf) {
  Robot robot;
  robot.name = "arm";
  robot.root = ClampedRoot{};
  robot.arms = {tests::PaperArm(6)};
  robot.arms[0].initial_mode1_tip_speed_m_s = 0.5;
  const RunResult lost = CompleteRun(robot, Settings(Integrator::kBackwardEuler, 0.1, 2.0));
  EXPECT_GT(lost.energy_drift, 0.5);
  ASSERT_EQ(lost.warnings.size(), 1u);
  const std::string& warning = lost.warnings[0];
  for (const char* part : {"energy_drift = ", "bound 0.05", " J (", "halve time.step = 0.1 s"}) {
    EXPECT_NE(warning.find(part), std::string::npos) << part << " in: " << warning;
  }
  const RunResult kept = CompleteRun(robot, Settings(Integrator::kSdirk3, 0.002, 0.2));
  EXPECT_TRUE(kept.warnings.empty()) << kept.warnings[0];
}

TEST(Headlines, RunAwayNamesACureThatIsNotYetApplied) {
  Robot robot = tests::PaperRobot(4, 24);
  robot.effects.jet_thrust = JetThrust{};
  const auto reason = [&](FluxReading flux, ThrustPlace place) {
    robot.effects.jet_thrust->flux = flux;
    robot.effects.jet_thrust->place = place;
    return JudgeThrust(Plant(robot), 1.0, 10.5).reason;
  };
  const std::string open = reason(FluxReading::kVolume, ThrustPlace::kUniform);
  EXPECT_NE(open.find("flux = \"radial\" or place = \"dome\""), std::string::npos) << open;
  for (const auto& [flux, place] : {std::pair(FluxReading::kRadial, ThrustPlace::kUniform),
                                    std::pair(FluxReading::kVolume, ThrustPlace::kDome),
                                    std::pair(FluxReading::kRadial, ThrustPlace::kDome)}) {
    const std::string cured = reason(flux, place);
    EXPECT_EQ(cured.find("radial"), std::string::npos) << cured;
    EXPECT_NE(cured.find("lower the pressure"), std::string::npos) << cured;
  }
}

TEST(Headlines, AValueJustBeyondItsBoundIsPrintedSo) {
  const EvaluationFailure failure{"arm", 3, "turned too far", 2.8 + 1e-9, 2.8, "element", "refine"};
  EXPECT_EQ(failure.Message(), "arm: element 3: turned too far: 2.800000001, bound 2.8; refine");
  EXPECT_EQ((EvaluationFailure{"robot", -1, "not finite", 1.0, 0.0}).Message(),
            "robot: not finite: 1, bound 0");
}

}  // namespace
}  // namespace mantle::model
