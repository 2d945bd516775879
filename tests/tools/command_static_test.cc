#include <gtest/gtest.h>

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
  EXPECT_EQ(path.rfind("load_factor,stability,volume_m3\n", 0), 0u);
  const std::string shape = ReadFile(folder / "out/shape.csv");
  EXPECT_EQ(std::count(shape.begin(), shape.end(), '\n'), 1 + 65) << "titles and 65 nodes";
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
