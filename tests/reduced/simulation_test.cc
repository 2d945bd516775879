#include "reduced/build/simulation.h"

#include <gtest/gtest.h>

#include "tests/reduced/reduced_robots.h"

namespace mantle::reduced {
namespace {

TEST(ReducedSimulation, StartsInTheFrameOfTheCurrentAsThePlant) {
  model::Robot robot = tests::ControlRobot(8, 24);
  robot.effects.current_m_s = model::Vector3(0.1, -0.05, 0.2);
  robot.root_twist << 0.3, -0.2, 0.1, 0.05, 0.02, -0.01;
  robot.root_pose.rotation = Eigen::Quaterniond(Eigen::AngleAxisd(0.7, model::Vector3::UnitY()));
  const ReducedPlant model(robot, {});
  ReducedSimulation reduced(model, {});
  model::Simulation plant(model.plant, {});
  constexpr double kRoundOff = 1e-14;
  const model::Sample r = reduced.Observe(), f = plant.Observe();
  EXPECT_LT((r.root_twist - f.root_twist).norm(), kRoundOff);
  EXPECT_LT((r.root_twist - robot.root_twist).norm(), kRoundOff) << "the earth's, not the water's";
  EXPECT_LT((r.tip_twists[0] - f.tip_twists[0]).norm(), kRoundOff);
}

TEST(ReducedSimulation, StartsWithTheArmsInitialMotionProjected) {
  model::Robot robot;
  robot.name = "arm";
  robot.root = model::ClampedRoot{};
  robot.arms = {tests::PaperArm(40)};
  robot.arms[0].initial_mode1_tip_speed_m_s = 0.1;
  Reduction r;
  r.arms[0].segments = 8;
  r.arms[0].strains = kSixStrains;
  const ReducedPlant model(robot, r);
  ReducedSimulation reduced(model, {});
  model::Simulation plant(model.plant, {});
  constexpr double kProjection = 0.02;  // eight segments hold the mode's curvature to 1 %
  EXPECT_LT((reduced.Observe().tip_twists[0] - plant.Observe().tip_twists[0]).tail<3>().norm(),
            kProjection * 0.1);
}

TEST(ReducedSimulation, SaysByHowMuchItsCoordinatesMissTheStart) {
  model::Robot robot;
  robot.name = "arm";
  robot.root = model::ClampedRoot{};
  robot.arms = {tests::PaperArm(16)};
  model::Vector6 twisted = model::Vector6::Unit(3);
  twisted(0) = 2.0;  // rad/m: 0.84 rad at the tip
  robot.arms[0].initial_strain = model::StrainTable{{0.0}, {twisted}};
  const auto warnings = [&](const StrainChoice& strains) {
    Reduction r;
    r.arms[0].segments = 4;
    r.arms[0].strains = strains;
    const ReducedPlant model(robot, r);
    ReducedRunSettings settings;
    settings.duration_s = settings.step_s = settings.output_interval_s = 1e-3;
    return ReducedSimulation(model, settings).Run().warnings;
  };
  EXPECT_TRUE(warnings(kBendingTorsion).empty());
  const std::vector<std::string> missed = warnings(kBending);
  ASSERT_EQ(missed.size(), 1U);
  EXPECT_NE(missed[0].find("and 0.84 rad, bounds"), std::string::npos) << missed[0];
}

TEST(ReducedSimulation, StartsWithTheMantlesInitialMotionProjected) {
  model::Robot robot = tests::ControlRobot(8, 24);
  robot.arms.clear();
  robot.mantle->initial_radial_speed_m_s = 0.01;
  const ReducedPlant model(robot, {});
  ReducedSimulation reduced(model, {});
  const int at = model.mantle_first();
  // s_dot = Phi^T M v, written out
  model::VectorX expected = model::VectorX::Zero(model.mantle->size);
  for (int j = 1; j < model.plant.shape_count(); ++j) {
    expected += model.mantle->basis.shapes.row(3 * j).transpose() *
                (model.plant.shell->nodes[j].inertia(0) * 0.01);
  }
  EXPECT_GT(expected.norm(), 0.0);
  EXPECT_LT((reduced.state().v.segment(6 + at, model.mantle->size) - expected).norm(),
            1e-13 * expected.norm());  // round-off
}

TEST(ReducedSimulation, AtRestStartsFromExactZeros) {
  const ReducedPlant model(tests::ControlRobot(8, 24), {});
  ReducedSimulation reduced(model, {});
  EXPECT_TRUE(reduced.state().q.isZero(0.0));
  EXPECT_TRUE(reduced.state().v.isZero(0.0));
}

TEST(ReducedSimulation, StepsEndAtBreakPoints) {
  model::Robot robot = tests::ControlRobot(8, 24);
  robot.mantle->strips = {
      tests::PaperStrip(model::TriangularSchedule{0.0, 200.0, 0.66, 0.0})};  // breaks at 0.33 k s
  const ReducedPlant model(robot, {});
  ReducedRunSettings settings;
  settings.duration_s = 0.7;
  settings.step_s = 0.25;
  settings.output_interval_s = 0.7;
  ReducedSimulation simulation(model, settings);
  const model::RunResult result = simulation.Run();
  ASSERT_TRUE(result.ok) << result.reason;
  // [0, 0.33] and [0.33, 0.66] in two steps each, [0.66, 0.7] in one
  EXPECT_EQ(result.counters.rejected, 0);
  EXPECT_EQ(result.counters.steps, 5);
  EXPECT_DOUBLE_EQ(result.sim_time_s, 0.7);
}

TEST(ReducedSimulation, JetThatRanAwayStopsTheRun) {
  model::Robot robot = tests::ControlRobot(8, 24);
  robot.mantle->strips = {tests::PaperStrip(model::TriangularSchedule{0.0, 325.0, 0.66, 0.0})};
  robot.effects.jet_thrust->runaway_n = 1e-3;  // the pulse's thrust is 0.1 N
  const ReducedPlant model(robot, {});
  ReducedRunSettings settings;
  settings.duration_s = 0.3;
  ReducedSimulation simulation(model, settings);
  const model::RunResult result = simulation.Run();
  EXPECT_FALSE(result.ok);
  EXPECT_NE(result.reason.find("jet_thrust ran away"), std::string::npos) << result.reason;
  EXPECT_LT(result.sim_time_s, 0.3);
}

TEST(ReducedSimulation, FailureNamesTimeBodyAndCause) {
  model::Robot robot = tests::ControlRobot(8, 24);
  robot.mantle->strips = {tests::PaperStrip(model::ConstantSchedule{5e4})};  // 100 collapses
  robot.effects.jet_thrust.reset();  // its run-away would come first
  const ReducedPlant model(robot, {});
  ReducedRunSettings settings;
  settings.duration_s = 1.0;
  ReducedSimulation simulation(model, settings);
  const model::RunResult result = simulation.Run();
  EXPECT_FALSE(result.ok);
  EXPECT_EQ(result.reason.rfind("t = ", 0), 0u) << result.reason;
  EXPECT_GT(result.counters.rejected, 0);
  EXPECT_TRUE(simulation.state().q.allFinite());
}

TEST(ReducedSimulation, RefusesMoreSegmentsThanThePlantTellsApart) {
  Reduction r;
  r.arms[0].segments = 9;
  const ReducedPlant model(tests::ControlRobot(8, 24), r);
  try {
    ReducedSimulation(model, {});
    ADD_FAILURE() << "accepted";
  } catch (const model::BadRobot& error) {
    EXPECT_NE(std::string(error.what())
                  .find("reduced.arms.arm: 36 strain coordinates; the plant's 8 elements"),
              std::string::npos)
        << error.what();
  }
}

}  // namespace
}  // namespace mantle::reduced
