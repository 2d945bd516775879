#include "firmware_sim/canopen/emergency.h"

#include <gtest/gtest.h>

#include "tests/firmware_sim/drive_bench.h"

namespace mantle::firmware_sim {
namespace {

using test::DriveBench;

constexpr std::pair<EmcyCode, std::uint8_t> kRegister[] = {
    {EmcyCode::kOverCurrent, 0x03},          {EmcyCode::kOverVoltage, 0x05},
    {EmcyCode::kUnderVoltage, 0x05},         {EmcyCode::kOverTemperatureDevice, 0x09},
    {EmcyCode::kOverTemperatureMotor, 0x09}, {EmcyCode::kEncoder, 0x21},
    {EmcyCode::kHeartbeatLost, 0x11},        {EmcyCode::kPdoLength, 0x11},
    {EmcyCode::kRpdoTimeout, 0x11},          {EmcyCode::kFollowingError, 0x21},
};

TEST(Emergency, RegisterBitsAreTheProfiles) {
  for (const auto& [code, bits] : kRegister) {
    ObjectDictionary objects(1);
    Emergency emergency;
    EXPECT_TRUE(emergency.Raise(code, objects));
    EXPECT_EQ(objects.Raw(Slot(0x1001)), bits) << Name(code);
    EXPECT_EQ(objects.Raw(Slot(0x603F)), static_cast<std::uint32_t>(code));
    EXPECT_FALSE(emergency.Raise(code, objects)) << "a second EMCY for the same error";
    EXPECT_TRUE(emergency.Clear(code, objects));
    EXPECT_EQ(objects.Raw(Slot(0x1001)), 0U);
    EXPECT_EQ(objects.Raw(Slot(0x603F)), 0U);
  }
}

TEST(Emergency, ErrorFreeOnlyWhenTheLastIsOver) {
  ObjectDictionary objects(1);
  Emergency emergency;
  emergency.Raise(EmcyCode::kEncoder, objects);
  emergency.Raise(EmcyCode::kOverCurrent, objects);
  EXPECT_EQ(objects.Raw(Slot(0x1001)), 0x23U);
  EXPECT_FALSE(emergency.Clear(EmcyCode::kEncoder, objects));
  EXPECT_EQ(objects.Raw(Slot(0x1001)), 0x03U);
  EXPECT_FALSE(emergency.Clear(EmcyCode::kEncoder, objects));
  EXPECT_TRUE(emergency.Clear(EmcyCode::kOverCurrent, objects));
}

TEST(Emergency, FrameIsCodeRegisterAndFiveZeros) {
  const CanFrame frame = MakeEmcy(6, EmcyCode::kHeartbeatLost, 0x11);
  EXPECT_EQ(frame.id, 0x086U);
  EXPECT_EQ(frame.size, 8);
  EXPECT_EQ(frame.data, (std::array<std::uint8_t, 8>{0x30, 0x81, 0x11, 0, 0, 0, 0, 0}));
}

TEST(Emergency, HistoryKeepsTheLastEightNewestFirst) {
  ObjectDictionary objects(1);
  Emergency emergency;
  for (const auto& [code, bits] : kRegister) emergency.Raise(code, objects);
  EXPECT_EQ(objects.Raw(Slot(0x1003, 0)), kErrorHistoryDepth);
  for (std::size_t i = 0; i < kErrorHistoryDepth; ++i) {
    EXPECT_EQ(objects.Raw(Slot(0x1003, 1) + i),
              static_cast<std::uint32_t>(kRegister[std::size(kRegister) - 1 - i].first));
  }
}

TEST(Emergency, WritingZeroClearsTheHistory) {
  DriveBench bench;
  bench.drive.Disturb(Disturbance::kOverVoltage);
  bench.Advance(5'000);
  EXPECT_EQ(bench.Upload(0x1003, 0).data, 1U);
  EXPECT_EQ(bench.Upload(0x1003, 1).data, 0x3210U);
  EXPECT_EQ(bench.Download(0x1003, 0, 1, 0).abort(), SdoAbort::kNone);
  EXPECT_EQ(bench.Upload(0x1003, 0).data, 0U);
  EXPECT_EQ(bench.Upload(0x1003, 1).data, 0U);
}

}  // namespace
}  // namespace mantle::firmware_sim
