#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <fstream>
#include <iostream>
#include <map>
#include <random>
#include <sstream>
#include <string>

#include "firmware_sim/bus/candump_log.h"
#include "firmware_sim/bus/open_bus.h"
#include "firmware_sim/bus/wire.h"
#include "tests/firmware_sim/frames.h"
#include "tests/firmware_sim/real_time_master.h"
#include "tests/firmware_sim/vcan.h"
#include "tests/support/paths.h"

// `mantle drives` in a process of its own, on vcan0, with our master and with can-utils. Run where
// vcan0 exists: tools/vcan_run build/tests/test_firmware_sim_vcan_drives

namespace mantle::firmware_sim {
namespace {

constexpr std::int64_t kSecond_us = 1'000'000;
constexpr std::int16_t kTorque_permille = 100;
const char* const kSpec = "can:vcan0";

class VcanDrives : public ::testing::Test {
 protected:
  void SetUp() override {
    ASSERT_TRUE(HasVcan()) << "no vcan0; run this through tools/vcan_run";
    Shell(
        "ip link show vcan0 >/dev/null 2>&1 || ip link add dev vcan0 type vcan; "
        "ip link set vcan0 up");
  }

  static std::vector<std::string> DrivesCommand(int count, int first_node = 1) {
    return {tests::BinaryPath("mantle"),
            "drives",
            "--bus",
            kSpec,
            "--nodes",
            std::to_string(count),
            "--first-node",
            std::to_string(first_node)};
  }

  static void SetTorque(Master& master, std::int16_t torque_permille) {
    for (std::size_t i = 0; i < master.drive_count(); ++i) {
      master.SetTarget(i, {.torque_permille = torque_permille});
    }
  }

  std::string ReadFile(const std::string& path) {
    std::ostringstream text;
    text << std::ifstream(path).rdbuf();
    return text.str();
  }

