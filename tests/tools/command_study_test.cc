#include <gtest/gtest.h>

#include <cmath>

#include "tests/tools/program.h"

// `mantle study control`.

namespace mantle::testing_tools {
namespace {

TEST(MantleStudyControl, PutsEveryControllerOnEveryScene) {
  const auto folder = FreshFolder("study_control");
  const Outcome outcome =
      Mantle(folder, "study control " + Scene("reach") + " " + Scene("reach_mismatch") +
                         " --set time.duration=2.5 --out out");
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  const auto runs = ReadJson(folder / "out/study.json").at("runs");
  ASSERT_EQ(runs.size(), 10u);
  double best = INFINITY, mpc = 0;
  for (const auto& run : runs) {
    EXPECT_TRUE(run.at("ok").get<bool>()) << run.at("reason");
    EXPECT_DOUBLE_EQ(run.at("sim_time_s"), 2.5);
    EXPECT_GT(run.at("cost").get<double>(), 0.0);
    EXPECT_EQ(run.at("solver").is_null(), run.at("controller") != "mpc");
    EXPECT_NE(outcome.out.find(run.at("controller").get<std::string>()), std::string::npos);
    if (run.at("scene") != "reach") continue;
    if (run.at("controller") == "mpc") {
      mpc = run.at("cost");
    } else {
      best = std::min(best, run.at("cost").get<double>());
    }
  }
  for (const auto& run : runs) {
    if (run.at("scene") == "reach" && run.at("controller") == "mpc") {
      EXPECT_DOUBLE_EQ(run.at("cost_over_best_baseline").get<double>(), mpc / best);
    }
  }
}

TEST(MantleStudyControl, RefusesWhatItCannotRun) {
  const auto folder = FreshFolder("study_bad");
  EXPECT_EQ(Mantle(folder, "study control " + Scene("paper") + " --out out").status, 2);
  EXPECT_EQ(Mantle(folder, "study control " + Scene("reach") + " --controllers best").status, 2);
  EXPECT_EQ(Mantle(folder, "study control nowhere.toml").status, 2);
  EXPECT_FALSE(std::filesystem::exists(folder / "out/study.json"));
}

}  // namespace
}  // namespace mantle::testing_tools
