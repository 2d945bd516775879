#include "firmware_sim/bus/socket_can_bus.h"

#include <gtest/gtest.h>

#include <fstream>
#include <string>
#include <system_error>

#include "firmware_sim/bus/candump_log.h"
#include "tests/firmware_sim/bus_properties.h"
#include "tests/firmware_sim/frames.h"
#include "tests/firmware_sim/vcan.h"

// Run where vcan0 exists: tools/vcan_run build/tests/test_firmware_sim_socket_can_bus

namespace mantle::firmware_sim {
namespace {

constexpr std::int64_t kSecond_us = 1'000'000;

class SocketCanBusTest : public ::testing::Test {
 protected:
  void SetUp() override {
    ASSERT_TRUE(HasVcan()) << "no vcan0; run this through tools/vcan_run";
    Shell(
        "ip link show vcan0 >/dev/null 2>&1 || ip link add dev vcan0 type vcan; "
        "ip link set vcan0 up");
  }
  std::string dump_ = ::testing::TempDir() + "mantle_socket_can_bus_test.log";
};

TEST_F(SocketCanBusTest, EveryKindOfFramePassesWithAKernelTimeStamp) {
  auto a = OpenSocketCanBus("vcan0");
  auto b = OpenSocketCanBus("vcan0");
  const CanFrame frames[] = {DataFrame(0x181, {1, 2, 3}), DataFrame(0x080, {}),
                             ExtendedFrame(0x1ABCDEF, {4}), RemoteFrame(0x701, 1)};
  const std::int64_t before_us = RealTime_us();
  EXPECT_EQ(a->Send(frames), BusStatus::kOk);
  const auto got = DrainUntil(*b, 4);
  ASSERT_EQ(got.size(), 4U);
  for (int i = 0; i < 4; ++i) {
    ExpectSameFrame(got[i], frames[i]);
    EXPECT_GE(got[i].time_us, before_us);
    EXPECT_LE(got[i].time_us, RealTime_us());
  }
  EXPECT_TRUE(Drain(*a).empty());  // not its own
  EXPECT_EQ(a->counters().sent, 4U);
  EXPECT_EQ(b->counters().received, 4U);
}

TEST_F(SocketCanBusTest, CandumpSeesWhatWeSendAndWeReadItsLog) {
  auto bus = OpenSocketCanBus("vcan0");
  Process candump({"candump", "-L", "-n", "3", "vcan0"}, dump_);
  SleepFor(kSecond_us / 5);  // candump says nothing when it is ready
  const CanFrame frames[] = {DataFrame(0x201, {0x0F, 0, 0x64, 0, 0, 0, 0, 0}),
                             ExtendedFrame(0x12345678, {9}), RemoteFrame(0x701, 0)};
  bus->Send(frames);
  ASSERT_TRUE(WaitUntil([&] { return !candump.Running(); }, 5 * kSecond_us));
  std::ifstream in(dump_);
  const CandumpLog log = ReadCandumpLog(in);
  ASSERT_EQ(log.frames.size(), 3U);
  for (int i = 0; i < 3; ++i) ExpectSameFrame(log.frames[i], frames[i]);
}

TEST_F(SocketCanBusTest, WeSeeWhatCansendAndCanplayerSend) {
  auto bus = OpenSocketCanBus("vcan0");
  Shell("cansend vcan0 5A1#11.2233.44556677.88; cansend vcan0 1F334455#AA; cansend vcan0 123#R");
  auto got = DrainUntil(*bus, 3);
  ASSERT_EQ(got.size(), 3U);
  ExpectSameFrame(got[0], DataFrame(0x5A1, {0x11, 0x22, 0x33, 0x44, 0x55, 0x66, 0x77, 0x88}));
  ExpectSameFrame(got[1], ExtendedFrame(0x1F334455, {0xAA}));
  ExpectSameFrame(got[2], RemoteFrame(0x123, 0));
  // canplayer replays a log of ours, log2asc converts it.
  {
    CandumpWriter writer(dump_, "vcan0");
    for (int i = 0; i < 20; ++i) writer.Write(DataFrame(0x181, {i}, 1'000'000 + i * 1000));
    writer.Write(ExtendedFrame(0x1ABCDEF, {7}));
    ASSERT_TRUE(writer.Flush());
  }
  Shell("canplayer -I " + dump_);
  got = DrainUntil(*bus, 21);
  ASSERT_EQ(got.size(), 21U);
  for (int i = 0; i < 20; ++i) ExpectSameFrame(got[i], DataFrame(0x181, {i}));
  ExpectSameFrame(got[20], ExtendedFrame(0x1ABCDEF, {7}));
  const std::string asc = Shell("log2asc -I " + dump_ + " vcan0");
  EXPECT_NE(asc.find("181"), std::string::npos);
  EXPECT_NE(asc.find("1ABCDEFx"), std::string::npos) << asc;
}

TEST_F(SocketCanBusTest, TheKernelFilters) {
  const CanFilter only_sync[] = {{0x080, 0x7FF}};
  auto filtered = OpenSocketCanBus("vcan0", only_sync);
  auto sender = OpenSocketCanBus("vcan0");
  const CanFrame frames[] = {DataFrame(0x181, {}), DataFrame(0x080, {}), DataFrame(0x000, {1, 0})};
  sender->Send(frames);
  EXPECT_EQ(Ids(DrainUntil(*filtered, 1)), (std::vector<std::uint32_t>{0x080}));
  EXPECT_EQ(filtered->counters().received, 1U);
}

TEST_F(SocketCanBusTest, WhatASlowReaderLosesIsCounted) {
  auto slow = OpenSocketCanBus("vcan0");
  auto sender = OpenSocketCanBus("vcan0");
  std::vector<CanFrame> burst(256, DataFrame(0x181, {1, 2, 3, 4, 5, 6, 7, 8}));
  std::uint64_t sent = 0;
  // More than the receive buffer holds: a kernel buffer of a frame takes some hundred bytes.
  for (int i = 0; i < 1000; ++i) {
    sender->Send(burst);
    sent += burst.size();
  }
  std::uint64_t got = Drain(*slow).size();
  EXPECT_LT(got, sent);
  // The next frame carries the count.
  sender->Send({burst.data(), 1});
  got += DrainUntil(*slow, 1).size();
  // The socket counts what its own buffer had no room for. A burst this fast may also overrun the
  // kernel's queue before it (net.core.netdev_max_backlog), which no socket hears of.
  constexpr double kReachedTheSocket = 0.8;
  const std::uint64_t known = slow->counters().receive_dropped + got;
  EXPECT_GT(slow->counters().receive_dropped, 0U);
  EXPECT_LE(known, sent + 1);
  EXPECT_GT(static_cast<double>(known), kReachedTheSocket * static_cast<double>(sent));
}

TEST_F(SocketCanBusTest, TheSameSocketWorksAfterLinkDownAndUp) {
  auto a = OpenSocketCanBus("vcan0");
  auto b = OpenSocketCanBus("vcan0");
  const CanFrame frame = DataFrame(0x123, {1});
  Shell("ip link set vcan0 down");
  EXPECT_EQ(a->Send({&frame, 1}), BusStatus::kDown);
  EXPECT_EQ(b->Wait(50'000), BusStatus::kDown);
  EXPECT_TRUE(Drain(*b).empty());
  EXPECT_EQ(a->counters().send_dropped, 1U);
  Shell("ip link set vcan0 up");
  EXPECT_EQ(b->Wait(0), BusStatus::kOk);
  EXPECT_EQ(a->Send({&frame, 1}), BusStatus::kOk);
  EXPECT_EQ(DrainUntil(*b, 1).size(), 1U);
  EXPECT_EQ(a->counters().recoveries, 1U);
  EXPECT_EQ(b->counters().recoveries, 1U);
}

TEST_F(SocketCanBusTest, AWaitEndsWhenTheLinkGoesDown) {
  auto bus = OpenSocketCanBus("vcan0");
  Process later([] {
    SleepFor(kSecond_us / 5);
    execlp("ip", "ip", "link", "set", "vcan0", "down", nullptr);
  });
  const std::int64_t start_us = MonotonicTime_us();
  EXPECT_EQ(bus->Wait(10 * kSecond_us), BusStatus::kDown);
  EXPECT_LT(MonotonicTime_us() - start_us, 5 * kSecond_us);
}

TEST_F(SocketCanBusTest, ADeletedInterfaceIsOpenedAgainWhenItIsBack) {
  auto a = OpenSocketCanBus("vcan0");
  auto b = OpenSocketCanBus("vcan0");
  const CanFrame frame = DataFrame(0x123, {1});
  Shell("ip link del vcan0");
  EXPECT_EQ(a->Send({&frame, 1}), BusStatus::kGone);
  EXPECT_EQ(b->Wait(50'000), BusStatus::kGone);
  Shell("ip link add dev vcan0 type vcan");
  EXPECT_EQ(a->Send({&frame, 1}), BusStatus::kDown);
  Shell("ip link set vcan0 up");
  EXPECT_EQ(b->Wait(0), BusStatus::kOk);
  EXPECT_EQ(a->Send({&frame, 1}), BusStatus::kOk);
  EXPECT_EQ(DrainUntil(*b, 1).size(), 1U);
  EXPECT_EQ(a->counters().recoveries, 1U);
  EXPECT_EQ(b->counters().recoveries, 1U);
}

TEST_F(SocketCanBusTest, AnInterfaceThatIsDownMayBeOpened) {
  Shell("ip link set vcan0 down");
  auto bus = OpenSocketCanBus("vcan0");
  EXPECT_EQ(bus->Wait(0), BusStatus::kDown);
  Shell("ip link set vcan0 up");
  EXPECT_EQ(bus->Wait(0), BusStatus::kOk);
  EXPECT_THROW(OpenSocketCanBus("lo"), std::system_error);
}

TEST_F(SocketCanBusTest, FdFramesAreHiddenFromUs) {
  auto bus = OpenSocketCanBus("vcan0");
  Shell("cansend vcan0 123##011223344556677889900AABB; cansend vcan0 124#");
  EXPECT_EQ(Ids(DrainUntil(*bus, 1)), (std::vector<std::uint32_t>{0x124}));
}

class VcanWire : public test::Wire {
 public:
  Bus& a() override { return *a_; }
  Bus& b() override { return *b_; }

 private:
  std::unique_ptr<Bus> a_{OpenSocketCanBus("vcan0")}, b_{OpenSocketCanBus("vcan0")};
};

}  // namespace

namespace test {

INSTANTIATE_TEST_SUITE_P(SocketCan, BusProperties,
                         ::testing::Values(BusCase{
                             "Vcan",
                             [] { return std::unique_ptr<Wire>(std::make_unique<VcanWire>()); }}),
                         [](const auto& info) { return std::string(info.param.name); });

}  // namespace test
}  // namespace mantle::firmware_sim
