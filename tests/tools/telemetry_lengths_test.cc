#include "tools/mantle/telemetry_lengths.h"

#include <gtest/gtest.h>
#include <sys/resource.h>

#include <map>
#include <random>
#include <vector>

#include "tests/tools/program.h"
#include "tests/tools/telemetry_samples.h"
#include "tools/mantle/lcm_bridge.h"

namespace mantle::testing_tools {
namespace {

using namespace tools;
using Bytes = std::vector<std::uint8_t>;

constexpr std::size_t kFingerprint_bytes = 8;

// One message of every type, encoded.
std::map<std::string, Bytes> EncodedMessages(const std::string& folder_name) {
  const auto folder = FreshFolder(folder_name);
  auto link = OpenLcm({.log_folder = folder});
  OctopusMessages(3).WriteTo(*link);
  link->FinishLog();
  std::map<std::string, Bytes> messages;
  ReadEventLog(folder / kTelemetryLogName, [&](const LogEvent& event) {
    messages[std::string(event.channel)] = {event.bytes.begin(), event.bytes.end()};
  });
  return messages;
}

TEST(TelemetryLengths, EveryEncodedMessageFitsAndNoneThatIsLongerOrShorter) {
  for (const auto& [channel, bytes] : EncodedMessages("lengths")) {
    Recorder got;
    EXPECT_TRUE(DecodeTelemetry(channel, bytes, got)) << channel;
    Bytes other = bytes;
    other.push_back(0);
    EXPECT_FALSE(DecodeTelemetry(channel, other, got)) << channel;
    for (std::size_t size = 0; size < bytes.size(); ++size) {
      EXPECT_FALSE(DecodeTelemetry(channel, {bytes.data(), size}, got)) << channel << " " << size;
    }
  }
}

TEST(TelemetryLengths, ACountOrLengthBeyondTheMessageIsNamed) {
  // Behind fingerprint and utime: the length of STATUS's first text; counts of PLAN and DRIVES.
  auto messages = EncodedMessages("lengths_lying");
  for (const char* channel : {"MANTLE_STATUS", "MANTLE_PLAN", "MANTLE_DRIVES"}) {
    for (const int high : {0x7F, 0x80, 0xFF}) {
      Bytes bytes = messages[channel];
      bytes[kFingerprint_bytes + 8] = static_cast<std::uint8_t>(high);
      Recorder got;
      const char* why = "";
      EXPECT_FALSE(DecodeTelemetry(channel, bytes, got, &why));
      EXPECT_STREQ(why, "a length beyond the message");
    }
  }
}

TEST(TelemetryLengths, MutatedMessagesNeitherCrashNorAllocateBeyondTheCap) {
  // What a decoder that believes a count would need is far above this.
  constexpr rlim_t kCap_bytes = rlim_t{1} << 30;
  const auto messages = EncodedMessages("lengths_fuzz");
#if !defined(__SANITIZE_ADDRESS__)
  struct rlimit before {};
  getrlimit(RLIMIT_AS, &before);
  const rlimit cap{kCap_bytes, before.rlim_max};
  setrlimit(RLIMIT_AS, &cap);
#endif
  constexpr int kMutants = 4'000;
  std::mt19937 random(2718);
  Recorder got;
  int decoded = 0;
  for (int i = 0; i < kMutants; ++i) {
    for (const auto& [channel, original] : messages) {
      Bytes bytes = original;
      const auto draw = [&](std::size_t below) { return random() % below; };
      // Near the front, where the counts are, as often as anywhere.
      const std::size_t range =
          draw(2) == 0 ? std::min<std::size_t>(bytes.size(), 64) : bytes.size();
      for (std::size_t k = 0, many = 1 + draw(3); k < many; ++k) {
        const std::size_t at = kFingerprint_bytes + draw(range - kFingerprint_bytes);
        bytes[at] = draw(2) == 0 ? static_cast<std::uint8_t>(random())
                                 : static_cast<std::uint8_t>(bytes[at] ^ (1U << draw(8)));
      }
      if (draw(8) == 0) bytes.resize(draw(bytes.size() + 1));
      decoded += DecodeTelemetry(channel, bytes, got) ? 1 : 0;
    }
  }
#if !defined(__SANITIZE_ADDRESS__)
  setrlimit(RLIMIT_AS, &before);
#endif
  EXPECT_GT(decoded, kMutants) << "changed numbers alone are still messages";
}

TEST(TelemetryLengths, DamagedLogsAreReadToTheirDamageUnderACap) {
  const auto folder = FreshFolder("lengths_logs");
  auto link = OpenLcm({.log_folder = folder});
  for (int k = 0; k < 3; ++k) OctopusMessages(k).WriteTo(*link);
  link->FinishLog();
  const std::string whole = ReadFile(folder / kTelemetryLogName);
  constexpr int kLogs = 300;
  std::mt19937 random(314);
  for (int i = 0; i < kLogs; ++i) {
    std::string bytes = whole;
    for (int k = 0; k < 4; ++k) bytes[random() % bytes.size()] = static_cast<char>(random());
    if (i % 3 == 0) bytes[random() % 28] = '\xFF';  // the first header
    if (i % 2 == 0) bytes.resize(random() % (bytes.size() + 1));
    const auto file = folder / "damaged.lcmlog";
    std::ofstream(file, std::ios::binary) << bytes;
    Recorder got;
    std::size_t handed_out = 0;
    const LogEnd end = ReadEventLog(file, [&](const LogEvent& event) {
      handed_out += event.bytes.size();
      DecodeTelemetry(event.channel, event.bytes, got);
    });
    EXPECT_LE(handed_out, bytes.size());
    EXPECT_LE(end.damaged_at_byte.value_or(0), static_cast<long>(bytes.size()));
  }
}

TEST(TelemetryLengths, TheProgramRefusesALengthBeyondTheMessageAndALogThatIsNoFile) {
  const auto folder = FreshFolder("lengths_program");
  const Outcome lying =
      Mantle(folder, "log '" + tests::SourcePath("tests/tools/lying_length.lcmlog") +
                         "' --channel "
                         "MANTLE_STATUS --csv");
  EXPECT_EQ(lying.status, 2);
  EXPECT_NE(lying.err.find("1 of 1 messages of MANTLE_STATUS are not of its type: a length "
                           "beyond the message"),
            std::string::npos)
      << lying.err;
  for (const std::string file : {"/dev/zero", "fifo", "."}) {
    if (file == "fifo") mkfifo((folder / "fifo").c_str(), 0600);
    const Outcome outcome = Mantle(folder, "log " + file);
    EXPECT_EQ(outcome.status, 2) << file;
    EXPECT_NE(outcome.err.find("must be an LCM event log"), std::string::npos) << outcome.err;
  }
}

}  // namespace
}  // namespace mantle::testing_tools
