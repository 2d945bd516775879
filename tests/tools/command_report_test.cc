#include <gtest/gtest.h>
#include <sys/stat.h>

#include <algorithm>

#include "tests/tools/program.h"

namespace mantle::testing_tools {
namespace {

namespace fs = std::filesystem;

/// Results of short runs, made once.
class MantleReport : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = FreshFolder("report");
    if (!HasPage()) return;
    const auto run = [](const std::string& arguments) {
      const Outcome outcome = Mantle(folder_, arguments);
      ASSERT_EQ(outcome.status, 0) << outcome.err;
    };
    run("run " + Scene("reach") + " --set time.duration=0.5 --out closed --report");
    run("run " + Scene("arm_dynamic") + " --set time.duration=0.2 --out open");
    run("static " + Scene("arm_static") + " --out static");
    run("compare " + Scene("vehicle") + " --set time.duration=0.3 --out both");
  }
  // Without npm Mantle is built without the page; that the program then says why is tested below.
  static bool HasPage() { return fs::exists(tests::BinaryPath("report/report.html")); }
  void SetUp() override {
    if (!HasPage()) GTEST_SKIP() << ReadFile(tests::BinaryPath("report/report.missing"));
  }
  // What a page holds.
  static nlohmann::json DataOf(const fs::path& page) {
    const std::string text = ReadFile(page), open = "type=\"application/json\">";
    const auto begin = text.find(open) + open.size();
    return nlohmann::json::parse(text.substr(begin, text.find("</script>", begin) - begin));
  }
  static std::string Copy(const std::string& name) {
    fs::remove_all(folder_ / (name + "_copy"));
    fs::copy(folder_ / name, folder_ / (name + "_copy"), fs::copy_options::recursive);
    return name + "_copy";
  }

  static inline fs::path folder_;
};

TEST_F(MantleReport, OfAClosedLoopHoldsAllThatItLogged) {
  const auto data = DataOf(folder_ / "closed/report.html");
  EXPECT_EQ(data["format"], 2);
  ASSERT_EQ(data["runs"].size(), 1U);
  const auto& run = data["runs"][0];
  EXPECT_EQ(run["label"], "closed");
  EXPECT_EQ(run["kind"], "run");
  EXPECT_EQ(run["complete"], true);
  EXPECT_EQ(run["summary"], ReadJson(folder_ / "closed/summary.json"));
  for (const char* part : {"trajectory", "solver", "energy", "plans", "drives", "counters",
                           "status", "shape", "estimate"}) {
    EXPECT_TRUE(run.contains(part)) << part;
  }
  const auto rows = ReadCsv(folder_ / "closed/trajectory.csv");
  EXPECT_EQ(run["trajectory"]["of_rows"], rows.size() - 1);
  EXPECT_EQ(run["trajectory"]["columns"].size(), rows[0].size());
  EXPECT_EQ(run["shape"]["of_frames"], rows.size() - 1);
  EXPECT_EQ(run["shape"]["arms"][0]["nodes"], 21);
  EXPECT_EQ(run["shape"]["drag"]["nodes"]["n"],
            3 * 21 * run["shape"]["drag"]["time"]["n"].get<int>());
  EXPECT_LT(run["shape"]["error_m"], 1e-5) << "nothing is thinned: sixteen bits alone";
}

TEST_F(MantleReport, IsThinnedToTheSizeThatIsAskedForAndSaysWhatThatCosts) {
  ASSERT_EQ(Mantle(folder_, "report closed --size 0.1 --out small.html").status, 0);
  ASSERT_EQ(Mantle(folder_, "report closed --out large.html").status, 0);
  const auto small = DataOf(folder_ / "small.html")["runs"][0]["shape"];
  const auto large = DataOf(folder_ / "large.html")["runs"][0]["shape"];
  EXPECT_EQ(small["of_frames"], large["of_frames"]);
  EXPECT_LT(fs::file_size(folder_ / "small.html"), fs::file_size(folder_ / "large.html") + 1);
  EXPECT_GE(small["error_m"], large["error_m"].get<double>());
}

TEST_F(MantleReport, OfSeveralRunsHasThemAllUnderNamesThatDiffer) {
  const Outcome outcome = Mantle(folder_, "report closed open static both closed --json");
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  const auto said = nlohmann::json::parse(outcome.out);
  EXPECT_EQ(said["report"], "report.html");
  EXPECT_EQ(said["bytes"], fs::file_size(folder_ / "report.html"));
  const std::vector<std::string> labels = said["runs"];
  ASSERT_EQ(labels.size(), 6U) << "the comparison is two";
  EXPECT_EQ(std::set<std::string>(labels.begin(), labels.end()).size(), 6U);
  const auto data = DataOf(folder_ / "report.html");
  EXPECT_EQ(data["runs"][3]["label"], "both: full");
  EXPECT_TRUE(data["runs"][4].contains("shape")) << "the reduced model's";
  EXPECT_TRUE(data["runs"][2].contains("path"));
  EXPECT_TRUE(data["runs"][2].contains("shape")) << "of the equilibrium";
}

