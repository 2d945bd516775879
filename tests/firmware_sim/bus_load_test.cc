#include "firmware_sim/bus/bus_load.h"

#include <gtest/gtest.h>

#include <random>
#include <stdexcept>

#include "tests/firmware_sim/frames.h"

namespace mantle::firmware_sim {
namespace {

// Sums of integers in double, divided once.
constexpr double kRoundOff = 1e-9;

TEST(BusLoad, SyncHasTheBitsCountedByHand) {
  // Id 0x080 without data. Start 0, id 00010000000, remote 0, extension 0, reserved 0, length 0000,
  // then the CRC of these 19 bits, 0x1C05 = 001110000000101 (division by 0xC599 in long hand). The
  // stuffed part, stuff bits in brackets:
  //   0000100000[1]00000[1]00000[1]011100000[1]00101
  // 34 bits and 4 stuff bits; delimiters, acknowledge, end of frame and interframe space are 13.
  EXPECT_EQ(ActualFrameBits(DataFrame(0x080, {})), 34 + 4 + 13);
}

TEST(BusLoad, FixedBitsAreThoseOfTheStandard) {
  EXPECT_EQ(LeastFrameBits(0, false), 47);
  EXPECT_EQ(LeastFrameBits(8, false), 111);
  EXPECT_EQ(LeastFrameBits(0, true), 67);
  EXPECT_EQ(LeastFrameBits(8, true), 131);
}

TEST(BusLoad, WorstCaseIsThatOfDavisAndOthers) {
  // [Davis] eq. 2 and 3: (55 + 10 s) and (80 + 10 s) bit times.
  for (int size = 0; size <= 8; ++size) {
    EXPECT_EQ(WorstFrameBits(size, false), 55 + 10 * size);
    EXPECT_EQ(WorstFrameBits(size, true), 80 + 10 * size);
  }
}

TEST(BusLoad, AnyFrameLiesBetweenLeastAndWorst) {
  std::mt19937 random(7);
  for (int i = 0; i < 20'000; ++i) {
    CanFrame frame;
    frame.extended = (random() & 1U) != 0;
    frame.id = static_cast<std::uint32_t>(random()) & (frame.extended ? 0x1FFFFFFFU : 0x7FFU);
    frame.size = static_cast<std::uint8_t>(random() % 9);
    // Long runs of equal bits, to need stuffing.
    for (auto& byte : frame.data) byte = (random() & 1U) != 0 ? 0xFF : 0x00;
    const int bits = ActualFrameBits(frame);
    EXPECT_GE(bits, LeastFrameBits(frame.size, frame.extended));
    EXPECT_LE(bits, WorstFrameBits(frame.size, frame.extended));
  }
}

TEST(BusLoad, AlternatingBitsNeedNoStuffing) {
  // 0x555 in the id and 0x55 in the data: only the control field (000 + 1000) and the CRC can
  // stuff.
  const int bits =
      ActualFrameBits(DataFrame(0x555, {0x55, 0x55, 0x55, 0x55, 0x55, 0x55, 0x55, 0x55}));
  EXPECT_LE(bits, LeastFrameBits(8, false) + 3);
}

TEST(BusLoad, ARemoteFrameCarriesNoData) {
  EXPECT_LT(ActualFrameBits(RemoteFrame(0x123, 8)), LeastFrameBits(1, false) + 10);
}

TEST(BusLoad, ArbitrationOrderIsThatOfTheWire) {
  EXPECT_LT(ArbitrationField(DataFrame(0x100, {})), ArbitrationField(DataFrame(0x101, {})));
  EXPECT_LT(ArbitrationField(DataFrame(0x100, {})), ArbitrationField(RemoteFrame(0x100, 0)));
  EXPECT_LT(ArbitrationField(DataFrame(0x100, {})),
            ArbitrationField(ExtendedFrame(0x100U << 18, {})));
  EXPECT_LT(ArbitrationField(RemoteFrame(0x100, 0)),
            ArbitrationField(ExtendedFrame(0x100U << 18, {})));
  EXPECT_LT(ArbitrationField(ExtendedFrame(0x100U << 18, {})),
            ArbitrationField(DataFrame(0x101, {})));
}

TEST(BusLoad, EightDrivesWithFourPdosCountedByHand) {
  // One SYNC of 55 bits; 8 x (RPDO1 8 bytes 135, RPDO2 7 bytes 125, TPDO1 135, TPDO2 135) bits.
  const double by_hand = 55 + 8 * (135 + 125 + 135 + 135);
  const BusLoad at_10_ms = LoadOfScene({});
  EXPECT_EQ(at_10_ms.frames, 33);
  EXPECT_NEAR(at_10_ms.worst_bits, by_hand, kRoundOff);
  EXPECT_NEAR(at_10_ms.worst_percent, 42.95, kRoundOff);
  EXPECT_NEAR(at_10_ms.least_bits, 47 + 8 * (111 + 103 + 111 + 111), kRoundOff);
  EXPECT_FALSE(at_10_ms.warn);
}

TEST(BusLoad, WarnsAbove70PercentAsTheProfileSays) {
  EXPECT_TRUE(LoadOfScene({.period_us = 5000}).warn);
  EXPECT_GT(LoadOfScene({.period_us = 1000}).least_percent, 100);
  // 4295 bits are 70 % of 6136 us.
  EXPECT_FALSE(LoadOfScene({.period_us = 6136}).warn);
  EXPECT_TRUE(LoadOfScene({.period_us = 6135}).warn);
}

TEST(BusLoad, HeartbeatsComeToAFractionOfACycle) {
  const BusLoad load = LoadOfScene({.drives = 2, .period_us = 10'000, .heartbeat_us = 100'000});
  ASSERT_EQ(load.rows.back().frame, "heartbeat");
  EXPECT_NEAR(load.rows.back().count, 0.3, kRoundOff);
  EXPECT_EQ(load.rows.back().worst_bits, 65);
}

TEST(BusLoad, RefusesImpossibleScenesWithValueAndBound) {
  EXPECT_THROW(LoadOfScene({.drives = 0}), std::invalid_argument);
  EXPECT_THROW(LoadOfScene({.drives = 127}), std::invalid_argument);
  EXPECT_THROW(LoadOfScene({.rpdos = 3}), std::invalid_argument);
  EXPECT_THROW(LoadOfScene({.period_us = 0}), std::invalid_argument);
  try {
    LoadOfScene({.tpdos = -1});
    FAIL();
  } catch (const std::invalid_argument& error) {
    EXPECT_STREQ(error.what(), "TPDOs per drive is -1, must be 0 to 2");
  }
}

}  // namespace
}  // namespace mantle::firmware_sim
