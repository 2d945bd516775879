#include <gtest/gtest.h>

#include <algorithm>

#include "tests/support/paths.h"
#include "tests/tools/program.h"

namespace mantle::testing_tools {
namespace {

TEST(MantleCheck, SaysWhatIsActiveAndWhatItCosts) {
  const auto folder = FreshFolder("check");
  const Outcome outcome = Mantle(folder, "check --json " + Scene("paper"));
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  const auto report = nlohmann::json::parse(outcome.out);
  EXPECT_EQ(report["root"], "free");
  EXPECT_EQ(report["settings"]["unknowns"], 6 + 6 * 20 + 3 * 65);
  EXPECT_EQ(report["stages"], 2);
  EXPECT_EQ(report["loads"], nlohmann::json::array({"arm.bend_z", "arm.bend_y", "mantle.muscle"}));
  EXPECT_GT(report["us_per_step"], 0.0);
  EXPECT_GT(report["estimated_wall_time_s"], 0.0);
  EXPECT_TRUE(std::filesystem::is_empty(folder)) << "check writes nothing";
}

TEST(MantleCheck, ExplicitStepsHaveALimit) {
  const auto folder = FreshFolder("check_explicit");
  const Outcome outcome = Mantle(
      folder, "check --json " + Scene("arm_dynamic") +
                  " --set time.integrator=rk4 --set time.step=2e-5 --set time.duration=0.01");
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  const double limit = nlohmann::json::parse(outcome.out)["explicit_step_limit_s"];
  EXPECT_GT(limit, 2e-5);
  EXPECT_LT(limit, 1e-3);
}

TEST(MantleCheck, TakesEveryShippedScene) {
  const auto folder = FreshFolder("check_all");
  int count = 0;
  for (const auto& entry : std::filesystem::directory_iterator(tests::SourcePath("scenes"))) {
    if (entry.path().extension() != ".toml") continue;
    ++count;
    const Outcome outcome = Mantle(folder, "check --json '" + entry.path().string() + "'");
    EXPECT_EQ(outcome.status, 0) << entry.path() << ": " << outcome.err;
    if (outcome.status != 0) continue;
    const auto report = nlohmann::json::parse(outcome.out);
    if (report.contains("failure")) {
      EXPECT_TRUE(report["failure"].is_null()) << entry.path() << ": " << report["failure"];
    }
  }
  EXPECT_GE(count, 24);
}

TEST(MantleCheck, RefusesWhateverARunRefuses) {
  const auto folder = FreshFolder("check_as_run");
  std::ofstream(folder / "free.toml") << "[rigid_body]\ncone = { radius = 1, height = 1, density = "
                                         "1 }\n[statics]\n";
  const std::vector<std::string> bad = {
      Scene("reach") + " --set drives.bus=nonsense",
      Scene("reach") + " --set drives.bus=can:no_such_bus",
      Scene("reach") + " --set drives.bus=udp:1.2.3.4:1",
      Scene("reach") + " --set control.period=0.015",
      Scene("reach") + " --set control.period=0.001",
      Scene("reach") + " --set drives.period=0.0105",
      Scene("reach") + " --set drives.cable_stiffness=1e9",
      Scene("reach") + " --set 'reduced.segment_ends=[0.1, 0.1, 0.42]'",
      Scene("reach") + " --set robot.coupling=frozen",
      Scene("reach") + " --set arms.arm.elements=1",
      Scene("arm_dynamic") + " --set time.integrator=rk4",
      Scene("arm_dynamic") + " --set time.integrator=rk4 --set arms.arm.length=1e-200",
      Scene("arm_vibration") + " --set arms.0.initial_mode1_tip_speed=1e200",
      Scene("paper") + " --set mantle.elements=3",
      Scene("paper") + " --model reduced --set reduced.modes=8",
      Scene("paper") + " --set mismatch.drag=1.2",
      Scene("paper") + " --set extends=absent.toml",
      Scene("paper") + " --set extends=3",
      "free.toml",
  };
  for (const std::string& arguments : bad) {
    SCOPED_TRACE(arguments);
    const bool statics = arguments == "free.toml";
    const Outcome check = Mantle(folder, "check " + arguments);
    const Outcome run = Mantle(folder, (statics ? "static " : "run ") + arguments + " --out out");
    EXPECT_EQ(run.status, 2);
    EXPECT_EQ(check.status, 2);
    EXPECT_EQ(check.err, run.err);
    EXPECT_EQ(std::count(check.err.begin(), check.err.end(), '\n'), 1) << check.err;
    EXPECT_FALSE(std::filesystem::exists(folder / "out"));
  }
}

TEST(MantleCheck, ATipSpeedThatCannotBeGivenIsNamed) {
  const auto folder = FreshFolder("check_tip_speed");
  const Outcome outcome =
      Mantle(folder, "check " + Scene("arm_vibration") + " --set arms.0.material.young=1e-300");
  EXPECT_EQ(outcome.status, 2);
  EXPECT_NE(outcome.err.find("initial_mode1_tip_speed"), std::string::npos) << outcome.err;
}

/// Warnings of a closed loop.
std::vector<std::string> ControlWarnings(const std::string& arguments) {
  const Outcome outcome = Mantle(FreshFolder("check_control"), "check --json " + arguments);
  EXPECT_EQ(outcome.status, 0) << outcome.err;
  std::vector<std::string> warnings;
  const auto report = nlohmann::json::parse(outcome.out);
  for (const auto& w : report.at("warnings")) {
    if (w.get<std::string>().starts_with("control.")) warnings.push_back(w);
  }
  return warnings;
}

TEST(MantleCheck, WarnsWithFiguresOfGoalsThatCannotBeMeant) {
  struct {
    std::string arguments, words;
  } const cases[] = {
      {Scene("steer") + " --set control.cost.position=0 --set control.cost.heading=0 --set "
                        "control.cost.turn_rate=0",
       "every weight of the state is zero"},
      {Scene("steer") + " --set control.cost.tip=3", "does not look at tip = 3"},
      {Scene("reach") + " --set control.cost.position=7", "does not look at position = 7"},
      {Scene("steer") +
           " --set 'control.goal.waypoints=[{at=[0,0,0.5]},{at=[0,0,0]},{at=[0,0,0.5]}]'",
       "the path has a cusp"},
      {Scene("steer") +
           " --set 'control.goal.waypoints=[{at=[0,0,0.3]},{at=[0.1,0,0.35]},{at=[0.1,0,0]}]'",
       "tighter than the vehicle turns"},
      {Scene("reach"), "the reference starts 65 mm from the tip"},
      {Scene("steer") + " --set control.grid.steps=10 --set 'control.grid.knots=[1,2,5,10]'",
       "the horizon of 0.5 s is shorter than a pulse of the gait, 0.8 s"},
  };
  for (const auto& c : cases) {
    const std::vector<std::string> warnings = ControlWarnings(c.arguments);
    EXPECT_TRUE(
        std::any_of(warnings.begin(), warnings.end(),
                    [&](const std::string& w) { return w.find(c.words) != std::string::npos; }))
        << c.words << (warnings.empty() ? "" : "; " + warnings[0]);
  }
  EXPECT_EQ(ControlWarnings(Scene("steer")), std::vector<std::string>{});
}

TEST(MantleCheck, WritesASceneThatChecksAndRunsTheSame) {
  const auto folder = FreshFolder("check_write");
  const std::string set = " --set mismatch.young=1.1";
  const Outcome written = Mantle(folder, "check --write " + Scene("reach_noise") + set);
  ASSERT_EQ(written.status, 0) << written.err;
  EXPECT_EQ(written.out.find("extends"), std::string::npos);
  EXPECT_NE(written.out.find("young = 1.1"), std::string::npos);
  std::ofstream(folder / "reach_noise.toml") << written.out;
  const Outcome again = Mantle(folder, "check --write reach_noise.toml");
  EXPECT_EQ(again.out, written.out);
  const std::string run = " --set time.duration=0.1 --out ";
  ASSERT_EQ(Mantle(folder, "run " + Scene("reach_noise") + set + run + "a").status, 0);
  ASSERT_EQ(Mantle(folder, "run reach_noise.toml" + run + "b").status, 0);
  EXPECT_EQ(ReadFile(folder / "a/trajectory.csv"), ReadFile(folder / "b/trajectory.csv"));
}

TEST(MantleCheck, SceneFilesHaveAnyNameAndBoundedDepth) {
  const auto folder = FreshFolder("check_names");
  std::filesystem::copy_file(tests::SourcePath("scenes/arm_static.toml"), folder / "my scene.toml");
  EXPECT_EQ(Mantle(folder, "check 'my scene.toml'").status, 0);
  std::string key = "a";
  for (int i = 0; i < 50000; ++i) key += ".a";
  std::ofstream(folder / "deep.toml") << key << " = 1\n";
  std::ofstream(folder / "latin.toml") << "description = \"\xe9t\xe9\"\n";
  std::ofstream(folder / "nan.toml")
      << "[[arms]]\nlength = 1\nradius = 0.01\nmaterial = { young = 1, density = 1 }\n"
         "points = [{ force = \"nan m\" }]\n";
  for (const char* file : {"deep.toml", "latin.toml", "nan.toml", "/dev/zero"}) {
    const Outcome outcome = Mantle(folder, std::string("check ") + file);
    EXPECT_EQ(outcome.status, 2) << file;
    EXPECT_EQ(std::count(outcome.err.begin(), outcome.err.end(), '\n'), 1) << outcome.err;
    EXPECT_LT(outcome.err.size(), 300u) << outcome.err;
  }
}

}  // namespace
}  // namespace mantle::testing_tools
