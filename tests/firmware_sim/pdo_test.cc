#include "firmware_sim/canopen/pdo.h"

#include <gtest/gtest.h>

#include "tests/firmware_sim/drive_bench.h"

namespace mantle::firmware_sim {
namespace {

using test::DriveBench;
using test::Frame;
using test::Targets;

TEST(Pdo, TargetsWaitForSync) {
  DriveBench bench;
  bench.Nmt(NmtCommand::kStart);
  bench.Send(Frame(0x201, {0x06, 0x00, 0x2C, 0x01, 0x78, 0x56, 0x34, 0x12}));
  bench.Send(Frame(0x301, {0xFF, 0xFF, 0xFF, 0xFF, 0xF6, 0xFF, 0x09}));
  EXPECT_EQ(bench.Number(Slot(0x6071)), 0);
  EXPECT_EQ(bench.drive.state(), DriveState::kSwitchOnDisabled);
  bench.Sync();
  EXPECT_EQ(bench.Number(Slot(0x6040)), 6);
  EXPECT_EQ(bench.Number(Slot(0x6071)), 300);
  EXPECT_EQ(bench.Number(Slot(0x607A)), 0x12345678);
  EXPECT_EQ(bench.Number(Slot(0x60FF)), -1);
  EXPECT_EQ(bench.Number(Slot(0x60B2)), -10);
  EXPECT_EQ(bench.Number(Slot(0x6060)), 9);
  EXPECT_EQ(bench.drive.state(), DriveState::kReadyToSwitchOn);
}

TEST(Pdo, SyncSendsBothTpdosByteForByte) {
  DriveBench bench({.node = 2});
  bench.Nmt(NmtCommand::kStart);
  bench.frames.clear();
  bench.Sync();
  ASSERT_EQ(bench.frames.size(), 2U);
  EXPECT_EQ(bench.frames[0].id, 0x182U);
  EXPECT_EQ(bench.frames[0].size, 8);
  EXPECT_EQ(bench.frames[0].data, (std::array<std::uint8_t, 8>{0x50, 0x02, 0, 0, 0, 0, 0, 0}));
  EXPECT_EQ(bench.frames[1].id, 0x282U);
  EXPECT_EQ(bench.frames[1].size, 8);
  EXPECT_EQ(bench.frames[1].data, (std::array<std::uint8_t, 8>{0, 0, 0, 0, 0, 0, 0x0A, 22}));
}

TEST(Pdo, StatuswordOfTheSameSyncShowsTheTransition) {
  DriveBench bench;
  bench.Nmt(NmtCommand::kStart);
  bench.frames.clear();
  bench.SendTargets({.controlword = controlword::kShutdown});
  const auto tpdos = bench.WithId(0x181);
  ASSERT_EQ(tpdos.size(), 1U);
  EXPECT_EQ(DecodeState(static_cast<std::uint16_t>(LoadLe(tpdos[0].data.data(), 2))),
            DriveState::kReadyToSwitchOn);
}

TEST(Pdo, NothingMovesOutsideOperational) {
  DriveBench bench;
  bench.frames.clear();
  bench.SendTargets({.controlword = controlword::kShutdown, .torque = 5});
  EXPECT_TRUE(bench.frames.empty());
  EXPECT_EQ(bench.Number(Slot(0x6071)), 0);
  EXPECT_EQ(bench.drive.state(), DriveState::kSwitchOnDisabled);
  // What came before the start is not applied after it.
  bench.Nmt(NmtCommand::kStart);
  bench.Sync();
  EXPECT_EQ(bench.drive.state(), DriveState::kSwitchOnDisabled);
}

TEST(Pdo, LeavingOperationalDropsWhatWaits) {
  DriveBench bench;
  bench.Nmt(NmtCommand::kStart);
  bench.Send(Frame(0x201, {0x06, 0, 0, 0, 0, 0, 0, 0}));
  bench.Nmt(NmtCommand::kPreOperational);
  bench.Nmt(NmtCommand::kStart);
  bench.Sync();
  EXPECT_EQ(bench.drive.state(), DriveState::kSwitchOnDisabled);
}

TEST(Pdo, LongerFramesCountWithTheirFirstBytes) {
  DriveBench bench;
  bench.Nmt(NmtCommand::kStart);
  bench.Send(Frame(0x301, {1, 0, 0, 0, 2, 0, 8, 99}));  // seven are mapped
  bench.Sync();
  EXPECT_EQ(bench.Number(Slot(0x60FF)), 1);
  EXPECT_EQ(bench.Number(Slot(0x60B2)), 2);
  EXPECT_EQ(bench.Number(Slot(0x6060)), 8);
  EXPECT_TRUE(bench.Emergencies().empty());
}

TEST(Pdo, RemappingFollowsTheOrderOfCia301) {
  DriveBench bench;
  const std::uint32_t cob_id = 0x201;
  EXPECT_EQ(bench.Download(0x1600, 0, 1, 0).abort(), SdoAbort::kWrongDeviceState);
  EXPECT_EQ(bench.Download(0x1400, 1, 4, cob_id | kPdoInvalid).abort(), SdoAbort::kNone);
  EXPECT_EQ(bench.Download(0x1600, 1, 4, 0x60710010).abort(), SdoAbort::kWrongDeviceState);
  EXPECT_EQ(bench.Download(0x1600, 0, 1, 0).abort(), SdoAbort::kNone);
  EXPECT_EQ(bench.Download(0x1600, 1, 4, 0x60410010).abort(), SdoAbort::kCannotBeMapped);
  EXPECT_EQ(bench.Download(0x1600, 1, 4, 0x60710020).abort(), SdoAbort::kCannotBeMapped);
  EXPECT_EQ(bench.Download(0x1600, 1, 4, 0x60420010).abort(), SdoAbort::kNoObject);
  EXPECT_EQ(bench.Download(0x1600, 1, 4, 0x60710110).abort(), SdoAbort::kNoSubIndex);
  EXPECT_EQ(bench.Download(0x1600, 1, 4, 0x60710010).abort(), SdoAbort::kNone);
  EXPECT_EQ(bench.Download(0x1600, 2, 4, 0x60400010).abort(), SdoAbort::kNone);
  EXPECT_EQ(bench.Download(0x1600, 3, 4, 0x607A0020).abort(), SdoAbort::kNone);
  EXPECT_EQ(bench.Download(0x1600, 4, 4, 0x60600008).abort(), SdoAbort::kNone);
  EXPECT_EQ(bench.Download(0x1600, 0, 1, 4).abort(), SdoAbort::kMappingTooLong);  // 72 bits
  EXPECT_EQ(bench.Download(0x1600, 0, 1, 9).abort(), SdoAbort::kMappingTooLong);
  EXPECT_EQ(bench.Download(0x1600, 0, 1, 2).abort(), SdoAbort::kNone);
  EXPECT_EQ(bench.Download(0x1400, 1, 4, 0x231).abort(), SdoAbort::kNone);
  bench.Nmt(NmtCommand::kStart);
  bench.Send(Frame(0x201, {0x64, 0, 0x06, 0}));  // the old identifier is nobody's now
  bench.Sync();
  EXPECT_EQ(bench.Number(Slot(0x6071)), 0);
  bench.Send(Frame(0x231, {0x64, 0, 0x06, 0}));
  bench.Sync();
  EXPECT_EQ(bench.Number(Slot(0x6071)), 100);
  EXPECT_EQ(bench.drive.state(), DriveState::kReadyToSwitchOn);
}

TEST(Pdo, DisabledPdosAreSilentAndDeaf) {
  DriveBench bench;
  bench.Download(0x1800, 1, 4, 0x181 | kPdoInvalid);
  bench.Download(0x1400, 1, 4, 0x201 | kPdoInvalid);
  bench.Nmt(NmtCommand::kStart);
  bench.SendTargets({.controlword = controlword::kShutdown, .torque = 7});
  EXPECT_TRUE(bench.WithId(0x181).empty());
  EXPECT_EQ(bench.WithId(0x281).size(), 1U);
  EXPECT_EQ(bench.Number(Slot(0x6071)), 0);
  EXPECT_EQ(bench.drive.state(), DriveState::kSwitchOnDisabled);
}

TEST(Pdo, TypeNIsSentAtEveryNthSync) {
  DriveBench bench;
  bench.Download(0x1800, 2, 1, 3);
  bench.Nmt(NmtCommand::kStart);
  for (int i = 0; i < 9; ++i) bench.Sync();
  EXPECT_EQ(bench.WithId(0x181).size(), 3U);
  EXPECT_EQ(bench.WithId(0x281).size(), 9U);
}

TEST(Pdo, TypeZeroIsSentAtTheSyncAfterAChange) {
  DriveBench bench;
  bench.Download(0x1800, 2, 1, 0);
  bench.Nmt(NmtCommand::kStart);
  for (int i = 0; i < 5; ++i) bench.Sync();
  EXPECT_EQ(bench.WithId(0x181).size(), 1U);
  bench.SendTargets({.controlword = controlword::kShutdown});
  EXPECT_EQ(bench.WithId(0x181).size(), 2U);
}

TEST(Pdo, EventDrivenTpdoKeepsTimerAndInhibitTime) {
  DriveBench bench;
  bench.Download(0x1800, 2, 1, 255);
  bench.Download(0x1800, 5, 2, 50);   // ms
  bench.Download(0x1800, 3, 2, 200);  // 20 ms
  bench.Nmt(NmtCommand::kStart);
  bench.frames.clear();
  bench.Advance(1'000'000);
  // At once, then every 50 ms.
  EXPECT_EQ(bench.WithId(0x181).size(), 20U);
  bench.frames.clear();
  bench.Download(0x6040, 0, 2, 6);
  bench.Advance(2'000);
  bench.Download(0x6040, 0, 2, 7);
  bench.Advance(2'000);
  const std::size_t early = bench.WithId(0x181).size();
  bench.Advance(20'000);
  EXPECT_LE(early, 1U);  // the second change waits for the inhibit time
  EXPECT_EQ(bench.WithId(0x181).size(), early + 1);
}

TEST(Pdo, EventDrivenRpdoIsAppliedAtOnce) {
  DriveBench bench;
  bench.Download(0x1400, 2, 1, 254);
  bench.Nmt(NmtCommand::kStart);
  bench.Send(Frame(0x201, {0x06, 0, 9, 0, 0, 0, 0, 0}));
  EXPECT_EQ(bench.Number(Slot(0x6071)), 9);
  EXPECT_EQ(bench.drive.state(), DriveState::kReadyToSwitchOn);
}

TEST(Pdo, ModeOutOfRangeIsIgnored) {
  DriveBench bench;
  bench.Nmt(NmtCommand::kStart);
  for (const int mode : {0, 1, 3, 7, 11, -1}) {
    bench.SendTargets({.mode = static_cast<std::int8_t>(mode)});
    EXPECT_EQ(bench.Number(Slot(0x6060)), 10);
  }
}

}  // namespace
}  // namespace mantle::firmware_sim
