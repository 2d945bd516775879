#include <gtest/gtest.h>

#include "loop/scene/scene.h"
#include "tests/support/paths.h"
#include "tests/tools/program.h"

namespace mantle::testing_tools {
namespace {

// The arm alone, for half a second: a run takes some hundredths of one.
const std::string kShort = Scene("reach") + " --set time.duration=0.5";

TEST(MantleTune, WritesTablesThatASceneTakesAndThatCostWhatItSays) {
  const auto folder = FreshFolder("tune");
  const Outcome outcome =
      Mantle(folder, "tune " + kShort + " --evaluations 12 --controller pid --json --out tuned");
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  const auto pid = nlohmann::json::parse(outcome.out)["controllers"]["pid"];
  EXPECT_EQ(pid["evaluations"], 12);
  EXPECT_LT(pid["cost"], pid["cost_before"]);
  const std::string tables = ReadFile(folder / "tuned" / "baselines.toml");
  EXPECT_NE(tables.find("[control.baselines.pid]"), std::string::npos) << tables;
  const std::string scene =
      "extends = \"" + tests::SourcePath("scenes/reach.toml") + "\"\n" + tables;
  const auto control = *scene::ParseScene(scene, "tuned").control;
  const controller::BaselineGains& gains = control.baselines[2];
  EXPECT_EQ(gains.proportional, pid["parameters"]["proportional"].get<double>());
  EXPECT_EQ(gains.gait_lead_s, pid["parameters"]["gait_lead"].get<double>());
  // Beginning where this search ended, nothing is cheaper "before" than what was reported.
  std::ofstream(folder / "again.toml") << scene;
  const Outcome again = Mantle(
      folder, "tune again.toml --set time.duration=0.5 --evaluations 3 --controller pid --json");
  ASSERT_EQ(again.status, 0) << again.err;
  EXPECT_EQ(nlohmann::json::parse(again.out)["controllers"]["pid"]["cost_before"], pid["cost"]);
}

TEST(MantleTune, TunesEveryBaselineWithTheSameBudget) {
  const auto folder = FreshFolder("tune_all");
  const Outcome outcome = Mantle(folder, "tune " + kShort + " --evaluations 4 --json --out tuned");
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  const auto all = nlohmann::json::parse(outcome.out)["controllers"];
  EXPECT_EQ(all.size(), 4u);
  for (const auto& [name, j] : all.items()) {
    EXPECT_EQ(j["evaluations"], 4) << name;
    EXPECT_LE(j["cost"], j["cost_before"]) << name;
  }
}

TEST(MantleTune, RefusesWhatCannotBeTunedAndWritesNothing) {
  const auto folder = FreshFolder("tune_bad");
  for (const std::string& arguments :
       {std::string("tune ") + Scene("paper"), "tune " + kShort + " --controller mpc",
        "tune " + kShort + " --evaluations 0", "tune " + kShort + " --method newton",
        "tune " + Scene("reach") + " --set control.cost.tip=-1"}) {
    const Outcome outcome = Mantle(folder, arguments + " --out tuned");
    EXPECT_EQ(outcome.status, 2) << arguments;
    EXPECT_FALSE(outcome.err.empty()) << arguments;
    EXPECT_FALSE(std::filesystem::exists(folder / "tuned" / "baselines.toml")) << arguments;
  }
}

TEST(MantleTune, WritesNothingWhereNoRunGoesToItsEnd) {
  const auto folder = FreshFolder("tune_fails");
  // The plant's thrust may not pass a hair: every pulse stops the run.
  const Outcome outcome =
      Mantle(folder, "tune " + Scene("steer") +
                         " --set time.duration=1 --set effects.jet_thrust.runaway=1e-6 "
                         "--controller gait --evaluations 3 --out tuned");
  EXPECT_EQ(outcome.status, 3) << outcome.out;
  EXPECT_NE(outcome.err.find("no run went to its end"), std::string::npos) << outcome.err;
  EXPECT_FALSE(std::filesystem::exists(folder / "tuned" / "baselines.toml"));
}

}  // namespace
}  // namespace mantle::testing_tools
