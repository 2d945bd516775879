#include "model/validity.h"

#include <gtest/gtest.h>

#include <cmath>

#include "model/statics.h"
#include "tests/support/paper_robot.h"
#include "tests/support/runs.h"

namespace mantle::model {
namespace {

TEST(LobedBuckling, OfALongTubeIsTheRings) {
  // E t^3 / 4 R^3 for a tube whose ends hold nothing; the paper's mantle: 3 to 10 Pa.
  const Shell shell = MakeShell(tests::PaperMantle(), Water{}, Effects{});
  const LobedBuckling lobes = FindLobedBuckling(shell);
  EXPECT_NEAR(lobes.free_pa, 40e3 * std::pow(0.002 / 0.031, 3) / 4, 1e-9);
  EXPECT_NEAR(lobes.free_pa, 2.69, 0.01);
  EXPECT_NEAR(lobes.held_pa, 9.3, 0.1);
  EXPECT_EQ(lobes.held_lobes, 3);
  Mantle tube = tests::PaperMantle();
  tube.r0_m = tests::kMantleRadius;
  tube.theta0_rad = -M_PI / 2;
  tube.pieces = {{50.0, 0.0}};
  tube.stations_m.clear();
  const LobedBuckling longer = FindLobedBuckling(MakeShell(tube, Water{}, Effects{}));
  EXPECT_NEAR(longer.held_pa, longer.free_pa, 1e-3 * longer.free_pa);
  EXPECT_EQ(longer.held_lobes, 2);
}

TEST(LobedBuckling, WarnsOfAWorkingPressureAboveIt) {
  const LobedBuckling lobes{2.7, 9.3, 3};
  EXPECT_TRUE(LobedBucklingWarnings({lobes, 2.0, {}}).empty());
  const auto warnings = LobedBucklingWarnings({lobes, 325.0, {}});
  ASSERT_EQ(warnings.size(), 1u);
  EXPECT_NE(warnings[0].find("325 Pa"), std::string::npos);
}

TEST(LargestStrain, IsTheFibresOfABentAndStretchedArm) {
  Robot robot;
  robot.root = ClampedRoot{};
  Arm arm = tests::PaperArm(10);
  arm.radius_base_m = arm.radius_tip_m = 0.01;
  const Vector6 stiffness = SectionStiffness(arm.material, 1.0, 0.01);
  constexpr double kCurvature = 8.0;
  arm.points = {{"tip", arm.length_m,
                 (Vector6() << 0, 0, kCurvature * stiffness(2), 0, 0, 0).finished(),
                 LoadFrame::kBody, ConstantSchedule{1}}};
  robot.arms = {arm};
  const Plant plant(robot);
  const StaticsResult result = SolveStatics(plant, {});
  ASSERT_TRUE(result.ok) << result.reason;
  PlantInputs inputs;
  EvaluateInputs(plant, 0.0, false, &inputs);
  PlantWork work(plant);
  ASSERT_FALSE(EvaluateForces(plant, result.state, inputs, &work));
  const LargestStrain strain = FindLargestStrain(plant, work);
  EXPECT_EQ(strain.body, "arm");
  EXPECT_NEAR(strain.value, kCurvature * 0.01, 1e-9);
  EXPECT_TRUE(StrainWarnings(strain).empty());
  EXPECT_EQ(StrainWarnings({0.4, "arm", 0.1, {}}).size(), 1u);
}

TEST(Validity, RunsSayTheirLargestStrainAndPressureWithTheirTime) {
  // A tip couple that rises to 0.4 of strain at the edge and falls again, and a pulsed strip.
  Robot robot;
  robot.root = ClampedRoot{};
  Arm arm = tests::PaperArm(10);
  arm.radius_base_m = arm.radius_tip_m = 0.01;
  const Vector6 stiffness = SectionStiffness(arm.material, 1.0, 0.01);
  arm.points = {{"tip", arm.length_m, (Vector6() << 0, 0, 40.0 * stiffness(2), 0, 0, 0).finished(),
                 LoadFrame::kBody, TableSchedule{{0, 1, 2}, {0, 1, 0}}}};
  robot.arms = {arm};
  robot.mantle = tests::PaperMantle(32);
  robot.mantle->strips = {{"muscle", 0.025, 0.105, TableSchedule{{0, 1, 2}, {0, 160, 0}}}};
  robot.effects.viscosity = robot.effects.drag = robot.effects.added_mass = true;
  const Plant plant(robot);
  RunSettings settings = tests::Settings(Integrator::kSdirk2, 0.01, 2.0);
  settings.output_interval_s = 0.05;
  Simulation simulation(plant, settings);
  ASSERT_TRUE(simulation.AdvanceTo(0.5).ok);
  simulation.Observe();
  const std::string checkpoint = simulation.Checkpoint();
  const RunResult result = simulation.Run();
  ASSERT_TRUE(result.ok) << result.reason;
  EXPECT_EQ(result.largest_strain.body, "arm");
  EXPECT_GT(result.largest_strain.value, kLargeStrain);
  ASSERT_TRUE(result.largest_strain.time_s.has_value());
  EXPECT_GT(*result.largest_strain.time_s, 0.8);
  ASSERT_TRUE(result.lobed_buckling.has_value());
  EXPECT_NEAR(result.lobed_buckling->working_pa, 160.0, 1e-9);
  EXPECT_NEAR(*result.lobed_buckling->time_s, 1.0, 1e-9);
  ASSERT_EQ(result.warnings.size(), 2u);
  EXPECT_NE(result.warnings[0].find("arm: strain"), std::string::npos) << result.warnings[0];
  EXPECT_NE(result.warnings[1].find("160 Pa inward, t = 1 s"), std::string::npos)
      << result.warnings[1];
  // A resumed run says the same.
  Simulation resumed(plant, settings);
  resumed.Restore(checkpoint);
  EXPECT_EQ(resumed.Run().warnings, result.warnings);
}

TEST(Validity, AMantleIsNotTurnedInsideOut) {
  // Pulled by its lip through its own apex: no solid does this, and statics must end before.
  Robot robot;
  robot.root = ClampedRoot{};
  robot.mantle = tests::PaperMantle(32);
  robot.effects.normal_pressure = NormalPressure{ConstantSchedule{-5000.0}};
  StaticsSettings settings;
  settings.arc_length = true;
  settings.stop_at_limit = false;
  const StaticsResult result = SolveStatics(Plant(robot), settings);
  for (const StaticsPoint& point : result.path) EXPECT_GT(point.volume_m3, 0.0);
}

}  // namespace
}  // namespace mantle::model
