#include <gtest/gtest.h>

#include <cmath>

#include "tests/tools/program.h"

namespace mantle::testing_tools {
namespace {

constexpr double kElasticaMesh = 1e-4;  // 100 elements, error of order h^2
constexpr double kFold = 1e-3;          // 64 elements: the issue asks for 0.1 %

TEST(MantleStatic, ElasticaReachesItsDeflections) {
  const auto folder = FreshFolder("elastica");
  const std::pair<double, double> cases[] = {
      {1, 0.3017208}, {2, 0.4934575}, {5, 0.7137915}, {10, 0.8106090}};
  for (const auto& [load, deflection] : cases) {
    const Outcome outcome = Mantle(folder, "static " + Scene("elastica") +
                                               " --out out --json --set arms.rod.points.tip." +
                                               "schedule=" + std::to_string(load));
    ASSERT_EQ(outcome.status, 0) << outcome.err;
    const auto summary = nlohmann::json::parse(outcome.out);
    EXPECT_NEAR(summary["tips"]["rod"]["position_m"][1].get<double>(), deflection, kElasticaMesh);
    EXPECT_DOUBLE_EQ(summary["load_factor"].get<double>(), 1.0);
    EXPECT_TRUE(summary["limit_load_factor"].is_null());
    EXPECT_DOUBLE_EQ(summary["loads"]["rod.tip.force"]["at_end"].get<double>(), load);
    EXPECT_EQ(summary["loads"]["rod.tip.force"]["unit"], "N");
  }
}

TEST(MantleStatic, MantleFoldIsReportedInPascal) {
  const auto folder = FreshFolder("fold");
  const Outcome outcome = Mantle(folder, "static " + Scene("mantle_static") + " --out out");
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  const auto summary = ReadJson(folder / "out/summary.json");
  EXPECT_NEAR(summary["loads"]["mantle.muscle"]["at_limit"].get<double>(), 494.1, kFold * 494.1);
  EXPECT_EQ(summary["loads"]["mantle.muscle"]["unit"], "Pa");
  EXPECT_LT(summary["volume_m3"]["final"].get<double>(),
            summary["volume_m3"]["initial"].get<double>());
  const std::string path = ReadFile(folder / "out/path.csv");
  EXPECT_EQ(path.rfind("load_factor,unstable_directions,volume_m3\n", 0), 0u);
  const std::string shape = ReadFile(folder / "out/shape.csv");
  EXPECT_EQ(std::count(shape.begin(), shape.end(), '\n'), 1 + 65) << "titles and 65 nodes";
}

std::string Case(const std::string& name) {
  return "'" + tests::SourcePath("tests/tools/static_cases/") + name + ".toml'";
}

void ExpectTip(const nlohmann::json& summary, const std::string& arm, double x, double y, double z,
               double tolerance) {
  const auto tip = summary["tips"][arm]["position_m"].get<std::vector<double>>();
  EXPECT_NEAR(tip[0], x, tolerance) << arm;
  EXPECT_NEAR(tip[1], y, tolerance) << arm;
  EXPECT_NEAR(tip[2], z, tolerance) << arm;
}

// The reference values below are of independent programs with their own meshes: h^2 of the
// elements.
constexpr double kCaseMesh = 1e-4;

TEST(MantleStatic, ACurrentBendsARodAsItDoesInTime) {
  const auto folder = FreshFolder("current");
  const Outcome solved = Mantle(folder, "static " + Case("rod_in_current") + " --out out --json");
  ASSERT_EQ(solved.status, 0) << solved.err;
  const auto summary = nlohmann::json::parse(solved.out);
  ExpectTip(summary, "rod", 0.996699, 0.075931, 0.0, 2e-6);
  EXPECT_EQ(summary["unstable_directions"], 0);
  EXPECT_EQ(summary["stability_test"], "linearised motion");
  EXPECT_EQ(summary["loads_without_potential"].size(), 1u);
}

TEST(MantleStatic, AColumnGoesToItsStableBranchOrSaysThatItIsUnstable) {
  const auto folder = FreshFolder("column");
  for (const char* more : {"", " --set statics.arc_length=true"}) {
    const Outcome outcome = Mantle(folder, "static " + Case("column") + " --out out --json" + more);
    ASSERT_EQ(outcome.status, 0) << outcome.err;
    const auto summary = nlohmann::json::parse(outcome.out);
    ExpectTip(summary, "bar", 0.15559, 2.38226, 0.0, 3e-4);  // 60 elements
    EXPECT_EQ(summary["unstable_directions"], 0);
    EXPECT_EQ(summary["load_factor"], 1.0);
    EXPECT_TRUE(summary["warnings"].empty()) << summary["warnings"];
  }
  const Outcome straight =
      Mantle(folder, "static " + Case("column") +
                         " --out out --json --set arms.bar.points.side.schedule=0");
  ASSERT_EQ(straight.status, 0) << straight.err;
  const auto summary = nlohmann::json::parse(straight.out);
  ExpectTip(summary, "bar", 3.0 * (1.0 - 980665 / 2.1e9), 0.0, 0.0, 1e-6);
  EXPECT_EQ(summary["unstable_directions"], 2);
  ASSERT_EQ(summary["bifurcation_load_factors"].size(), 1u);
  EXPECT_NEAR(summary["bifurcation_load_factors"][0].get<double>(), 1.0 / 2.04, 3e-3);
  EXPECT_NE(summary["warnings"][0].get<std::string>().find("unstable in 2 directions"),
            std::string::npos);
}

TEST(MantleStatic, StiffRodsAndHelicesTakeFewIterations) {
  const auto folder = FreshFolder("stiff");
  const Outcome wire = Mantle(folder, "static " + Case("inextensible_wire") + " --out out --json");
  ASSERT_EQ(wire.status, 0) << wire.err;
  ExpectTip(nlohmann::json::parse(wire.out), "wire", 0.445014, 0.810609, 0.0, kCaseMesh);
  EXPECT_LT(nlohmann::json::parse(wire.out)["iterations"].get<int>(), 200);
  for (const auto& [elements, mesh] :
       {std::pair{20, 75 * kCaseMesh}, {40, 19 * kCaseMesh}, {100, 3 * kCaseMesh}}) {
    const Outcome helix =
        Mantle(folder, "static " + Case("helix_by_couple") +
                           " --out out --json --set arms.rod.elements=" + std::to_string(elements));
    ASSERT_EQ(helix.status, 0) << helix.err;
    const auto summary = nlohmann::json::parse(helix.out);
    ExpectTip(summary, "rod", 0.202425, -0.346598, 0.038615, mesh);
    EXPECT_LT(summary["iterations"].get<int>(), 400);
  }
}

TEST(MantleStatic, AnArmPushedInsideOutIsRefused) {
  const auto folder = FreshFolder("inside_out");
  const Outcome outcome = Mantle(folder, "static " + Case("arm_inside_out") + " --out out");
  EXPECT_EQ(outcome.status, 3);
  EXPECT_NE(outcome.err.find("inside out"), std::string::npos) << outcome.err;
  EXPECT_FALSE(std::filesystem::exists(folder / "out/summary.json"));
}

TEST(MantleStatic, ArcLengthThatDoesNotArriveIsIncomplete) {
  const auto folder = FreshFolder("incomplete");
  const Outcome outcome =
      Mantle(folder, "static " + Case("column") +
                         " --out out --set statics.arc_length=true --set statics.max_points=5");
  EXPECT_EQ(outcome.status, 3);
  EXPECT_NE(outcome.err.find("max_points"), std::string::npos) << outcome.err;
  EXPECT_EQ(ReadJson(folder / "out.partial/summary.json")["complete"], false);
}

TEST(MantleStatic, TheMantlesWorkingPressureStandsBesideLobedBuckling) {
  const auto folder = FreshFolder("lobes");
  for (const char* command : {"static ", "check "}) {
    const Outcome outcome = Mantle(folder, command + Scene("mantle_static") + " --json" +
                                               (command[0] == 's' ? " --out out" : ""));
    ASSERT_EQ(outcome.status, 0) << outcome.err;
    const auto summary = nlohmann::json::parse(outcome.out);
    EXPECT_GT(summary["lobed_buckling"]["working_pa"].get<double>(), 400.0);
    EXPECT_NEAR(summary["lobed_buckling"]["ends_free_pa"].get<double>(), 2.7, 0.1);
    bool said = false;
    for (const auto& w : summary["warnings"]) {
      said = said || w.get<std::string>().find("lobes") != std::string::npos;
    }
    EXPECT_TRUE(said) << command;
  }
}

TEST(MantleModes, FrequenciesOfACantileverAndGrowthOfAColumn) {
  const auto folder = FreshFolder("modes");
  // Euler-Bernoulli: omega = 1.8751^2 sqrt(EI / rho A L^4); the bar is slender enough for 0.2 %.
  const Outcome bar = Mantle(folder, "modes " + Case("column") + " --out out --json --count 4");
  ASSERT_EQ(bar.status, 0) << bar.err;
  const auto summary = nlohmann::json::parse(bar.out);
  const double w1 = 1.87510407 * 1.87510407 * std::sqrt(1.75e6 / 78.5 / 81.0);
  EXPECT_NEAR(summary["modes"][0]["frequency_hz"].get<double>(), w1 / (2 * M_PI), 2e-3 * w1);
  EXPECT_EQ(summary["modes"][0]["unstable"], false);
  const Outcome pushed = Mantle(folder, "modes " + Case("column") +
                                            " --out out --json --about static --set "
                                            "arms.bar.points.side.schedule=0");
  ASSERT_EQ(pushed.status, 0) << pushed.err;
  int growing = 0;
  const auto about_static = nlohmann::json::parse(pushed.out);
  for (const auto& mode : about_static["modes"]) {
    growing += mode["unstable"] == true ? 1 : 0;
  }
  EXPECT_EQ(growing, 2);
  EXPECT_TRUE(std::filesystem::exists(folder / "out/shapes.csv"));
}

TEST(MantleStatic, CablesHaveLengthAndTension) {
  const auto folder = FreshFolder("cables");
  const Outcome outcome = Mantle(folder, "static " + Scene("arm_static") +
                                             " --out out --set arms.arm.cables.left.tension=0.1");
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  const auto cables = ReadJson(folder / "out/summary.json")["cables"];
  EXPECT_DOUBLE_EQ(cables["arm_left"]["tension_n"].get<double>(), 0.1);
  EXPECT_LT(cables["arm_left"]["length_m"].get<double>(),
            cables["arm_up"]["length_m"].get<double>());
  EXPECT_GT(cables["arm_right"]["length_m"].get<double>(),
            cables["arm_up"]["length_m"].get<double>());
}

TEST(MantleStatic, WhatCannotBeReachedIsKeptAsPartial) {
  const auto folder = FreshFolder("unreached");
  // Plain load stepping cannot pass the fold.
  const Outcome outcome = Mantle(
      folder, "static " + Scene("mantle_static") + " --out out --set statics.arc_length=false");
  EXPECT_EQ(outcome.status, 3);
  EXPECT_EQ(std::count(outcome.err.begin(), outcome.err.end(), '\n'), 1) << outcome.err;
  EXPECT_FALSE(std::filesystem::exists(folder / "out/summary.json"));
  const auto summary = ReadJson(folder / "out.partial/summary.json");
  EXPECT_EQ(summary["complete"], false);
  EXPECT_NEAR(summary["load_factor"].get<double>(), 494.1 / 500, 5e-3) << "close to the fold";
}

}  // namespace
}  // namespace mantle::testing_tools