  std::string output_ = ::testing::TempDir() + "mantle_vcan_drives_test.out";
};

void PrintDistribution(const char* name, std::vector<std::int64_t> values) {
  ASSERT_FALSE(values.empty());
  std::sort(values.begin(), values.end());
  const auto at = [&](double share) {
    return values[static_cast<std::size_t>(share * static_cast<double>(values.size() - 1))];
  };
  std::cout << fmt::format(
      "{}: {} cycles, min {} us, median {} us, p90 {} us, p99 {} us, p99.9 {} us, max {} us\n",
      name, values.size(), at(0), at(0.5), at(0.9), at(0.99), at(0.999), at(1));
}

TEST_F(VcanDrives, EightDrivesFollowTorqueAt100HzFor10SecondsAndNoFrameIsLost) {
  Process drives(DrivesCommand(8), output_);
  RealTimeMaster rig(kSpec, PatientNodesOneTo(8));
  rig.Enable();
  ASSERT_TRUE(rig.RunUntilEnabled()) << Describe(rig.master);
  std::array<std::uint64_t, 8> before{};
  for (std::size_t i = 0; i < 8; ++i) before[i] = rig.master.drive(i).tpdo1_count;
  const std::uint64_t cycles_before = rig.master.counters().cycles;
  rig.measure = true;
  constexpr std::uint64_t kCycles = 1000;
  const auto cycles = [&] { return rig.master.counters().cycles - cycles_before; };
  ASSERT_TRUE(rig.RunUntil(
      [&] {
        SetTorque(rig.master, static_cast<std::int16_t>(kTorque_permille + cycles() / 10));
        return cycles() == kCycles;
      },
      30 * kSecond_us));
  // The last answers.
  SleepFor(kSecond_us / 10);
  rig.master.Poll(MonotonicTime_us());
  std::uint64_t late = 0;
  for (std::size_t i = 0; i < 8; ++i) {
    const DriveReport& drive = rig.master.drive(i);
    EXPECT_EQ(drive.step, DriveStep::kEnabled) << Describe(drive);
    // The cycle under way when counting began may add one.
    EXPECT_GE(drive.tpdo1_count - before[i], kCycles);
    EXPECT_LE(drive.tpdo1_count - before[i], kCycles + 1);
    EXPECT_EQ(drive.tpdo1_count, drive.tpdo2_count);
    late += drive.tpdo1_late;
    EXPECT_GT(drive.torque_permille, kTorque_permille / 2);
  }
  EXPECT_EQ(rig.bus->counters().receive_dropped, 0U);
  EXPECT_EQ(rig.bus->counters().send_dropped, 0U);
  PrintDistribution("from SYNC to the last of 8 TPDO1", rig.answer_us);
  std::cout << fmt::format("{} of {} TPDO1 came after the next SYNC\n", late, 8 * kCycles);
  PrintDistribution("cycle late against its grid", rig.late_us);
  rig.Stop();
  EXPECT_TRUE(rig.RunUntil([&] { return rig.master.stopped(); }, 10 * kSecond_us));
  EXPECT_TRUE(rig.master.AllIn(DriveStep::kStopped)) << Describe(rig.master);
}

TEST_F(VcanDrives, CansendCommandsThemAndCandumpSeesTheAnswers) {
  Process candump({"candump", "-L", "vcan0"}, output_);
  SleepFor(kSecond_us / 5);
  Process drives(DrivesCommand(2), output_ + ".drives");
  auto ears = OpenBus(kSpec);
  ASSERT_GE(DrainUntil(*ears, 2, 5 * kSecond_us).size(), 2U);  // boot-up messages
  for (const char* frame : {"601#4000100000000000", "601#4034120000000000", "000#0101", "080#",
                            "202#0600000000000000", "000#8102"}) {
    Shell(std::string("cansend vcan0 ") + frame);
    SleepFor(kSecond_us / 20);
  }
  SleepFor(kSecond_us / 5);
  candump.Signal(SIGINT);
  candump.Wait();
  const std::string log = ReadFile(output_);
  EXPECT_NE(log.find(" 701#00"), std::string::npos) << log;                // boot-up
  EXPECT_NE(log.find(" 581#4300100092010200"), std::string::npos) << log;  // device type
  EXPECT_NE(log.find(" 581#8034120000000206"), std::string::npos) << log;  // no such object
  EXPECT_NE(log.find(" 181#"), std::string::npos) << log;                  // node 1 answers SYNC
  EXPECT_EQ(log.find(" 182#"), std::string::npos) << log;                  // node 2 is not started
  // Boot-up of node 2 again, after its reset.
  const std::size_t first = log.find(" 702#00");
  ASSERT_NE(first, std::string::npos) << log;
  EXPECT_NE(log.find(" 702#00", first + 1), std::string::npos) << log;
}

TEST_F(VcanDrives, TheMonitorSaysWhatHappensInWordsAndRecordsIt) {
  const std::string record = output_ + ".log";
  Process monitor({tests::BinaryPath("mantle"), "bus", "monitor", "--bus", kSpec, "--duration", "3",
                   "--record", record},
                  output_);
  SleepFor(kSecond_us / 3);  // it says nothing when it is ready
  Process drives(DrivesCommand(2), output_ + ".drives");
  RealTimeMaster rig(kSpec, PatientNodesOneTo(2));
  rig.RunFor(kSecond_us / 2);
  rig.Enable();
  ASSERT_TRUE(rig.RunUntilEnabled()) << Describe(rig.master);
  rig.RunFor(kSecond_us / 2);
  Shell("cansend vcan0 601#2F01220002000000");  // break the encoder line of drive 1
  rig.RunFor(4 * kSecond_us);
  EXPECT_EQ(monitor.Wait(), 0);
  const std::string text = ReadFile(output_);
  for (const char* line :
       {"SDO request node 1: read 1000:00 Device type",
        "SDO reply node 1: read 1000:00 Device type = 131474 (0x00020192)", "NMT node 1: start",
        "RPDO1 node 2: enable operation", "TPDO1 node 2: operation enabled",
        "EMCY node 1: 0x7320 encoder fault", "heartbeat node 127: operational", "% of 1 Mbit/s"}) {
    EXPECT_NE(text.find(line), std::string::npos) << line;
  }
  EXPECT_NE(text.find("bus load"), std::string::npos);
  std::ifstream in(record);
  EXPECT_GT(ReadCandumpLog(in).frames.size(), 500U);
}

TEST_F(VcanDrives, AKilledMasterLeavesEveryDriveInFaultInTime) {
  Process drives(DrivesCommand(8), output_);
  auto ears = OpenBus(kSpec);
  Process master([] {
    RealTimeMaster rig(kSpec, NodesOneTo(8));
    rig.Enable();
    rig.RunUntil(
        [&] {
          SetTorque(rig.master, 3 * kTorque_permille);
          return false;
        },
        60 * kSecond_us);
  });
  // Wait until all pull.
  std::int64_t last_heartbeat_us = 0;
  std::map<std::uint32_t, int> torque_of;
  ASSERT_TRUE(WaitUntil(
      [&] {
        for (const CanFrame& frame : Drain(*ears)) {
          if (frame.id == CobHeartbeat(kMasterNode)) last_heartbeat_us = frame.time_us;
          if ((frame.id & 0x780U) == 0x180 && frame.size == 8) {
            torque_of[frame.id] = static_cast<std::int16_t>(LoadLe(&frame.data[2], 2));
          }
        }
        return torque_of.size() == 8 &&
               std::all_of(torque_of.begin(), torque_of.end(),
                           [](auto& one) { return one.second > 2 * kTorque_permille; });
      },
      20 * kSecond_us));
  master.Signal(SIGKILL);
  EXPECT_EQ(master.Wait(), 128 + SIGKILL);

  std::map<std::uint32_t, std::int64_t> emcy_us;
  WaitUntil(
      [&] {
        for (const CanFrame& frame : Drain(*ears)) {
          if (frame.id == CobHeartbeat(kMasterNode)) last_heartbeat_us = frame.time_us;
          if ((frame.id & 0x780U) == 0x080 && frame.size == 8 &&
              LoadLe(&frame.data[0], 2) == 0x8130) {
            emcy_us.try_emplace(frame.id, frame.time_us);
          }
        }
        return emcy_us.size() == 8;
      },
      2 * kSecond_us);
  ASSERT_EQ(emcy_us.size(), 8U);
  // 200 ms in 1016 and a period of 10 ms; the rest is scheduling: on a machine with more work than
  // processors 40 ms were seen.
  constexpr std::int64_t kPatience_us = 210'000;
  constexpr std::int64_t kScheduling_us = 100'000;
  std::int64_t slowest_us = 0;
  for (const auto& [id, time_us] : emcy_us) {
    slowest_us = std::max(slowest_us, time_us - last_heartbeat_us);
  }
  std::cout << fmt::format("last heartbeat to the last of 8 EMCY 8130: {} us\n", slowest_us);
  EXPECT_LE(slowest_us, kPatience_us + kScheduling_us);

  // Nobody sends SYNC: the drives end in fault without torque by their own clock, as SDO tells.
  SleepFor(2 * kSecond_us);
  Drain(*ears);
  for (NodeId node = 1; node <= 8; ++node) {
    const CanFrame requests[] = {DataFrame(CobSdoRequest(node), {0x40, 0x41, 0x60, 0, 0, 0, 0, 0}),
                                 DataFrame(CobSdoRequest(node), {0x40, 0x77, 0x60, 0, 0, 0, 0, 0})};
    ears->Send(requests);
  }
  int faults = 0;
  int at_rest = 0;
  for (const CanFrame& frame : DrainUntil(*ears, 24)) {
    if ((frame.id & 0x780U) != 0x580) continue;
    const auto value = static_cast<std::uint16_t>(LoadLe(&frame.data[4], 2));
    if (LoadLe(&frame.data[1], 2) == object::kStatusword) {
      faults += DecodeState(value) == DriveState::kFault ? 1 : 0;
    } else {
      at_rest += std::abs(static_cast<std::int16_t>(value)) < 20 ? 1 : 0;
    }
  }
  EXPECT_EQ(faults, 8);
  EXPECT_EQ(at_rest, 8);

  // A new master must ask for it, then they come back.
  RealTimeMaster rig(kSpec, NodesOneTo(8));
  rig.RunFor(kSecond_us);
  EXPECT_FALSE(rig.master.enabled());
  rig.Enable();
  EXPECT_TRUE(rig.RunUntilEnabled()) << Describe(rig.master);
  EXPECT_TRUE(drives.Running());
}

TEST_F(VcanDrives, LinkDownUpAndDeletionAreRecoveredWithoutRestart) {
  Process drives(DrivesCommand(4), output_);
  RealTimeMaster rig(kSpec, NodesOneTo(4));
  rig.Enable();
  ASSERT_TRUE(rig.RunUntilEnabled()) << Describe(rig.master);
  SetTorque(rig.master, kTorque_permille);
  rig.RunFor(kSecond_us / 2);
  for (const char* outage :
       {"ip link set vcan0 down; sleep 0.6; ip link set vcan0 up",
        "ip link del vcan0; sleep 0.6; ip link add dev vcan0 type vcan; ip link set vcan0 up"}) {
    Process breaking({"sh", "-c", outage});
    ASSERT_TRUE(rig.RunUntil([&] { return !breaking.Running(); }, 10 * kSecond_us));
    rig.RunFor(kSecond_us);
    for (std::size_t i = 0; i < 4; ++i) {
      EXPECT_EQ(rig.master.drive(i).step, DriveStep::kFaulted) << Describe(rig.master.drive(i));
    }
    rig.Enable();
    ASSERT_TRUE(rig.RunUntilEnabled()) << outage << "\n" << Describe(rig.master);
    SetTorque(rig.master, kTorque_permille);
    rig.RunFor(kSecond_us / 2);
    EXPECT_TRUE(rig.master.enabled()) << Describe(rig.master);
  }
  EXPECT_GE(rig.bus->counters().recoveries, 2U);
  EXPECT_TRUE(drives.Running());
}

TEST_F(VcanDrives, AFloodEnablesNothingAndLeavesNothingBroken) {
  Process drives(DrivesCommand(8), output_);
  auto flood = OpenBus(kSpec);
  ASSERT_GE(DrainUntil(*flood, 8, 5 * kSecond_us).size(), 8U);
  // Random frames at full rate while nobody has started the drives. NMT is left out: a start
  // command is a start command, whoever sends it.
  std::mt19937 random(17);
  constexpr int kBatches = 2000;
  for (int batch = 0; batch < kBatches; ++batch) {
    std::array<CanFrame, 64> frames;
    for (CanFrame& frame : frames) {
      frame = {};
      frame.id = 1 + static_cast<std::uint32_t>(random()) % 0x7FF;
      frame.size = static_cast<std::uint8_t>(random() % 9);
      for (auto& byte : frame.data) byte = static_cast<std::uint8_t>(random());
    }
    flood->Send(frames);
  }
  Shell("cangen vcan0 -g 0 -I 201 -L 8 -D i -n 20000");
  Shell("cangen vcan0 -g 0 -I 080 -L 0 -n 20000");
  ASSERT_TRUE(drives.Running());
  SleepFor(kSecond_us);
  // `mantle drives` tells every change of state.
  EXPECT_EQ(ReadFile(output_).find("operation enabled"), std::string::npos) << ReadFile(output_);

  RealTimeMaster rig(kSpec, PatientNodesOneTo(8));
  rig.Enable();
  ASSERT_TRUE(rig.RunUntilEnabled(20 * kSecond_us)) << Describe(rig.master);
  // At full rate while they are enabled: they run on or fault, and come back.
  Process cangen({"cangen", "vcan0", "-g", "0", "-I", "555", "-L", "8", "-D", "i", "-n", "200000"});
  SetTorque(rig.master, kTorque_permille);
  rig.RunUntil([&] { return !cangen.Running(); }, 20 * kSecond_us);
  std::cout << "after the flood:\n" << Describe(rig.master);
  rig.RunFor(kSecond_us);
  rig.Enable();
  EXPECT_TRUE(rig.RunUntilEnabled(20 * kSecond_us)) << Describe(rig.master);
  EXPECT_TRUE(drives.Running());
}

TEST_F(VcanDrives, TwoDrivesWithOneNodeNumberAreNamedAndTakenDown) {
  Process drives(DrivesCommand(3), output_);
  Process intruder(DrivesCommand(1, 2), output_ + ".intruder");
  RealTimeMaster rig(kSpec, PatientNodesOneTo(3));
  rig.Enable();
  rig.RunFor(4 * kSecond_us);
  EXPECT_EQ(rig.master.drive(1).problem, DriveProblem::kDuplicateNode)
      << Describe(rig.master.drive(1));
  EXPECT_NE(Describe(rig.master.drive(1)).find("two drives answer with this node number"),
            std::string::npos);
  EXPECT_EQ(rig.master.drive(0).step, DriveStep::kEnabled);
  EXPECT_EQ(rig.master.drive(2).step, DriveStep::kEnabled);
  // Once it is gone, Enable brings the other back.
  intruder.Signal(SIGKILL);
  intruder.Wait();
  rig.Enable();
  EXPECT_TRUE(rig.RunUntilEnabled()) << Describe(rig.master);
}

}  // namespace
}  // namespace mantle::firmware_sim
