#include <gtest/gtest.h>

#include <csignal>
#include <map>
#include <set>

#include "tests/tools/program.h"

// `mantle study accuracy` and what all studies share.

namespace mantle::testing_tools {
namespace {

// References of this test alone, so that it depends on nothing that was left behind.
std::string Command(const std::filesystem::path& folder, const std::string& arguments) {
  return "--version >/dev/null && export XDG_CACHE_HOME='" + (folder / "cache").string() + "' && " +
         Program() + " study accuracy " + arguments;
}

constexpr const char* kSmall = " --size small --set time.duration=2 --out out";
// Integrators' orders on a run of few sizes; the default size holds 0.3.
constexpr double kOrderOff = 0.4;

TEST(StudyAccuracy, TellsErrorsOrdersFrontAndWhatToTake) {
  const auto folder = FreshFolder("study_accuracy");
  const Outcome outcome = Mantle(folder, Command(folder, Scene("arm_dynamic") + kSmall));
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  const auto study = ReadJson(folder / "out/study.json");
  std::map<std::string, nlohmann::json> rows;
  for (const auto& row : study.at("points")) {
    EXPECT_TRUE(row.at("ok").get<bool>()) << row.at("name") << row.at("reason");
    EXPECT_GT(row.at("cpu_s").get<double>(), 0.0);
    EXPECT_GT(row.at("error_in_all").get<double>(), 0.0);
    rows[row.at("name")] = row;
  }
  // Steps of the second order: four times less at half the length.
  const double coarse = rows.at("sdirk2 at 10 ms").at("error"),
               fine = rows.at("sdirk2 at 5 ms").at("error");
  EXPECT_GT(coarse / fine, 2.5);
  EXPECT_LT(coarse / fine, 6.0);
  EXPECT_GT(rows.at("arms of 5 elements").at("error").get<double>(),
            3.0 * rows.at("arms of 10 elements").at("error").get<double>());
  for (const auto& order : study.at("orders")) {
    // Of the third order these few steps show too little.
    if (order.at("of") == "sdirk3") continue;
    EXPECT_NEAR(order.at("order").get<double>(), order.at("theory").get<double>(), kOrderOff)
        << order;
  }
  // Nothing is cheaper and better than what is on the front.
  for (const auto& name : study.at("front")) {
    const auto& on = rows.at(name);
    for (const auto& [other, row] : rows) {
      EXPECT_FALSE(row.at("cpu_s") < on.at("cpu_s") &&
                   row.at("error_in_all") < on.at("error_in_all"))
          << other << " beats " << name;
    }
  }
  ASSERT_FALSE(study.at("recommendations").empty());
  for (const auto& r : study.at("recommendations")) {
    EXPECT_LE(rows.at(r.at("point")).at("error_in_all"), r.at("target"));
    EXPECT_NE(outcome.out.find(r.at("text").get<std::string>()), std::string::npos);
  }
  EXPECT_EQ(ReadCsv(folder / "out/study.csv").size(), rows.size() + 1);
  EXPECT_FALSE(std::filesystem::exists(folder / "out.points"));
}

TEST(StudyAccuracy, GoesOnWhereItWasStoppedWithTheSameErrors) {
  const auto folder = FreshFolder("study_resume");
  const std::string scene = Scene("arm_dynamic") + kSmall;
  const Outcome stopped = Mantle(folder, "--version >/dev/null && export XDG_CACHE_HOME='" +
                                             (folder / "cache").string() + "' && { " + Program() +
                                             " study accuracy " + scene +
                                             " --jobs 1 & until [ $(ls out.points/*.row.json "
                                             "2>/dev/null | wc -l) -ge 6 ]; do sleep 0.05; "
                                             "done; kill -TERM $!; wait $!; }");
  ASSERT_EQ(stopped.status, 3) << stopped.err;
  EXPECT_NE(stopped.err.find("goes on from"), std::string::npos) << stopped.err;
  EXPECT_FALSE(std::filesystem::exists(folder / "out/study.json"));
  std::map<std::string, std::string> before;
  for (const auto& entry : std::filesystem::directory_iterator(folder / "out.points")) {
    const std::string name = entry.path().filename().string();
    if (name.ends_with(".row.json")) before[name] = ReadFile(entry.path());
  }
  ASSERT_FALSE(before.empty()) << "nothing was done before it was stopped";
  const Outcome outcome = Mantle(folder, Command(folder, scene + " --json"));
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  // What was there has not been measured again: the very rows stand in the study.
  const auto study = nlohmann::json::parse(outcome.out);
  for (const auto& [name, text] : before) {
    const auto row = nlohmann::json::parse(text);
    const auto& in = study.at(row.at("family") == "reference" ? "references" : "points");
    bool found = false;
    for (auto other : in) {
      other.erase("front");
      found = found || other == row;
    }
    EXPECT_TRUE(found) << row;
  }
  const Outcome fresh = Mantle(folder, Command(folder, Scene("arm_dynamic") + kSmall + "2 --json"));
  ASSERT_EQ(fresh.status, 0) << fresh.err;
  std::map<std::string, double> errors;
  for (const auto& row : study.at("points")) errors[row.at("name")] = row.at("error_in_all");
  for (const auto& row : nlohmann::json::parse(fresh.out).at("points")) {
    EXPECT_EQ(errors.at(row.at("name")), row.at("error_in_all").get<double>()) << row.at("name");
  }
}

TEST(StudyAccuracy, APointThatFailsIsARowWithItsReason) {
  const auto folder = FreshFolder("study_failing");
  // A mantle that the pressure closes up: the plant stops, and so does every point.
  const Outcome outcome = Mantle(
      folder, Command(folder, Scene("mantle_swim") +
                                  " --size small --set time.duration=0.6 --set "
                                  "mantle.strips.muscle.pressure.high=900 --out out --json"));
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  const auto study = nlohmann::json::parse(outcome.out);
  ASSERT_GT(study.at("points").size(), 10u);
  int failed = 0;
  for (const auto& row : study.at("points")) {
    if (row.at("ok").get<bool>()) continue;
    ++failed;
    EXPECT_NE(row.at("reason").get<std::string>(), "") << row.at("name");
  }
  EXPECT_GT(failed, 5);
}

TEST(StudyAccuracy, RefusesWhatItCannotStudyBeforeAnythingIsWritten) {
  const auto folder = FreshFolder("study_refused");
  const Outcome no_time = Mantle(folder, Command(folder, Scene("elastica") + " --out out"));
  EXPECT_EQ(no_time.status, 2);
  EXPECT_NE(no_time.err.find("time: table is missing"), std::string::npos) << no_time.err;
  const Outcome bad =
      Mantle(folder, Command(folder, Scene("paper") + " --set time.stp=1 --out out"));
  EXPECT_EQ(bad.status, 2);
  EXPECT_NE(bad.err.find("time.stp"), std::string::npos) << bad.err;
  EXPECT_FALSE(std::filesystem::exists(folder / "out.points"));
}

}  // namespace
}  // namespace mantle::testing_tools
