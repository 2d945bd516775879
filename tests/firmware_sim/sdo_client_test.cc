#include "firmware_sim/canopen/sdo_client.h"

#include <gtest/gtest.h>

#include <vector>

#include "tests/firmware_sim/frames.h"

namespace mantle::firmware_sim {
namespace {

constexpr std::int64_t kTimeout_us = 1000;
constexpr int kAttempts = 3;

struct Bench {
  SdoClient client{5, kTimeout_us, kAttempts};
  FrameBatch out;
  SdoResult Advance(std::int64_t now_us) {
    out.Clear();
    return client.Advance(now_us, out);
  }
};

TEST(SdoClient, AnUploadIsByteForByteThatOfTheProfile) {
  Bench bench;
  bench.client.Upload({0x1018, 2});
  EXPECT_EQ(bench.Advance(0), SdoResult::kBusy);
  ASSERT_EQ(bench.out.frames().size(), 1U);
  ExpectSameFrame(bench.out.frames()[0], DataFrame(0x605, {0x40, 0x18, 0x10, 2, 0, 0, 0, 0}));
  bench.client.OnReply(DataFrame(0x585, {0x43, 0x18, 0x10, 2, 0x78, 0x56, 0x34, 0x12}));
  EXPECT_EQ(bench.Advance(1), SdoResult::kDone);
  EXPECT_EQ(bench.client.value(), 0x12345678U);
}

TEST(SdoClient, TakesAsManyBytesAsTheReplySays) {
  for (const auto& [command, value] :
       {std::pair{0x4F, 0x78U}, {0x4B, 0x5678U}, {0x47, 0x345678U}, {0x43, 0x12345678U}}) {
    Bench bench;
    bench.client.Upload({0x6041, 0});
    bench.Advance(0);
    bench.client.OnReply(DataFrame(0x585, {command, 0x41, 0x60, 0, 0x78, 0x56, 0x34, 0x12}));
    EXPECT_EQ(bench.client.value(), value);
  }
}

TEST(SdoClient, ADownloadSaysItsSize) {
  for (const auto& [size, command] : {std::pair{1, 0x2F}, {2, 0x2B}, {3, 0x27}, {4, 0x23}}) {
    Bench bench;
    bench.client.Download({{0x6087, 0}, static_cast<std::uint8_t>(size), 0x01010101});
    bench.Advance(0);
    ASSERT_EQ(bench.out.frames().size(), 1U);
    EXPECT_EQ(bench.out.frames()[0].data[0], command);
    for (int i = 0; i < 4; ++i) EXPECT_EQ(bench.out.frames()[0].data[4 + i], i < size ? 1 : 0);
    bench.client.OnReply(DataFrame(0x585, {0x60, 0x87, 0x60, 0, 0, 0, 0, 0}));
    EXPECT_EQ(bench.client.result(), SdoResult::kDone);
  }
}

TEST(SdoClient, AnAbortEndsTheTransferWithItsCode) {
  Bench bench;
  bench.client.Upload({0x1234, 0});
  bench.Advance(0);
  bench.client.OnReply(DataFrame(0x585, {0x80, 0x34, 0x12, 0, 0x00, 0x00, 0x02, 0x06}));
  EXPECT_EQ(bench.Advance(1), SdoResult::kAborted);
  EXPECT_EQ(bench.client.abort_code(), 0x06020000U);
}

TEST(SdoClient, RepeatsAndThenGivesUp) {
  Bench bench;
  bench.client.Upload({0x1000, 0});
  int sent = 0;
  std::int64_t now_us = 0;
  for (; bench.Advance(now_us) == SdoResult::kBusy; now_us += 100) {
    sent += static_cast<int>(bench.out.frames().size());
  }
  EXPECT_EQ(bench.client.result(), SdoResult::kTimedOut);
  EXPECT_EQ(sent, kAttempts);
  EXPECT_EQ(now_us, kAttempts * kTimeout_us);
}

TEST(SdoClient, RepliesToSomethingElseAreCountedAndNotTaken) {
  Bench bench;
  bench.client.Upload({0x1000, 0});
  bench.client.OnReply(DataFrame(0x585, {0x43, 0x00, 0x10, 0, 1, 0, 0, 0}));  // before the request
  bench.Advance(0);
  bench.client.OnReply(DataFrame(0x585, {0x43, 0x01, 0x10, 0, 1, 0, 0, 0}));  // another object
  bench.client.OnReply(DataFrame(0x585, {0x43, 0x00, 0x10, 1, 1, 0, 0, 0}));  // another sub-index
  bench.client.OnReply(DataFrame(0x585, {0x60, 0x00, 0x10, 0, 1, 0, 0, 0}));  // a download's reply
  bench.client.OnReply(DataFrame(0x585, {0x43, 0x00, 0x10}));                 // too short
  EXPECT_EQ(bench.client.result(), SdoResult::kBusy);
  EXPECT_EQ(bench.client.unexpected_replies(), 5U);
}

TEST(SdoClient, ASegmentedReplyIsRefused) {
  Bench bench;
  bench.client.Upload({0x1008, 0});
  bench.Advance(0);
  bench.client.OnReply(DataFrame(0x585, {0x41, 0x08, 0x10, 0, 20, 0, 0, 0}));
  EXPECT_EQ(bench.client.result(), SdoResult::kAborted);
}

}  // namespace
}  // namespace mantle::firmware_sim
