#include "firmware_sim/bus/multicast_frame.h"

#include <gtest/gtest.h>

#include <array>
#include <bit>
#include <random>
#include <string>
#include <vector>

#include "tests/firmware_sim/frames.h"

namespace mantle::firmware_sim {
namespace {

using Bytes = std::vector<std::uint8_t>;

Bytes Encode(const CanFrame& frame) {
  std::array<std::uint8_t, kMulticastFrameBytes> datagram{};
  const std::size_t size = EncodeMulticastFrame(frame, datagram);
  return {datagram.begin(), datagram.begin() + static_cast<std::ptrdiff_t>(size)};
}

void Append(Bytes& bytes, std::string_view text) {
  bytes.insert(bytes.end(), text.begin(), text.end());
}

// A key as fixstr, then the bytes of its value.
void Pair(Bytes& bytes, std::string_view key, const Bytes& value) {
  bytes.push_back(static_cast<std::uint8_t>(0xA0 | key.size()));
  Append(bytes, key);
  bytes.insert(bytes.end(), value.begin(), value.end());
}

TEST(MulticastFrame, IsByteForByteWhatPythonCanWrites) {
  // msgpack.packb of python-can 4.1 for Message(timestamp=1.5, arbitration_id=0x181,
  // is_extended_id=False, data=[0x27, 0x12]); the channel is nil.
  Bytes expected{0x8B};
  Pair(expected, "timestamp", {0xCB, 0x3F, 0xF8, 0, 0, 0, 0, 0, 0});
  Pair(expected, "arbitration_id", {0xCD, 0x01, 0x81});
  Pair(expected, "is_extended_id", {0xC2});
  Pair(expected, "is_remote_frame", {0xC2});
  Pair(expected, "is_error_frame", {0xC2});
  Pair(expected, "channel", {0xC0});
  Pair(expected, "dlc", {0x02});
  Pair(expected, "data", {0xC4, 0x02, 0x27, 0x12});
  Pair(expected, "is_fd", {0xC2});
  Pair(expected, "bitrate_switch", {0xC2});
  Pair(expected, "error_state_indicator", {0xC2});
  EXPECT_EQ(Encode(DataFrame(0x181, {0x27, 0x12}, 1'500'000)), expected);
}

TEST(MulticastFrame, EveryKindOfFrameComesBack) {
  for (const CanFrame& frame : {DataFrame(0x000, {1, 2}, 7),
                                DataFrame(0x7FF, {1, 2, 3, 4, 5, 6, 7, 8}, 1'700'000'000'123'456),
                                DataFrame(0x80, {}), ExtendedFrame(0x1FFFFFFF, {9}),
                                ExtendedFrame(0x12, {}), RemoteFrame(0x701, 1), ErrorFrame(0x20)}) {
    CanFrame back;
    ASSERT_EQ(DecodeMulticastFrame(Encode(frame), back), MulticastDecode::kFrame);
    ExpectSameFrame(back, frame);
    // A double holds seconds of this century to a quarter of a microsecond.
    EXPECT_EQ(back.time_us, frame.time_us);
  }
}

TEST(MulticastFrame, KeysComeInAnyOrderAndUnknownOnesAreSkipped) {
  Bytes datagram{0x84};
  Pair(datagram, "data", {0xC4, 0x01, 0x42});
  Pair(datagram, "is_rx", {0x93, 0x01, 0x81, 0xA1, 'k', 0x92, 0xC0, 0xC3, 0xD9, 0x02, 'h', 'i'});
  Pair(datagram, "arbitration_id", {0xCE, 0x00, 0x00, 0x01, 0x23});
  Pair(datagram, "is_extended_id", {0xC2});
  CanFrame frame;
  ASSERT_EQ(DecodeMulticastFrame(datagram, frame), MulticastDecode::kFrame);
  ExpectSameFrame(frame, DataFrame(0x123, {0x42}));
}

TEST(MulticastFrame, FdFramesAreToldApart) {
  Bytes datagram{0x83};
  Pair(datagram, "arbitration_id", {0x01});
  Pair(datagram, "dlc", {0x0C});
  Pair(datagram, "is_fd", {0xC3});
  CanFrame frame;
  EXPECT_EQ(DecodeMulticastFrame(datagram, frame), MulticastDecode::kFdFrame);
}

struct Malformed {
  const char* why;
  Bytes datagram;
};

TEST(MulticastFrame, RefusesWhatIsNoFrame) {
  const auto with = [](std::string_view key, const Bytes& value) {
    Bytes datagram{0x83};
    Pair(datagram, "arbitration_id", {0x01});
    Pair(datagram, "is_extended_id", {0xC2});
    Pair(datagram, key, value);
    return datagram;
  };
  Bytes no_id{0x81};
  Pair(no_id, "dlc", {0x00});
  Bytes trailing = Encode(DataFrame(1, {}));
  trailing.push_back(0);
  const Malformed cases[] = {
      {"empty", {}},
      {"no map", {0x93, 1, 2, 3}},
      {"id missing", no_id},
      {"bytes after the map", trailing},
      {"11-bit id too large", with("arbitration_id", {0xCD, 0x08, 0x00})},
      {"29-bit id too large", with("arbitration_id", {0xCE, 0x20, 0, 0, 0})},
      {"negative id", with("arbitration_id", {0xFF})},
      {"id is text", with("arbitration_id", {0xA1, '1'})},
      {"length 9", with("dlc", {9})},
      {"length without data", with("dlc", {4})},
      {"data is text", with("data", {0xA1, 'x'})},
      {"flag is a number", with("is_remote_frame", {1})},
      {"time not finite", with("timestamp", {0xCB, 0x7F, 0xF8, 0, 0, 0, 0, 0, 0})},
      {"remote and error",
       [&] {
         Bytes datagram{0x83};
         Pair(datagram, "arbitration_id", {0x01});
         Pair(datagram, "is_remote_frame", {0xC3});
         Pair(datagram, "is_error_frame", {0xC3});
         return datagram;
       }()},
      {"claims 4 GB of data", with("data", {0xC6, 0xFF, 0xFF, 0xFF, 0xFF})},
      {"claims 2^32 elements", with("x", {0xDD, 0xFF, 0xFF, 0xFF, 0xFF})},
      {"map of 2^32", {0xDF, 0xFF, 0xFF, 0xFF, 0xFF}},
      {"unused type", with("x", {0xC1})},
  };
  for (const Malformed& one : cases) {
    CanFrame frame = DataFrame(0x55, {1});
    EXPECT_EQ(DecodeMulticastFrame(one.datagram, frame), MulticastDecode::kMalformed) << one.why;
    ExpectSameFrame(frame, DataFrame(0x55, {1}));
  }
}

TEST(MulticastFrame, EveryTruncationIsMalformed) {
  const Bytes whole = Encode(DataFrame(0x181, {1, 2, 3}));
  for (std::size_t size = 0; size < whole.size(); ++size) {
    CanFrame frame;
    EXPECT_EQ(DecodeMulticastFrame({whole.data(), size}, frame), MulticastDecode::kMalformed)
        << size;
  }
}

TEST(MulticastFrame, RandomAndMutatedDatagramsNeverGiveAnImpossibleFrame) {
  std::mt19937 random(11);
  const Bytes seed = Encode(ExtendedFrame(0x1ABCDEF, {1, 2, 3, 4}));
  int accepted = 0;
  for (int i = 0; i < 200'000; ++i) {
    Bytes datagram = seed;
    const unsigned changes = 1 + random() % 4;
    for (unsigned k = 0; k < changes; ++k) {
      datagram[random() % datagram.size()] = static_cast<std::uint8_t>(random());
    }
    if (i % 3 == 0) datagram.resize(random() % datagram.size());
    CanFrame frame;
    if (DecodeMulticastFrame(datagram, frame) != MulticastDecode::kFrame) continue;
    ++accepted;
    ASSERT_LE(frame.size, 8);
    ASSERT_LE(frame.id, frame.extended || frame.error ? 0x1FFFFFFFU : 0x7FFU);
  }
  EXPECT_GT(accepted, 1000);  // some mutations only change the payload
}

}  // namespace
}  // namespace mantle::firmware_sim
