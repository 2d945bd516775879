#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cstring>

#include "tests/firmware_sim/vcan.h"
#include "tests/support/paths.h"
#include "tests/tools/program.h"
#include "tests/tools/telemetry_samples.h"
#include "tools/mantle/lcm_bridge.h"

// The network: ttl=0, so that nothing leaves this machine.

namespace mantle::testing_tools {
namespace {

using namespace tools;

constexpr const char* kGroup = "239.255.76.67";
constexpr int kSamples = 20;
constexpr int kMessages = 7 * kSamples;
// A replay of 0.2 s on a machine that does other things as well.
constexpr std::int64_t kPatience_us = 20'000'000;

// A port of this process and its children, so that runs side by side do not hear each other.
const int kPort = 20'000 + getpid() % 20'000;

std::string Url() { return fmt::format("udpm://{}:{}?ttl=0", kGroup, kPort); }

constexpr const char* kNoMulticast =
    "this machine does not hear its own multicast (a route? ip route add 224.0.0.0/4 dev lo)";

// Whether this machine takes its own multicast back, asked of the kernel alone.
bool MulticastWorks() {
  const int fd = socket(AF_INET, SOCK_DGRAM, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<std::uint16_t>(kPort));
  inet_pton(AF_INET, kGroup, &address.sin_addr);
  ip_mreq membership{address.sin_addr, {htonl(INADDR_ANY)}};
  const unsigned char ttl = 0;
  const char text[] = "mantle";
  const auto* to = reinterpret_cast<const sockaddr*>(&address);
  pollfd waits{fd, POLLIN, 0};
  constexpr int kWait_ms = 2'000;
  const bool works =
      bind(fd, to, sizeof address) == 0 &&
      setsockopt(fd, IPPROTO_IP, IP_ADD_MEMBERSHIP, &membership, sizeof membership) == 0 &&
      setsockopt(fd, IPPROTO_IP, IP_MULTICAST_TTL, &ttl, sizeof ttl) == 0 &&
      sendto(fd, text, sizeof text, 0, to, sizeof address) == sizeof text &&
      poll(&waits, 1, kWait_ms) == 1;
  close(fd);
  return works;
}

std::filesystem::path WriteLog(const std::filesystem::path& folder) {
  auto link = OpenLcm({.log_folder = folder});
  for (int k = 0; k < kSamples; ++k) OctopusMessages(k).WriteTo(*link);
  link->FinishLog();
  return folder / kTelemetryLogName;
}

void ReceiveAll(LcmLink& link, TelemetrySink& to, int messages = kMessages) {
  constexpr int kSlice_ms = 20;
  int received = 0;
  firmware_sim::WaitUntil([&] { return (received += link.Receive(kSlice_ms, to)) >= messages; },
                          kPatience_us);
}

TEST(LcmReplay, ALogPlayedByLcmsOwnPlayerArrivesByteForByte) {
  if (!MulticastWorks()) GTEST_SKIP() << kNoMulticast;
  const auto folder = FreshFolder("lcm_replay");
  const auto file = WriteLog(folder);
  auto network = OpenLcm({.url = Url(), .receive = true});
  // What arrives is logged again: the same bytes mean the same messages in the same order.
  const auto again = folder / "again";
  std::filesystem::create_directory(again);
  auto second_log = OpenLcm({.log_folder = again});
  firmware_sim::Process player({MANTLE_LCM_LOGPLAYER, "--lcm-url=" + Url(), file.string()},
                               folder / "player.txt");
  ReceiveAll(*network, *second_log);
  EXPECT_EQ(player.Wait(), 0);
  second_log->FinishLog();
  EXPECT_EQ(network->counters().received, static_cast<std::uint64_t>(kMessages));
  EXPECT_EQ(network->counters().malformed, 0U);
  EXPECT_EQ(ReadFile(again / kTelemetryLogName), ReadFile(file));
}

TEST(LcmReplay, WhatARunPublishesAnotherProcessHears) {
  if (!MulticastWorks()) GTEST_SKIP() << kNoMulticast;
  auto network = OpenLcm({.url = Url(), .receive = true});
  firmware_sim::Process sender([] {
    auto link = OpenLcm({.url = Url()});
    for (int k = 0; k < kSamples; ++k) {
      OctopusMessages(k).WriteTo(*link);
      firmware_sim::SleepFor(kSamplePeriod_us);
    }
    if (link->counters().publish_failures > 0) _exit(1);
  });
  Recorder got;
  ReceiveAll(*network, got);
  EXPECT_EQ(sender.Wait(), 0);
  EXPECT_EQ(got.count, kMessages);
  EXPECT_EQ(got.last, OctopusMessages(kSamples - 1));
}

TEST(LcmReplay, WhatAClosedLoopPublishesIsWhatItLogs) {
  if (!MulticastWorks()) GTEST_SKIP() << kNoMulticast;
  const auto folder = FreshFolder("lcm_closed_loop");
  const auto again = folder / "again";
  std::filesystem::create_directory(again);
  auto second_log = OpenLcm({.log_folder = again});
  auto network = OpenLcm({.url = Url(), .receive = true});
  firmware_sim::Process run(
      {tests::BinaryPath("mantle"), "run", tests::SourcePath("scenes/steer.toml"), "--set",
       "time.duration=1", "--lcm", Url(), "--out", (folder / "out").string()},
      folder / "run.txt");
  constexpr int kRows = 51, kPlans = 20;
  ReceiveAll(*network, *second_log, 6 * kRows + kPlans);
  EXPECT_EQ(run.Wait(), 0);
  second_log->FinishLog();
  EXPECT_EQ(network->counters().received, static_cast<std::uint64_t>(6 * kRows + kPlans));
  EXPECT_EQ(ReadFile(again / kTelemetryLogName), ReadFile(folder / "out" / kTelemetryLogName));
}

}  // namespace
}  // namespace mantle::testing_tools
