#include "firmware_sim/canopen/sdo_server.h"

#include <gtest/gtest.h>

#include "tests/firmware_sim/drive_bench.h"

namespace mantle::firmware_sim {
namespace {

using test::DriveBench;
using test::Frame;
using test::Targets;

TEST(SdoServer, DownloadsOfEverySizeAreConfirmedByteForByte) {
  DriveBench bench;
  const auto expect_confirmed = [&](const CanFrame& request) {
    bench.frames.clear();
    bench.Send(request);
    ASSERT_EQ(bench.frames.size(), 1U);
    std::array<std::uint8_t, 8> reply = {
        0x60, request.data[1], request.data[2], request.data[3], 0, 0, 0, 0};
    EXPECT_EQ(bench.frames[0].data, reply);
  };
  expect_confirmed(Frame(0x601, {0x2F, 0x60, 0x60, 0, 0x09, 0, 0, 0}));
  EXPECT_EQ(bench.Number(Slot(0x6060)), 9);
  expect_confirmed(Frame(0x601, {0x2B, 0x71, 0x60, 0, 0x38, 0xFF, 0, 0}));
  EXPECT_EQ(bench.Number(Slot(0x6071)), -200);
  expect_confirmed(Frame(0x601, {0x23, 0x7A, 0x60, 0, 0xFE, 0xFF, 0xFF, 0xFF}));
  EXPECT_EQ(bench.Number(Slot(0x607A)), -2);
  // Without a size: as many bytes as the object has.
  expect_confirmed(Frame(0x601, {0x22, 0x71, 0x60, 0, 0x2A, 0x00, 0xAA, 0xBB}));
  EXPECT_EQ(bench.Number(Slot(0x6071)), 42);
}

/// A request and the abort code it must earn.
struct Case {
  const char* what;
  std::array<std::uint8_t, 8> request;
  std::uint32_t code;
};

const Case kCases[] = {
    {"no such object", {0x40, 0x00, 0x20, 0, 0, 0, 0, 0}, 0x06020000},
    {"no such object, write", {0x2B, 0x42, 0x60, 0, 0, 0, 0, 0}, 0x06020000},
    {"no such sub-index", {0x40, 0x18, 0x10, 5, 0, 0, 0, 0}, 0x06090011},
    {"sub-index of a variable", {0x40, 0x41, 0x60, 1, 0, 0, 0, 0}, 0x06090011},
    {"sub-index 3 of an RPDO", {0x40, 0x00, 0x14, 3, 0, 0, 0, 0}, 0x06090011},
    {"read of a write-only object", {0x40, 0x01, 0x22, 0, 0, 0, 0, 0}, 0x06010001},
    {"write of a read-only object", {0x2B, 0x41, 0x60, 0, 0, 0, 0, 0}, 0x06010002},
    {"write of a constant", {0x23, 0x00, 0x10, 0, 0, 0, 0, 0}, 0x06010002},
    {"too long", {0x23, 0x40, 0x60, 0, 0, 0, 0, 0}, 0x06070012},
    {"too short", {0x2F, 0x40, 0x60, 0, 0, 0, 0, 0}, 0x06070013},
    {"mode that is not built", {0x2F, 0x60, 0x60, 0, 3, 0, 0, 0}, 0x06090030},
    {"abort connection 0", {0x2B, 0x07, 0x60, 0, 0, 0, 0, 0}, 0x06090030},
    {"quick stop option 4", {0x2B, 0x5A, 0x60, 0, 4, 0, 0, 0}, 0x06090030},
    {"quick stop option 9", {0x2B, 0x5A, 0x60, 0, 9, 0, 0, 0}, 0x06090030},
    {"halt option 0", {0x2B, 0x5D, 0x60, 0, 0, 0, 0, 0}, 0x06090030},
    {"fault reaction option 3", {0x2B, 0x5E, 0x60, 0, 3, 0, 0, 0}, 0x06090030},
    {"max torque above the motor's", {0x2B, 0x72, 0x60, 0, 0xD1, 0x07, 0, 0}, 0x06090030},
    {"error history to 1", {0x2F, 0x03, 0x10, 0, 1, 0, 0, 0}, 0x06090030},
    {"SYNC producer", {0x23, 0x05, 0x10, 0, 0x80, 0, 0, 0x40}, 0x06090030},
    {"error behaviour 3", {0x2F, 0x29, 0x10, 1, 3, 0, 0, 0}, 0x06090030},
    {"PDO type 253", {0x2F, 0x00, 0x14, 2, 253, 0, 0, 0}, 0x06090030},
    {"extended COB-ID", {0x23, 0x00, 0x14, 1, 0x01, 0x02, 0, 0x20}, 0x06090030},
    {"COB-ID of an SDO", {0x23, 0x00, 0x14, 1, 0x01, 0x06, 0, 0x00}, 0x06090030},
    {"COB-ID while the PDO exists", {0x23, 0x00, 0x14, 1, 0x02, 0x02, 0, 0}, 0x08000022},
    {"mapping while the PDO exists", {0x2F, 0x00, 0x16, 0, 0, 0, 0, 0}, 0x08000022},
    {"segmented download", {0x21, 0x40, 0x60, 0, 2, 0, 0, 0}, 0x05040001},
    {"upload segment", {0x60, 0, 0, 0, 0, 0, 0, 0}, 0x05040001},
    {"block upload", {0xA0, 0x40, 0x60, 0, 0, 0, 0, 0}, 0x05040001},
    {"reserved bit", {0x33, 0x40, 0x60, 0, 0, 0, 0, 0}, 0x05040001},
};

TEST(SdoServer, EveryAbortCodeComesByteForByte) {
  for (const Case& c : kCases) {
    DriveBench bench;
    CanFrame request;
    request.id = 0x601;
    request.size = 8;
    request.data = c.request;
    bench.Send(request);
    ASSERT_EQ(bench.frames.size(), 2U) << c.what;  // boot-up, then the abort
    const auto code = c.code;
    const std::array<std::uint8_t, 8> reply = {0x80,
                                               c.request[1],
                                               c.request[2],
                                               c.request[3],
                                               static_cast<std::uint8_t>(code),
                                               static_cast<std::uint8_t>(code >> 8U),
                                               static_cast<std::uint8_t>(code >> 16U),
                                               static_cast<std::uint8_t>(code >> 24U)};
    EXPECT_EQ(bench.frames[1].id, 0x581U) << c.what;
    EXPECT_EQ(bench.frames[1].data, reply) << c.what;
  }
}

TEST(SdoServer, RefusedWritesLeaveEveryObjectAsItWas) {
  for (const Case& c : kCases) {
    ObjectDictionary objects(1);
    const ObjectDictionary before = objects;
    CanFrame request;
    request.size = 8;
    request.data = c.request;
    EXPECT_FALSE(ServeSdo(request, objects, false).has_written) << c.what;
    for (std::size_t i = 0; i < kObjectTable.size(); ++i) {
      EXPECT_EQ(objects.Raw(i), before.Raw(i)) << c.what;
    }
  }
}

TEST(SdoServer, AClientsAbortAndAShortRequestGetNoReply) {
  DriveBench bench;
  bench.frames.clear();
  bench.Send(Frame(0x601, {0x80, 0x40, 0x60, 0, 0, 0, 4, 5}));
  bench.Send(Frame(0x601, {0x40, 0x41, 0x60, 0}));
  EXPECT_TRUE(bench.frames.empty());
}

TEST(SdoServer, AnswersOnlyItsOwnNode) {
  DriveBench bench({.node = 3});
  bench.frames.clear();
  bench.Send(Frame(0x602, {0x40, 0x41, 0x60, 0, 0, 0, 0, 0}));
  EXPECT_TRUE(bench.frames.empty());
  EXPECT_TRUE(bench.Upload(0x6041, 0).came);
}

TEST(SdoServer, RpdoTimeoutCannotBeSwitchedOffWhileEnabled) {
  DriveBench bench;
  bench.Enable({});
  ASSERT_EQ(bench.drive.state(), DriveState::kOperationEnabled);
  EXPECT_EQ(bench.Download(0x1400, 5, 2, 0).abort(), SdoAbort::kWrongDeviceState);
  EXPECT_EQ(bench.Download(0x1400, 5, 2, 50).abort(), SdoAbort::kNone);
  EXPECT_EQ(bench.Number(Slot(0x1400, 5)), 50);
}

}  // namespace
}  // namespace mantle::firmware_sim
