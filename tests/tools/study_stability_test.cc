#include <gtest/gtest.h>

#include <map>
#include <regex>
#include <set>

#include "tests/tools/program.h"

// `mantle study stability` on all hard cases, at three steps; tools/figures --full runs all steps.

namespace mantle::testing_tools {
namespace {

constexpr std::size_t kFewestCases = 60;
constexpr std::size_t kIntegrators = 5;
// The default settings reach the end as the reference does in so many of the cases.
constexpr double kDefaultShare = 0.9;
// RK4 is refused in nearly every run (a fifth of all); no other integrator may be in many.
constexpr double kMostRefused = 0.1;

TEST(StudyStability, HardCasesHoldOrAreRefusedWithAReason) {
  const auto folder = FreshFolder("study_stability");
  const Outcome outcome =
      Mantle(folder, "--version >/dev/null && export XDG_CACHE_HOME='" +
                         (folder / "cache").string() + "' && " + Program() + " study stability '" +
                         tests::SourcePath("scenes/hard") + "' --small --out out");
  EXPECT_EQ(outcome.status, 0) << outcome.err;
  const auto study = ReadJson(folder / "out/study.json");
  EXPECT_GE(study.at("cases").get<std::size_t>(), kFewestCases);
  EXPECT_EQ(study.at("violations").size(), 0u) << study.at("violations");
  EXPECT_EQ(study.at("not_reached").size(), 0u) << study.at("not_reached");
  EXPECT_GE(study.at("default_share").get<double>(), kDefaultShare) << study.at("not_by_default");
  std::map<std::string, int> refused, runs;
  std::set<std::string> cases;
  for (const auto& row : study.at("points")) {
    ASSERT_TRUE(row.contains("runs")) << row.at("name") << ": " << row.at("reason");
    cases.insert(row.at("case"));
    EXPECT_GT(row.at("hard").get<std::string>().size(), 20u) << row.at("case") << " says nothing";
    for (const auto& run : row.at("runs")) {
      const std::string verdict = run.at("verdict"), integrator = row.at("integrator");
      ++runs[integrator];
      if (verdict == "holds") {
        EXPECT_LE(run.at("created").get<double>(), 0.05) << row.at("name");
        continue;
      }
      EXPECT_NE(run.at("reason").get<std::string>(), "") << row.at("name");
      if (verdict != "refused") continue;
      ++refused[integrator];
      // A cause: a body, a load, the iteration, or the step's stability.
      EXPECT_TRUE(
          std::regex_search(run.at("reason").get<std::string>(),
                            std::regex("arm|mantle|ring|rod|jet_thrust|Newton|stable|CVODE|volume|"
                                       "tolerance|iteration")))
          << row.at("name") << ": " << run.at("reason");
    }
  }
  EXPECT_EQ(study.at("points").size(), cases.size() * kIntegrators);
  for (const char* integrator : {"sdirk2", "sdirk3", "backward_euler", "cvode"}) {
    EXPECT_LE(refused[integrator], kMostRefused * runs[integrator]) << integrator;
  }
}

TEST(StudyStability, RefusesAFolderWithoutScenes) {
  const auto folder = FreshFolder("study_no_scenes");
  const Outcome outcome = Mantle(folder, "study stability . --out out");
  EXPECT_EQ(outcome.status, 2);
  EXPECT_NE(outcome.err.find("must be a scene file or a folder of them"), std::string::npos);
}

}  // namespace
}  // namespace mantle::testing_tools
