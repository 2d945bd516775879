#include <gtest/gtest.h>

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
  EXPECT_EQ(report["settings"]["unknowns"], 6 + 6 * 40 + 3 * 65);
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

}  // namespace
}  // namespace mantle::testing_tools
