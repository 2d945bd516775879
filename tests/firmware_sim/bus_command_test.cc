#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>

#include "firmware_sim/bus/candump_log.h"
#include "tests/firmware_sim/frames.h"
#include "tests/firmware_sim/vcan.h"
#include "tests/support/paths.h"

// The program `mantle bus`, as a user types it.

namespace mantle::firmware_sim {
namespace {

const std::string kMantle = tests::BinaryPath("mantle");

struct Outcome {
  int status;
  std::string text;  ///< stdout and stderr
};

Outcome MantleBus(const std::string& arguments) {
  const std::string command = kMantle + " bus " + arguments + " 2>&1";
  FILE* pipe = popen(command.c_str(), "r");
  Outcome outcome{};
  char chunk[512];
  for (std::size_t size = 0; (size = fread(chunk, 1, sizeof(chunk), pipe)) > 0;) {
    outcome.text.append(chunk, size);
  }
  outcome.status = WEXITSTATUS(pclose(pipe));
  return outcome;
}

TEST(BusCommand, LoadIsTheHandCount) {
  const Outcome outcome = MantleBus("load --nodes 8 --period-ms 10 --heartbeat-ms 0 --json");
  ASSERT_EQ(outcome.status, 0);
  const auto json = nlohmann::json::parse(outcome.text);
  EXPECT_EQ(json["frames"], 33);
  EXPECT_EQ(json["worst_bits"], 55 + 8 * (135 + 125 + 135 + 135));
  EXPECT_EQ(json["least_bits"], 47 + 8 * (111 + 103 + 111 + 111));
  EXPECT_FALSE(json["warn"]);
  EXPECT_NE(MantleBus("load --nodes 8 --period-ms 5").text.find("WARNING"), std::string::npos);
}

TEST(BusCommand, BadInputIsStatusTwoAndOneLineWithValueAndBound) {
  for (const auto& [arguments, line] : {
           std::pair{"load --nodes 0",
                     "mantle bus load: number of drives is 0, must be 1 to 126\n"},
           {"load --period-ms -1", "mantle bus load: --period-ms is -1, must be 0.1 to 10000\n"},
           {"load --pdos 3",
            "mantle bus load: --pdos is 3, must be 4 (RPDO1, RPDO2, TPDO1, TPDO2) or 2 (RPDO1, "
            "TPDO1)\n"},
           {"monitor --bus can:nosuchif0",
            "mantle bus monitor: CAN interface 'nosuchif0': No such device\n"},
           {"monitor --bus udp:239.74.163.2:43113@lo --duration -3",
            "mantle bus monitor: --duration is -3 s, must be 0 or more\n"},
           {"play /nonexistent.log --bus udp:239.74.163.2:43113@lo",
            "mantle bus play: log file '/nonexistent.log' cannot be read: no such file\n"},
       }) {
    const Outcome outcome = MantleBus(arguments);
    EXPECT_EQ(outcome.status, 2) << arguments;
    // A kernel without CAN says so in its own words.
    if (std::string(arguments).find("can:") == std::string::npos) {
      EXPECT_EQ(outcome.text, line);
    }
    EXPECT_EQ(std::count(outcome.text.begin(), outcome.text.end(), '\n'), 1) << outcome.text;
  }
}

TEST(BusCommand, WhatIsPlayedIsMonitoredAndRecorded) {
  const std::string folder = ::testing::TempDir();
  const std::string log = folder + "mantle_bus_command_test.log";
  const std::string recorded = folder + "mantle_bus_command_test_recorded.log";
  const std::string output = folder + "mantle_bus_command_test.out";
  const std::string spec = "udp:239.74.163.2:" + std::to_string(20000 + getpid() % 20000) + "@lo";
  {
    CandumpWriter writer(log, "vcan0");
    for (int i = 0; i < 50; ++i) {
      writer.Write(DataFrame(0x181, {0x37, 0x12, 0x64, 0, i, 0, 0, 0}, 1'000'000 + i * 1000));
    }
    ASSERT_TRUE(writer.Flush());
  }
  Process monitor({kMantle, "bus", "monitor", "--bus", spec, "--duration", "1.5", "--json",
                   "--record", recorded},
                  output);
  SleepFor(500'000);  // it says nothing when it is ready
  const Outcome played = MantleBus("play " + log + " --bus " + spec);
  EXPECT_EQ(played.status, 0);
  EXPECT_EQ(played.text, "50 frames sent, 0 refused by the bus, 0 CAN FD frames skipped\n");
  EXPECT_EQ(monitor.Wait(), 0);

  std::ifstream recording(recorded);
  const CandumpLog back = ReadCandumpLog(recording);
  ASSERT_EQ(back.frames.size(), 50U);
  for (int i = 0; i < 50; ++i) EXPECT_EQ(back.frames[i].data[4], i);
  std::ifstream lines(output);
  int frames = 0;
  nlohmann::json last;
  for (std::string line; std::getline(lines, line);) {
    last = nlohmann::json::parse(line);
    if (last["type"] != "frame") continue;
    EXPECT_EQ(last["service"], "TPDO1");
    EXPECT_EQ(last["state"], "operation enabled");
    EXPECT_EQ(last["torque_percent"], 10.0);
    EXPECT_EQ(last["position_counts"], frames++);
  }
  EXPECT_EQ(frames, 50);
  EXPECT_EQ(last["type"], "summary");
  EXPECT_EQ(last["services"]["TPDO1"], 50);
}

}  // namespace
}  // namespace mantle::firmware_sim
