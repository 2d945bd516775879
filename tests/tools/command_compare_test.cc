#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "tests/tools/program.h"

// `mantle compare` and `mantle run --model reduced`.

namespace mantle::testing_tools {
namespace {

const std::set<std::string> kFiles = {"summary.json", "full.csv", "full.lcmlog", "reduced.csv",
                                      "reduced.lcmlog"};

std::set<std::string> FilesIn(const std::filesystem::path& folder) {
  std::set<std::string> files;
  for (const auto& f : std::filesystem::directory_iterator(folder)) {
    files.insert(f.path().filename().string());
  }
  return files;
}

std::set<std::string> ErrorsIn(const nlohmann::json& summary) {
  std::set<std::string> keys;
  for (const auto& [key, value] : summary.items()) {
    if (key.rfind("reduced_error_", 0) == 0) keys.insert(key.substr(14));
    EXPECT_FALSE(value.is_null()) << key;
  }
  return keys;
}

int Column(const std::vector<std::vector<std::string>>& rows, const std::string& title) {
  const auto at = std::find(rows.front().begin(), rows.front().end(), title);
  EXPECT_NE(at, rows.front().end()) << title;
  return static_cast<int>(at - rows.front().begin());
}

TEST(MantleCompare, PaperSwimsWithinFivePercentOfTheBodyLength) {
  const auto folder = FreshFolder("compare_paper");
  const Outcome outcome = Mantle(folder, "compare " + Scene("paper") + " --out out");
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_EQ(FilesIn(folder / "out"), kFiles);
  const auto summary = ReadJson(folder / "out/summary.json");
  EXPECT_EQ(summary.at("complete"), true);
  EXPECT_EQ(summary.at("reason"), "");
  EXPECT_DOUBLE_EQ(summary.at("sim_time_s"), 9.0);
  EXPECT_DOUBLE_EQ(summary.at("body_length_m"), 0.532);
  EXPECT_EQ(
      ErrorsIn(summary),
      (std::set<std::string>{"root", "root_final", "centre_of_mass", "centre_of_mass_final",
                             "heading_rad", "heading_rad_final", "speed", "speed_final", "energy",
                             "energy_final", "tip", "tip_final", "volume", "volume_final"}));
  EXPECT_EQ(summary.at("reduced").at("coordinates"), 4 * 4 + 3);
  EXPECT_EQ(summary.at("reduced").at("states"), 2 * (6 + 4 * 4 + 3));
  EXPECT_DOUBLE_EQ(summary.at("reduced").at("step_s"), 0.05);
  constexpr double kPath = 0.05;  // what is asked of four segments and three mantle coordinates
  EXPECT_LT(summary.at("reduced_error_root"), kPath);
  EXPECT_GT(summary.at("reduced_error_root"), 0.0);
  // Both models' warnings, in the summary and on standard error.
  for (const char* model : {"full model: mantle: ", "reduced model: mantle: "}) {
    EXPECT_NE(outcome.err.find(std::string("mantle: warning: paper: ") + model), std::string::npos)
        << outcome.err;
  }
  EXPECT_GE(summary.at("warnings").size(), 2u);
}

TEST(MantleCompare, ErrorsAreThoseOfTheTwoTrajectories) {
  const auto folder = FreshFolder("compare_csv");
  const Outcome outcome =
      Mantle(folder, "compare " + Scene("paper") +
                         " --out out --json --set time.duration=1 --set mantle.elements=24 "
                         "--set arms.arm.elements=8 --set reduced.snapshots=0");
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  const auto summary = nlohmann::json::parse(outcome.out);
  EXPECT_EQ(summary, ReadJson(folder / "out/summary.json"));
  const auto full = ReadCsv(folder / "out/full.csv"), small = ReadCsv(folder / "out/reduced.csv");
  ASSERT_EQ(full.size(), small.size());
  ASSERT_EQ(full.front(), small.front());
  const auto at = [&](const auto& rows, std::size_t i, const std::string& title) {
    return std::stod(rows[i][Column(rows, title)]);
  };
  const auto distance = [&](std::size_t i, const std::string& body) {
    double sum = 0;
    for (const char* axis : {"_x_m", "_y_m", "_z_m"}) {
      sum += std::pow(at(full, i, body + axis) - at(small, i, body + axis), 2);
    }
    return std::sqrt(sum) / 0.532;
  };
  double root = 0, tip = 0, volume = 0, change = 0;
  for (std::size_t i = 1; i < full.size(); ++i) {
    EXPECT_NEAR(at(full, i, "time_s"), at(small, i, "time_s"), 1e-12);
    root = std::max(root, distance(i, "root"));
    tip = std::max(tip, distance(i, "arm_tip"));
    volume = std::max(volume, std::abs(at(full, i, "volume_m3") - at(small, i, "volume_m3")));
    change = std::max(change, std::abs(at(full, i, "volume_m3") - at(full, 1, "volume_m3")));
  }
  constexpr double kRoundOff = 1e-12;
  EXPECT_NEAR(summary.at("reduced_error_root"), root, kRoundOff);
  EXPECT_NEAR(summary.at("reduced_error_tip"), tip, kRoundOff);
  EXPECT_NEAR(summary.at("reduced_error_volume"), volume / change, kRoundOff);
  EXPECT_NEAR(summary.at("reduced_error_root_final"), distance(full.size() - 1, "root"), kRoundOff);
}

TEST(MantleCompare, FinerBasesHaveSmallerErrors) {
  const auto folder = FreshFolder("compare_arm");
  double last = 1.0;
  for (int segments : {1, 2, 4}) {
    const Outcome outcome =
        Mantle(folder, "compare " + Scene("arm_dynamic") + " --out out --json --set " +
                           "time.duration=2 --set reduced.segments=" + std::to_string(segments));
    ASSERT_EQ(outcome.status, 0) << outcome.err;
    const auto summary = nlohmann::json::parse(outcome.out);
    EXPECT_EQ(ErrorsIn(summary).count("volume"), 0u) << "there is no mantle";
    const double tip = summary.at("reduced_error_tip");
    EXPECT_LT(tip, 0.6 * last) << segments << " segments: at least halved, about";
    last = tip;
  }
}

TEST(MantleCompare, RunThatCannotGoOnLeavesPartialResults) {
  const auto folder = FreshFolder("compare_runaway");
  const Outcome outcome =
      Mantle(folder, "compare " + Scene("paper") +
                         " --out out --set mantle.strips.muscle.pressure.high=400");
  EXPECT_EQ(outcome.status, 3);
  EXPECT_EQ(outcome.out, "");
  EXPECT_NE(outcome.err.find("paper: full model: jet_thrust ran away at t = 0.3"),
            std::string::npos)
      << outcome.err;
  EXPECT_EQ(FilesIn(folder / "out.partial"), kFiles);
  const auto summary = ReadJson(folder / "out.partial/summary.json");
  EXPECT_EQ(summary.at("complete"), false);
  EXPECT_EQ(summary.at("full").at("ok"), false);
  EXPECT_LT(summary.at("sim_time_s"), 0.4);
}

TEST(MantleRunReduced, WritesWhatTheFullModelWritesButBalances) {
  const auto folder = FreshFolder("run_reduced");
  const std::string scene = Scene("paper") + " --set time.duration=1";
  const Outcome full = Mantle(folder, "run " + scene + " --out full");
  const Outcome small = Mantle(folder, "run " + scene + " --model reduced --out reduced");
  ASSERT_EQ(full.status, 0) << full.err;
  ASSERT_EQ(small.status, 0) << small.err;
  EXPECT_EQ(FilesIn(folder / "reduced"),
            (std::set<std::string>{"summary.json", "telemetry.lcmlog", "trajectory.csv"}));
  const auto a = ReadJson(folder / "full/summary.json");
  const auto b = ReadJson(folder / "reduced/summary.json");
  EXPECT_EQ(b.at("model"), "reduced");
  EXPECT_EQ(b.at("complete"), true);
  for (const auto& [key, value] : a.items()) EXPECT_TRUE(b.contains(key)) << key;
  for (const char* key : {"power_balance_residual", "energy_drift", "work_j", "dissipated_j",
                          "energetic_index", "factorisations", "evaluations"}) {
    EXPECT_TRUE(b.at(key).is_null()) << key;
  }
  EXPECT_GE(b.at("steps"), 20);
  EXPECT_EQ(b.at("reduced").at("inputs").size(), 3u) << "two torques and the strip";
  const auto rows = ReadCsv(folder / "full/trajectory.csv");
  const auto reduced_rows = ReadCsv(folder / "reduced/trajectory.csv");
  EXPECT_EQ(rows.front(), reduced_rows.front());
  EXPECT_EQ(rows.size(), reduced_rows.size());
}

TEST(MantleRunReduced, SaysWhichOverridesAreThePlantsAlone) {
  const auto folder = FreshFolder("run_reduced_overrides");
  const std::string run =
      "run " + Scene("arm_dynamic") + " --model reduced --set time.duration=0.1 --out ";
  const Outcome plain = Mantle(folder, run + "a");
  ASSERT_EQ(plain.status, 0) << plain.err;
  const Outcome set = Mantle(folder, run + "b --set time.step=0.001 --set time.tolerance=0.1");
  ASSERT_EQ(set.status, 0) << set.err;
  EXPECT_EQ(SaidOf(set.err).warnings, SaidOf(plain.err).warnings + 2) << set.err;
  for (const char* key : {"--set time.step: ", "--set time.tolerance: "}) {
    EXPECT_NE(set.err.find(key), std::string::npos) << set.err;
  }
  EXPECT_EQ(ReadFile(folder / "a/trajectory.csv"), ReadFile(folder / "b/trajectory.csv"));
  EXPECT_EQ(ReadJson(folder / "b/summary.json").at("warnings").size(),
            ReadJson(folder / "a/summary.json").at("warnings").size() + 2);
}

TEST(MantleRunReduced, IsDeterministic) {
  const auto folder = FreshFolder("run_reduced_twice");
  const std::string command = "run " + Scene("paper") + " --set time.duration=1 --model reduced";
  ASSERT_EQ(Mantle(folder, command + " --out a").status, 0);
  ASSERT_EQ(Mantle(folder, command + " --out b").status, 0);
  EXPECT_EQ(ReadFile(folder / "a/trajectory.csv"), ReadFile(folder / "b/trajectory.csv"));
}

}  // namespace
}  // namespace mantle::testing_tools
