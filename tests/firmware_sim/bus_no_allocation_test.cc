#include <gtest/gtest.h>

#include "firmware_sim/bus/multicast_frame.h"
#include "firmware_sim/bus/recording_bus.h"
#include "firmware_sim/bus/udp_multicast_bus.h"
#include "tests/firmware_sim/frames.h"
#include "tests/firmware_sim/rig.h"
#include "tests/support/allocation_counter.h"

/// The cyclic path of master and buses allocates nothing: every call of the allocator by this
/// program is counted.

namespace mantle::firmware_sim {
namespace {

constexpr int kTicks = 6000;

TEST(BusNoAllocation, TheCounterCounts) {
  const long before = tests::allocation_count;
  int* volatile memory = new int(3);  // volatile: not optimised away
  delete memory;
  EXPECT_EQ(tests::allocation_count, before + 1);
}

TEST(BusNoAllocation, BringUpCyclesFaultsAndStopOverABadCableDoNot) {
  Rig rig(8, NodesOneTo(8), {.loss = 0.02, .duplicate = 0.05, .reorder = 0.05, .delay_us = 300});
  const long before = tests::allocation_count;
  rig.master.Enable(rig.now_us);
  bool was_enabled = false;
  for (int tick = 0; tick < kTicks; ++tick) {
    rig.Tick();
    was_enabled = was_enabled || rig.master.enabled();
    for (std::size_t i = 0; i < 8; ++i) rig.master.SetTarget(i, {.torque_permille = 50});
    if (tick == 2000) rig.drive(3).Disturb(Disturbance::kEncoderBroken);
    if (tick == 3000) rig.medium.SetUp(false);
    if (tick == 3500) rig.medium.SetUp(true);
    if (tick == 4000) rig.master.Enable(rig.now_us);
    if (tick == 5000) rig.master.Stop(rig.now_us);
  }
  EXPECT_EQ(tests::allocation_count, before);
  EXPECT_TRUE(was_enabled);
  EXPECT_TRUE(rig.master.stopped()) << Describe(rig.master);
}

TEST(BusNoAllocation, AWireWithABitRateDoesNot) {
  LoopMedium medium({.bit_rate = 1'000'000});
  auto a = medium.MakeStation();
  auto b = medium.MakeStation();
  const CanFrame frame = DataFrame(0x181, {1, 2, 3, 4, 5, 6, 7, 8});
  CanFrame batch[32];
  const long before = tests::allocation_count;
  std::size_t got = 0;
  for (std::int64_t now_us = 100; now_us < 100'000; now_us += 100) {
    a->Send({&frame, 1});
    medium.AdvanceTo(now_us);
    got += b->Receive(batch);
  }
  EXPECT_EQ(tests::allocation_count, before);
  EXPECT_GT(got, 0U);
}

TEST(BusNoAllocation, RecordingDoesNot) {
  const std::string path = ::testing::TempDir() + "mantle_bus_no_allocation_test.log";
  LoopMedium medium;
  auto station = medium.MakeStation();
  CandumpWriter writer(path, "vcan0");
  RecordingBus bus(*station, writer);
  const CanFrame frame = DataFrame(0x181, {1, 2, 3, 4, 5, 6, 7, 8}, 1'700'000'000'000'000);
  const long before = tests::allocation_count;
  for (int i = 0; i < 10'000; ++i) bus.Send({&frame, 1});
  EXPECT_EQ(tests::allocation_count, before);
  EXPECT_EQ(writer.written(), 10'000U);
}

TEST(BusNoAllocation, MulticastFramesDoNotWhateverADatagramClaims) {
  std::array<std::uint8_t, kMulticastFrameBytes> datagram{};
  const CanFrame frame = DataFrame(0x181, {1, 2, 3});
  // A map of one pair, whose value claims 4 GB.
  const std::uint8_t bomb[] = {0x81, 0xA1, 'x', 0xC6, 0xFF, 0xFF, 0xFF, 0xFF};
  CanFrame back;
  const long before = tests::allocation_count;
  for (int i = 0; i < 1000; ++i) {
    const std::size_t size = EncodeMulticastFrame(frame, datagram);
    EXPECT_EQ(DecodeMulticastFrame({datagram.data(), size}, back), MulticastDecode::kFrame);
    EXPECT_EQ(DecodeMulticastFrame(bomb, back), MulticastDecode::kMalformed);
  }
  EXPECT_EQ(tests::allocation_count, before);
}

TEST(BusNoAllocation, TheMulticastBusDoesNot) {
  const UdpMulticastAddress address{.group = "239.74.163.2", .port = 43991, .interface = "lo"};
  auto a = OpenUdpMulticastBus(address);
  auto b = OpenUdpMulticastBus(address);
  const CanFrame frame = DataFrame(0x181, {1, 2, 3});
  CanFrame batch[32];
  std::size_t got = 0;
  const long before = tests::allocation_count;
  for (int i = 0; i < 100; ++i) {
    a->Send({&frame, 1});
    b->Wait(1000);
    got += b->Receive(batch);
    a->Receive(batch);
  }
  EXPECT_EQ(tests::allocation_count, before);
  EXPECT_GT(got, 0U);
}

}  // namespace
}  // namespace mantle::firmware_sim