TEST_F(MantleReport, NoTextOfAResultLeavesItsPlace) {
  const std::string copy = Copy("open");
  auto summary = ReadJson(folder_ / copy / "summary.json");
  summary["scene"] = "</script><script>alert(1)</script><!--";
  std::ofstream(folder_ / copy / "summary.json") << summary;
  ASSERT_EQ(Mantle(folder_, "report " + copy).status, 0);
  const std::string page = ReadFile(folder_ / copy / "report.html");
  EXPECT_EQ(page.find("alert(1)</script>"), std::string::npos);
  EXPECT_EQ(DataOf(folder_ / copy / "report.html")["runs"][0]["summary"]["scene"],
            summary["scene"]);
}

TEST_F(MantleReport, DamageIsRefusedInWholeResultsAndToldInStoppedOnes) {
  const std::string copy = Copy("open");
  const std::string log = ReadFile(folder_ / copy / "telemetry.lcmlog");
  std::ofstream(folder_ / copy / "telemetry.lcmlog", std::ios::binary)
      << log.substr(0, log.size() - 7);
  const Outcome refused = Mantle(folder_, "report " + copy);
  EXPECT_EQ(refused.status, 2);
  EXPECT_NE(refused.err.find("telemetry.lcmlog: cut short or damaged after event"),
            std::string::npos)
      << refused.err;
  EXPECT_FALSE(fs::exists(folder_ / copy / "report.html"));
  auto summary = ReadJson(folder_ / copy / "summary.json");
  summary["complete"] = false;
  summary["reason"] = "interrupted";
  std::ofstream(folder_ / copy / "summary.json") << summary;
  ASSERT_EQ(Mantle(folder_, "report " + copy).status, 0);
  const auto notes = DataOf(folder_ / copy / "report.html")["runs"][0]["notes"];
  ASSERT_EQ(notes.size(), 2U);
  EXPECT_EQ(notes[0], "Stopped: interrupted");
}

TEST_F(MantleReport, WhatIsNoFolderOfResultsIsRefusedWithWhatItMustBe) {
  fs::create_directory(folder_ / "empty");
  fs::create_directory(folder_ / "stopped.partial");
  for (const auto& [folder, why] : std::vector<std::pair<std::string, std::string>>{
           {"empty", "empty: has no results: must hold summary.json"},
           {"nowhere", "nowhere: there is no such folder"},
           {"stopped", "a stopped run left stopped.partial"},
           {"closed/summary.json", "is no folder: must be a folder of results"}}) {
    const Outcome outcome = Mantle(folder_, "report " + folder + " --out no.html");
    EXPECT_EQ(outcome.status, 2) << folder;
    EXPECT_NE(outcome.err.find(why), std::string::npos) << outcome.err;
    EXPECT_FALSE(fs::exists(folder_ / "no.html"));
  }
  const Outcome out = Mantle(folder_, "report closed --out nowhere/x.html");
  EXPECT_EQ(out.status, 2);
  EXPECT_NE(out.err.find("--out: nowhere: there is no such folder"), std::string::npos) << out.err;
}

TEST_F(MantleReport, APipeInPlaceOfAFileIsRefusedAndNotWaitedFor) {
  for (const char* name : {"trajectory.csv", "summary.json", "telemetry.lcmlog"}) {
    const std::string copy = Copy("open");
    fs::remove(folder_ / copy / name);
    ASSERT_EQ(mkfifo((folder_ / copy / name).c_str(), 0600), 0);
    const Outcome outcome = Mantle(folder_, "report " + copy);
    EXPECT_EQ(outcome.status, 2) << name;
    EXPECT_NE(outcome.err.find(std::string(name) + ": cannot be read"), std::string::npos)
        << outcome.err;
  }
}

TEST_F(MantleReport, ANewRunTakesTheOldReportAway) {
  const std::string run = "run " + Scene("arm_dynamic") + " --set time.duration=0.1 --out again";
  ASSERT_EQ(Mantle(folder_, run + " --report").status, 0);
  EXPECT_TRUE(fs::exists(folder_ / "again/report.html"));
  ASSERT_EQ(Mantle(folder_, run).status, 0);
  EXPECT_FALSE(fs::exists(folder_ / "again/report.html")) << "it was of other results";
}

TEST_F(MantleReport, WithoutItsPageTheProgramSaysWhy) {
  // A copy of the program that stands alone.
  fs::create_directories(folder_ / "alone");
  fs::copy_file(tests::BinaryPath("mantle"), folder_ / "alone/mantle",
                fs::copy_options::overwrite_existing);
  const Outcome absent = Mantle(folder_, "--version >/dev/null; alone/mantle report closed");
  EXPECT_EQ(absent.status, 2);
  EXPECT_NE(absent.err.find("must be installed beside the program"), std::string::npos)
      << absent.err;
  fs::create_directories(folder_ / "alone/report");
  std::ofstream(folder_ / "alone/report/report.missing") << "npm was not there\n";
  const Outcome missing = Mantle(folder_, "--version >/dev/null; alone/mantle report closed");
  EXPECT_EQ(missing.status, 2);
  EXPECT_NE(missing.err.find("report.html): npm was not there\n"), std::string::npos)
      << missing.err;
}

}  // namespace
}  // namespace mantle::testing_tools
