#include "tools/mantle/lcm_bridge.h"

#include <gtest/gtest.h>
#include <sys/resource.h>

#include <csignal>
#include <map>
#include <stdexcept>

#include "tests/support/allocation_counter.h"
#include "tests/tools/program.h"
#include "tests/tools/telemetry_samples.h"
#include "tools/mantle/bad_input.h"

namespace mantle::testing_tools {
namespace {

using namespace tools;

constexpr int kMessagesPerSample = 10;
// A message that is there is handed out at once; what is not there is not worth more.
constexpr int kWait_ms = 1'000;

std::filesystem::path WriteLog(const std::string& folder_name, int samples) {
  const auto folder = FreshFolder(folder_name);
  auto link = OpenLcm({.log_folder = folder});
  for (int k = 0; k < samples; ++k) OctopusMessages(k).WriteTo(*link);
  link->FinishLog();
  return folder / kTelemetryLogName;
}

std::string RefusalOf(const std::function<void()>& body) {
  try {
    body();
  } catch (const BadInput& error) {
    return error.what();
  }
  return "accepted";
}

TEST(LcmBridge, MessagesPassThroughAQueueUnchanged) {
  auto link = OpenLcm({.url = "memq://", .receive = true});
  for (int k = 0; k < 3; ++k) {
    const Messages sent = OctopusMessages(k);
    sent.WriteTo(*link);
    Recorder got;
    EXPECT_EQ(link->Receive(kWait_ms, got), kMessagesPerSample);
    EXPECT_EQ(got.last, sent);
  }
  Recorder none;
  EXPECT_EQ(link->Receive(0, none), 0);
  EXPECT_EQ(link->counters().written, 3U * kMessagesPerSample);
  EXPECT_EQ(link->counters().received, 3U * kMessagesPerSample);
  EXPECT_EQ(link->counters().malformed, 0U);
  EXPECT_EQ(link->counters().publish_failures, 0U);
}

TEST(LcmBridge, MessagesPassThroughALogUnchangedWithTheirOwnTime) {
  constexpr int kSamples = 5;
  const auto file = WriteLog("lcm_round_trip", kSamples);
  int events = 0;
  Recorder got;
  const LogEnd end = ReadEventLog(file, [&](const LogEvent& event) {
    EXPECT_EQ(event.time_us, events / kMessagesPerSample * kSamplePeriod_us);
    EXPECT_TRUE(DecodeTelemetry(event.channel, event.bytes, got)) << event.channel;
    ++events;
    if (events % kMessagesPerSample == 0) {
      EXPECT_EQ(got.last, OctopusMessages(events / kMessagesPerSample - 1));
    }
  });
  EXPECT_EQ(end.events, kSamples * kMessagesPerSample);
  EXPECT_EQ(got.count, kSamples * kMessagesPerSample);
  EXPECT_FALSE(end.damaged_at_byte.has_value());
}

TEST(LcmBridge, ARobotWithoutArmsMotorsOrPlanPasses) {
  auto link = OpenLcm({.url = "memq://", .receive = true});
  const Messages empty;
  empty.WriteTo(*link);
  Recorder got;
  got.last = OctopusMessages(1);
  EXPECT_EQ(link->Receive(kWait_ms, got), kMessagesPerSample);
  EXPECT_EQ(got.last, empty);
}

TEST(LcmBridge, TheSameRunGivesTheSameBytes) {
  const std::string first = ReadFile(WriteLog("lcm_same_a", 4));
  EXPECT_GT(first.size(), 0U);
  EXPECT_EQ(first, ReadFile(WriteLog("lcm_same_b", 4)));
}

TEST(LcmBridge, EightArmsAndSixteenMotorsStayBelowADatagram) {
  const auto file = WriteLog("lcm_size", 1);
  std::map<std::string, std::size_t> size;
  ReadEventLog(file, [&](const LogEvent& event) {
    size[std::string(event.channel)] = event.bytes.size();
    EXPECT_LE(event.bytes.size(), kMaxMessage_bytes) << event.channel;
  });
  ASSERT_EQ(size.size(), static_cast<std::size_t>(kMessagesPerSample));
  // The fingerprint, utime, three counts, the knots' rows, cost, "0.n" and solve time.
  const std::size_t row = 8 * (1 + kMotors + 3 + 3 * kArms);
  EXPECT_NEAR(static_cast<double>(size["MANTLE_PLAN"]),
              static_cast<double>(8 + 8 + 12 + kKnots * row + 8 + 8 + 8), 16.0);
}

TEST(LcmBridge, AMessageBeyondADatagramIsRefusedByName) {
  auto link = OpenLcm({.log_folder = FreshFolder("lcm_too_large")});
  PlanTelemetry plan;
  plan.time.resize(200);
  plan.tension.assign(200, std::vector<double>(40));
  plan.root_position.resize(200);
  plan.tip_position.resize(200);
  EXPECT_NE(RefusalOf([&] { link->Write(plan); }).find("MANTLE_PLAN: a message of "),
            std::string::npos);
  EXPECT_EQ(link->counters().written, 0U);
}

TEST(LcmBridge, ListsOfDifferentLengthAndTextsWithZeroBytesAreRefused) {
  auto link = OpenLcm({.url = "memq://"});
  StateTelemetry state;
  state.cable_name = {"a", "b"};
  state.cable_length = state.cable_rate = {0, 0};
  state.cable_tension = {0};
  EXPECT_THROW(link->Write(state), std::invalid_argument);
  PlanTelemetry plan;
  plan.time = {0, 1};
  plan.tension = {{1, 2}, {1}};
  plan.root_position.resize(2);
  plan.tip_position.resize(2);
  EXPECT_THROW(link->Write(plan), std::invalid_argument);
  StatusTelemetry status;
  status.text = std::string("a\0b", 3);
  EXPECT_THROW(link->Write(status), std::invalid_argument);
  EXPECT_EQ(link->counters().written, 0U);
}

TEST(LcmBridge, ALogThatIsNotFinishedCanBeRead) {
  const auto folder = FreshFolder("lcm_unfinished");
  { OctopusMessages(0).WriteTo(*OpenLcm({.log_folder = folder})); }
  const LogEnd end = ReadEventLog(folder / kTelemetryLogName, [](const LogEvent&) {});
  EXPECT_EQ(end.events, kMessagesPerSample);
  EXPECT_FALSE(end.damaged_at_byte.has_value());
}

TEST(LcmBridge, AFullDiskIsSaidWhenItHappensAndLeavesWholeEvents) {
  const auto folder = FreshFolder("lcm_full");
  // A limit of the size of files stands for the disk's.
  constexpr rlim_t kLimit_bytes = 100'000;
  struct rlimit before {};
  getrlimit(RLIMIT_FSIZE, &before);
  const rlimit limit{kLimit_bytes, before.rlim_max};
  std::signal(SIGXFSZ, SIG_IGN);
  setrlimit(RLIMIT_FSIZE, &limit);
  int written = 0;
  {
    auto link = OpenLcm({.log_folder = folder});
    EXPECT_THROW(
        for (;;) {
          OctopusMessages(written).WriteTo(*link);
          ASSERT_LT(++written, 1000);
        },
        CannotGoOn);
  }
  setrlimit(RLIMIT_FSIZE, &before);
  const LogEnd end = ReadEventLog(folder / kTelemetryLogName, [](const LogEvent&) {});
  EXPECT_GT(end.events, 0);
  EXPECT_LE(end.events, (written + 1) * kMessagesPerSample);
  EXPECT_FALSE(end.damaged_at_byte.has_value());
}

TEST(LcmBridge, NoLinkIsFollowedByALog) {
  const auto folder = FreshFolder("lcm_link");
  std::ofstream(folder / "precious") << "mine\n";
  std::filesystem::create_symlink("precious", folder / kTelemetryLogName);
  OpenLcm({.log_folder = folder})->FinishLog();
  EXPECT_EQ(ReadFile(folder / "precious"), "mine\n");
}

TEST(LcmBridge, ADamagedLogIsReadUpToTheDamage) {
  const auto file = WriteLog("lcm_damaged", 3);
  const std::string whole = ReadFile(file);
  constexpr std::size_t kHeader_bytes = 28;
  std::vector<std::size_t> ends{0};
  ReadEventLog(file, [&](const LogEvent& event) {
    ends.push_back(ends.back() + kHeader_bytes + event.channel.size() + event.bytes.size());
  });
  ASSERT_EQ(ends.back(), whole.size());
  const auto expect = [&](const std::string& bytes, std::size_t events) {
    std::ofstream(file, std::ios::binary) << bytes;
    const LogEnd end = ReadEventLog(file, [](const LogEvent&) {});
    EXPECT_EQ(end.events, static_cast<std::int64_t>(events));
    EXPECT_EQ(end.damaged_at_byte, static_cast<std::int64_t>(ends[events]));
  };
  expect(whole.substr(0, ends[7] + kHeader_bytes + 100), 7);  // cut short in a message
  expect(whole.substr(0, ends[7] + 10), 7);                   // cut short in a header
  expect(whole.substr(0, ends[7]) + "foreign", 7);
  expect(std::string(whole).replace(ends[7], 1, "x"), 7);  // a damaged sync word
  expect("no log", 0);
  std::ofstream(file, std::ios::binary) << whole.substr(0, ends[7]);
  EXPECT_FALSE(ReadEventLog(file, [](const LogEvent&) {}).damaged_at_byte.has_value());
  EXPECT_THROW(ReadEventLog(file.parent_path(), [](const LogEvent&) {}), BadInput);
}

TEST(LcmBridge, BytesThatAreNoMessageAreRefused) {
  const auto file = WriteLog("lcm_malformed", 1);
  Recorder got;
  ReadEventLog(file, [&](const LogEvent& event) {
    std::vector<std::uint8_t> bytes(event.bytes.begin(), event.bytes.end());
    EXPECT_FALSE(DecodeTelemetry("SOMEBODY_ELSE", bytes, got));
    for (std::size_t size = 0; size < bytes.size(); size += 1 + size / 8) {
      EXPECT_FALSE(DecodeTelemetry(event.channel, {bytes.data(), size}, got)) << size;
    }
    bytes.push_back(0);
    EXPECT_FALSE(DecodeTelemetry(event.channel, bytes, got)) << "longer than its type";
    bytes.pop_back();
    bytes[3] = static_cast<std::uint8_t>(~bytes[3]);
    EXPECT_FALSE(DecodeTelemetry(event.channel, bytes, got)) << "another type's fingerprint";
    if (event.channel != "MANTLE_REDUCED_STATE") return;
    bytes[3] = static_cast<std::uint8_t>(~bytes[3]);
    constexpr std::size_t kNumQ = 8 + 8 + 7 * 8;  // behind fingerprint, utime and the root's pose
    bytes[kNumQ] = 0xFF;                          // a negative count
    EXPECT_FALSE(DecodeTelemetry(event.channel, bytes, got));
  });
  EXPECT_EQ(got.count, 0);
}

TEST(LcmBridge, WrongAddressesAreRefusedWithWhatToType) {
  for (const char* url : {"udp:239.74.163.2:43113", "file://run.lcmlog", "nonsense"}) {
    const std::string says = RefusalOf([&] { OpenLcm({.url = url}); });
    EXPECT_EQ(says.rfind(std::string("--lcm: ") + url + ": must be udpm://", 0), 0U) << says;
  }
  const std::string port = RefusalOf([] { OpenLcm({.url = "udpm://239.255.76.67:99999"}); });
  EXPECT_NE(port.find("99999: cannot be opened: must be udpm://"), std::string::npos) << port;
  const std::string says =
      RefusalOf([] { OpenLcm({.log_folder = std::filesystem::path("/nonexistent/folder")}); });
  EXPECT_NE(says.find("cannot be written"), std::string::npos) << says;
}

TEST(LcmBridge, LoggingAllocatesNothingOnceItKnowsTheSizes) {
  if (!tests::kCountsAllocations) GTEST_SKIP() << "a sanitizer counts here";
  auto link = OpenLcm({.log_folder = FreshFolder("lcm_allocation")});
  const Messages messages = OctopusMessages(7);
  messages.WriteTo(*link);
  const long before = tests::allocation_count;
  for (int k = 0; k < 10; ++k) messages.WriteTo(*link);
  EXPECT_EQ(tests::allocation_count - before, 0);
}

}  // namespace
}  // namespace mantle::testing_tools
