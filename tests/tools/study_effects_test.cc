#include <gtest/gtest.h>

#include <cmath>

#include "tests/tools/program.h"

// `mantle study effects`.

namespace mantle::testing_tools {
namespace {

TEST(StudyEffects, AnEffectThatIsOffCostsNothingAndOneThatIsOnChangesTheMotion) {
  const auto folder = FreshFolder("study_effects");
  const Outcome outcome = Mantle(
      folder, "--version >/dev/null && export XDG_CACHE_HOME='" + (folder / "cache").string() +
                  "' && " + Program() + " study effects " + Scene("arm_dynamic") +
                  " --set time.duration=0.2 --set arms.arm.elements=6 --out out");
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  const auto study = ReadJson(folder / "out/study.json");
  EXPECT_EQ(study.at("effects").size(), 6u) << "drag, added mass and viscosity, in both models";
  EXPECT_TRUE(study.at("failures").empty()) << study.at("failures");
  for (const auto& line : study.at("effects")) {
    EXPECT_EQ(line.at("reason"), "") << line;
    EXPECT_GT(line.at("changes").get<double>(), 1e-4) << line;
    if (study.at("counter") == "time") continue;
    EXPECT_LE(std::abs(line.at("off_against_never").get<double>()), 0.01) << line;
    EXPECT_GT(line.at("work_on").get<double>(), 1e4) << line;
  }
}

}  // namespace
}  // namespace mantle::testing_tools
