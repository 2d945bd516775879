#include <gtest/gtest.h>

#include "tests/firmware_sim/vcan.h"
#include "tests/support/paths.h"
#include "tests/tools/multicast.h"
#include "tests/tools/program.h"
#include "tests/tools/telemetry_samples.h"
#include "tools/mantle/lcm_bridge.h"

// The network: ttl=0, so that nothing leaves this machine.

namespace mantle::testing_tools {
namespace {

using namespace tools;

constexpr int kSamples = 20;
constexpr int kMessages = 10 * kSamples;
// A replay of 0.2 s on a machine that does other things as well.
constexpr std::int64_t kPatience_us = 20'000'000;

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

/// What a run says but does not log (SessionTelemetry) is left out.
class WithoutSessions final : public TelemetrySink {
 public:
  explicit WithoutSessions(TelemetrySink& to) : to_(to) {}
  void Write(const StateTelemetry& m) override { to_.Write(m); }
  void Write(const ReducedStateTelemetry& m) override { to_.Write(m); }
  void Write(const PlanTelemetry& m) override { to_.Write(m); }
  void Write(const DrivesTelemetry& m) override { to_.Write(m); }
  void Write(const EnergyTelemetry& m) override { to_.Write(m); }
  void Write(const StatusTelemetry& m) override { to_.Write(m); }
  void Write(const ShapeTelemetry& m) override { to_.Write(m); }
  void Write(const ControlTelemetry& m) override { to_.Write(m); }
  void Write(const WaterTelemetry& m) override { to_.Write(m); }
  void Write(const SessionTelemetry& m) override { sessions.push_back(m); }
  std::vector<SessionTelemetry> sessions;

 private:
  TelemetrySink& to_;
};

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
  constexpr int kRows = 51, kPlans = 20, kSessions = 2;
  WithoutSessions logged(*second_log);
  ReceiveAll(*network, logged, 8 * kRows + kPlans + kSessions);
  EXPECT_EQ(run.Wait(), 0);
  second_log->FinishLog();
  EXPECT_EQ(network->counters().received,
            static_cast<std::uint64_t>(8 * kRows + kPlans + kSessions));
  ASSERT_EQ(logged.sessions.size(), kSessions);
  EXPECT_EQ(logged.sessions[0].scene, "steer");
  EXPECT_EQ(logged.sessions[0].results, (folder / "out").string());
  EXPECT_EQ(ReadFile(again / kTelemetryLogName), ReadFile(folder / "out" / kTelemetryLogName));
}

}  // namespace
}  // namespace mantle::testing_tools
