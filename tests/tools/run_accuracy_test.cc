#include <gtest/gtest.h>

#include <cmath>
#include <regex>

#include "tests/tools/program.h"

// `mantle run --accuracy`.

namespace mantle::testing_tools {
namespace {

std::string WithCache(const std::filesystem::path& folder, const std::string& arguments) {
  return "--version >/dev/null && export XDG_CACHE_HOME='" + (folder / "cache").string() + "' && " +
         Program() + " " + arguments;
}

// Largest distance of root and tips between two runs at their common instants [m].
double LargestDistance(const std::filesystem::path& a, const std::filesystem::path& b,
                       int* common) {
  const auto one = ReadCsv(a / "trajectory.csv"), other = ReadCsv(b / "trajectory.csv");
  double largest = 0;
  std::size_t next = 1;
  *common = 0;
  for (std::size_t i = 1; i < one.size(); ++i) {
    const double t = std::stod(one[i][0]);
    while (next < other.size() && std::stod(other[next][0]) < t - 1e-9) ++next;
    if (next == other.size()) break;
    if (std::stod(other[next][0]) > t + 1e-9) continue;
    ++*common;
    for (std::size_t c = 0; c + 2 < one[0].size(); ++c) {
      const std::string& title = one[0][c];
      if (title != "root_x_m" && !title.ends_with("_tip_x_m")) continue;
      double square = 0;
      for (std::size_t k = c; k < c + 3; ++k) {
        square += std::pow(std::stod(one[i][k]) - std::stod(other[next][k]), 2);
      }
      largest = std::max(largest, std::sqrt(square));
    }
  }
  return largest;
}

struct Case {
  const char *scene, *accuracy, *set;
  const char* finest;  ///< overrides of a run that may stand for the truth
  double body_length_m;
  const char* interval;
};

// Scenes on which nothing about the choice was fitted: of several pieces with muscles in a swell,
// of a payload that drops, of a stiff cable, a body without arms.
class PromisedAccuracy : public testing::TestWithParam<Case> {};

TEST_P(PromisedAccuracy, Holds) {
  const Case& c = GetParam();
  const auto folder = FreshFolder(std::string("run_accuracy_") + c.scene);
  const std::string common = "run " + Scene(c.scene) +
                             " --shape-every 0 --set output.interval=" + c.interval + " " + c.set;
  const Outcome chosen =
      Mantle(folder, WithCache(folder, common + " --accuracy " + c.accuracy + " --out chosen"));
  ASSERT_EQ(chosen.status, 0) << chosen.err;
  std::smatch match;
  ASSERT_TRUE(std::regex_search(chosen.err, match, std::regex("expected error ([0-9.e-]+) %")))
      << chosen.err;
  const double promised = 0.01 * std::stod(match[1]);
  const Outcome truth =
      Mantle(folder, common + " --set time.integrator=sdirk3 " + c.finest + " --out truth");
  ASSERT_EQ(truth.status, 0) << truth.err;
  int common_instants = 0;
  const double error =
      LargestDistance(folder / "chosen", folder / "truth", &common_instants) / c.body_length_m;
  EXPECT_GE(common_instants, 8);
  EXPECT_LE(error, promised) << chosen.err;
  EXPECT_GT(error, 0.0);
}

INSTANTIATE_TEST_SUITE_P(
    Scenes, PromisedAccuracy,
    testing::Values(
        Case{"eel", "3%", "", "--set time.step=0.001 --set arms.body.elements=84", 0.42, "0.1"},
        Case{"carrier", "1%", "", "--set time.step=0.001 --set arms.arm.elements=80", 0.42, "0.1"},
        Case{"stiff_cable", "2%", "", "--set time.step=0.001 --set arms.arm.elements=80", 0.42,
             "0.1"},
        Case{"terminal_velocity", "1%", "--set robot.body_length=1", "--set time.step=0.001", 1.0,
             "0.2"}),
    [](const auto& info) { return std::string(info.param.scene); });

TEST(RunAccuracy, RefusesWhatItCannotPromiseAndWhereItHasNoMeaning) {
  const auto folder = FreshFolder("run_accuracy_refused");
  const Outcome fine = Mantle(
      folder, WithCache(folder, "run " + Scene("tumbling_arm") + " --accuracy 0.01% --out out"));
  EXPECT_EQ(fine.status, 2);
  EXPECT_NE(fine.err.find("cannot be promised"), std::string::npos) << fine.err;
  EXPECT_FALSE(std::filesystem::exists(folder / "out"));
  for (const char* bad : {"0", "1 mm", "120%", "-1%", "nan", "much"}) {
    const Outcome outcome =
        Mantle(folder, "run " + Scene("arm_dynamic") + " --accuracy '" + bad + "' --out out");
    EXPECT_EQ(outcome.status, 2) << bad;
    EXPECT_NE(outcome.err.find("--accuracy"), std::string::npos) << outcome.err;
  }
  const Outcome reduced =
      Mantle(folder, "run " + Scene("paper") + " --model reduced --accuracy 1% --out out");
  EXPECT_EQ(reduced.status, 2);
  EXPECT_NE(reduced.err.find("with --model full"), std::string::npos) << reduced.err;
  const Outcome closed = Mantle(folder, "run " + Scene("reach") + " --accuracy 1% --out out");
  EXPECT_EQ(closed.status, 2);
  EXPECT_NE(closed.err.find("with --open-loop"), std::string::npos) << closed.err;
}

}  // namespace
}  // namespace mantle::testing_tools
