#include <gtest/gtest.h>

#include <sstream>

#include "tests/tools/program.h"
#include "tests/tools/telemetry_samples.h"
#include "tools/mantle/lcm_bridge.h"

namespace mantle::testing_tools {
namespace {

constexpr int kSamples = 11;

std::filesystem::path FolderWithLog(const std::string& name) {
  const auto folder = FreshFolder(name);
  auto link = tools::OpenLcm({.log_folder = folder});
  for (int k = 0; k < kSamples; ++k) {
    const Messages messages = OctopusMessages(k);
    link->Write(messages.state);
    if (k % 5 == 0) link->Write(messages.plan);
  }
  link->FinishLog();
  return folder;
}

std::vector<std::string> Lines(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream in(text);
  for (std::string line; std::getline(in, line);) lines.push_back(line);
  return lines;
}

TEST(MantleLog, CountsChannelsWithTheirRates) {
  const auto folder = FolderWithLog("log_counts");
  const Outcome outcome = Mantle(folder, "log telemetry.lcmlog --json");
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  const auto report = nlohmann::json::parse(outcome.out);
  EXPECT_EQ(report["events"], kSamples + 3);
  EXPECT_DOUBLE_EQ(report["span_s"], 0.1);
  EXPECT_TRUE(report["damaged_at_byte"].is_null());
  ASSERT_EQ(report["channels"].size(), 2U);
  EXPECT_EQ(report["channels"]["MANTLE_STATE"]["messages"], kSamples);
  EXPECT_DOUBLE_EQ(report["channels"]["MANTLE_STATE"]["rate_hz"], 100.0);
  EXPECT_DOUBLE_EQ(report["channels"]["MANTLE_PLAN"]["rate_hz"], 20.0);
  EXPECT_EQ(report["channels"]["MANTLE_PLAN"]["last_us"], 100'000);
  const Outcome text = Mantle(folder, "log telemetry.lcmlog");
  EXPECT_EQ(text.status, 0);
  EXPECT_NE(text.out.find("telemetry.lcmlog: 14 messages in 0.1 s\n"), std::string::npos);
}

TEST(MantleLog, PrintsAChannelAsATable) {
  const auto folder = FolderWithLog("log_table");
  const Outcome outcome = Mantle(folder, "log telemetry.lcmlog --channel MANTLE_PLAN --csv");
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  const auto lines = Lines(outcome.out);
  ASSERT_EQ(lines.size(), 4U);
  EXPECT_EQ(lines[0].rfind("utime,time_0,time_1,", 0), 0U);
  EXPECT_NE(lines[0].find(",tip_position_20_7_2,cost,status,solve_time_us"), std::string::npos);
  // Leaf 1 of sample 5 is 5 + 1/8; texts are quoted.
  EXPECT_EQ(lines[2].rfind("50000,5.125,5.25,", 0), 0U) << lines[2].substr(0, 40);
  const auto commas = [](const std::string& s) { return std::count(s.begin(), s.end(), ','); };
  for (const std::string& line : lines) EXPECT_EQ(commas(line), commas(lines[0]));
  EXPECT_NE(lines[1].find(",\"0."), std::string::npos);
}

TEST(MantleLog, RefusesWhatIsNoLogAndNoChannel) {
  const auto folder = FolderWithLog("log_refusals");
  const Outcome absent = Mantle(folder, "log absent.lcmlog");
  EXPECT_EQ(absent.status, 2);
  EXPECT_EQ(absent.err, "mantle: absent.lcmlog: cannot be read: must be an LCM event log\n");
  const Outcome channel = Mantle(folder, "log telemetry.lcmlog --channel MANTLE_PLANS --csv");
  EXPECT_EQ(channel.status, 2);
  EXPECT_NE(channel.err.find("--channel: MANTLE_PLANS: no message of ours"), std::string::npos);
  EXPECT_EQ(channel.out, "");
  EXPECT_EQ(Mantle(folder, "log telemetry.lcmlog --csv").status, 2);
}

TEST(MantleLog, SaysWhereALogIsCutShort) {
  const auto folder = FolderWithLog("log_cut");
  const std::string whole = ReadFile(folder / "telemetry.lcmlog");
  std::ofstream(folder / "cut.lcmlog", std::ios::binary) << whole.substr(0, whole.size() - 10);
  const Outcome outcome = Mantle(folder, "log cut.lcmlog --json");
  EXPECT_EQ(outcome.status, 3);
  EXPECT_EQ(nlohmann::json::parse(outcome.out)["events"], kSamples + 2);
  EXPECT_EQ(outcome.err.rfind("mantle: cut.lcmlog: cut short or damaged after event 13", 0), 0U)
      << outcome.err;
}

}  // namespace
}  // namespace mantle::testing_tools
