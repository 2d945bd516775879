#include <gtest/gtest.h>

#include <fstream>
#include <sstream>
#include <string>

#include "firmware_sim/bus/udp_multicast_bus.h"
#include "tests/firmware_sim/frames.h"
#include "tests/firmware_sim/real_time_master.h"
#include "tests/firmware_sim/vcan.h"
#include "tests/support/paths.h"

// python-can (Debian's python3-can) on the multicast transport. Needs no vcan, but a machine whose
// multicast stays inside: tools/vcan_run gives one.

namespace mantle::firmware_sim {
namespace {

constexpr std::int64_t kSecond_us = 1'000'000;
constexpr std::uint16_t kPort = UdpMulticastAddress{}.port;
// The distribution's interpreter has the distribution's python3-can.
const char* const kPython = "/usr/bin/python3";

TEST(PythonCan, ExchangesTheSameFramesWithUs) {
  const std::string output = ::testing::TempDir() + "mantle_python_can_test.out";
  auto bus = OpenUdpMulticastBus(UdpMulticastAddress{});
  Process peer(
      {kPython, tests::SourcePath("tests/firmware_sim/python_can_peer.py"), std::to_string(kPort)},
      output);
  const auto hello = DrainUntil(*bus, 4, 20 * kSecond_us);
  ASSERT_EQ(hello.size(), 4U);
  ExpectSameFrame(hello[0], DataFrame(0x181, {0x37, 0x12, 1, 2, 3, 4, 5, 6}));
  ExpectSameFrame(hello[1], DataFrame(0x080, {}));
  ExpectSameFrame(hello[2], ExtendedFrame(0x1ABCDEF, {9}));
  ExpectSameFrame(hello[3], RemoteFrame(0x701, 1));

  const CanFrame ours[] = {DataFrame(0x201, {0x0F, 0, 0x64, 0, 0xFF, 0x80, 0x7F, 1}),
                           DataFrame(0x300, {}), ExtendedFrame(0x1FFFFF00, {1, 2}),
                           RemoteFrame(0x702, 4)};
  for (const CanFrame& frame : ours) {
    bus->Send({&frame, 1});
    if (frame.remote) continue;
    const auto reply = DrainUntil(*bus, 1, 5 * kSecond_us);
    ASSERT_EQ(reply.size(), 1U);
    CanFrame expected = frame;
    ++expected.id;
    ExpectSameFrame(reply[0], expected);
  }
  const CanFrame end = DataFrame(0x7FF, {});
  bus->Send({&end, 1});
  EXPECT_EQ(peer.Wait(), 0);
  std::ostringstream printed;
  printed << std::ifstream(output).rdbuf();
  EXPECT_EQ(printed.str(),
            "201 0 0 8 0f006400ff807f01\n"
            "300 0 0 0 \n"
            "1FFFFF00 1 0 2 0102\n"
            "702 0 1 4 \n");
  EXPECT_EQ(bus->counters().malformed, 0U);
}

TEST(PythonCan, ReadsADriveByHandWhileOurMasterRunsIt) {
  const std::string spec = "udp:239.74.163.2:" + std::to_string(kPort);
  const std::string output = ::testing::TempDir() + "mantle_python_can_test.out";
  Process drives({tests::BinaryPath("mantle"), "drives", "--bus", spec, "--nodes", "2"}, output);
  RealTimeMaster rig(spec, PatientNodesOneTo(2));
  rig.Enable();
  ASSERT_TRUE(rig.RunUntilEnabled()) << Describe(rig.master);
  // An SDO upload of 6041 of node 2, in python-can's words.
  Process script({kPython, "-c",
                  R"(
import can, sys
bus = can.Bus(interface="udp_multicast", channel="239.74.163.2", port=)" +
                      std::to_string(kPort) + R"(,
              can_filters=[{"can_id": 0x582, "can_mask": 0x7FF}])
bus.send(can.Message(arbitration_id=0x602, is_extended_id=False, data=[0x40, 0x41, 0x60, 0, 0, 0, 0, 0]))
reply = bus.recv(timeout=5)
sys.exit(0 if reply and reply.data[0] == 0x4B and reply.data[4] & 0x6F == 0x27 else 1)
)"});
  ASSERT_TRUE(rig.RunUntil([&] { return !script.Running(); }, 20 * kSecond_us));
  EXPECT_EQ(script.Wait(), 0);
  EXPECT_TRUE(rig.master.enabled()) << Describe(rig.master);
}

}  // namespace
}  // namespace mantle::firmware_sim
