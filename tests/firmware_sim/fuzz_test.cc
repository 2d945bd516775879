#include <gtest/gtest.h>

#include <cstdlib>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "tests/firmware_sim/drive_bench.h"
#include "tests/firmware_sim/fuzz_drive.h"

/// 10^6 random and mutated frames against one drive. Built twice: as it is, and from its own copy
/// of firmware_sim under ASan and UBSan.

namespace mantle::firmware_sim {
namespace {

using test::Frame;
using test::FuzzedDrive;

/// MANTLE_FUZZ_FRAMES asks for more.
int FrameCount() {
  constexpr int kFrames = 1'000'000;
  const char* wanted = std::getenv("MANTLE_FUZZ_FRAMES");
  return wanted != nullptr ? std::max(1, std::atoi(wanted)) : kFrames;
}

/// Frames that mean something to node 5, from which mutation starts.
std::vector<CanFrame> Meaningful() {
  std::vector<CanFrame> frames = {
      Frame(0x000, {1, 0}),
      Frame(0x000, {1, 5}),
      Frame(0x080, {}),
      Frame(0x080, {}),
      Frame(0x77F, {5}),
      Frame(0x205, {0x06, 0, 0, 0, 0, 0, 0, 0}),
      Frame(0x205, {0x07, 0, 0, 0, 0, 0, 0, 0}),
      Frame(0x205, {0x0F, 0, 0x2C, 1, 0, 0, 0, 0}),
      Frame(0x205, {0x80, 0, 0, 0, 0, 0, 0, 0}),
      Frame(0x305, {0, 0x10, 0, 0, 0, 0, 8}),
      Frame(0x605, {0x23, 0x00, 0x14, 1, 0x05, 0x02, 0, 0x80}),
      Frame(0x605, {0x23, 0x00, 0x14, 1, 0x05, 0x02, 0, 0}),
      Frame(0x605, {0x2F, 0x00, 0x16, 0, 0, 0, 0, 0}),
      Frame(0x605, {0x23, 0x00, 0x16, 1, 0x10, 0, 0x40, 0x60}),
      Frame(0x605, {0x2F, 0x00, 0x16, 0, 3, 0, 0, 0}),
      Frame(0x605, {0x2F, 0x01, 0x22, 0, 2, 0, 0, 0}),
      Frame(0x605, {0x2F, 0x01, 0x22, 0, 0, 0, 0, 0}),
      Frame(0x605, {0x23, 0x16, 0x10, 1, 50, 0, 0x7F, 0}),
      Frame(0x605, {0x2B, 0x17, 0x10, 0, 10, 0, 0, 0}),
  };
  for (const ObjectEntry& row : kObjectTable) {
    const unsigned low = row.index & 0xFFU;
    const unsigned high = row.index >> 8U;
    frames.push_back(Frame(0x605, {0x40, low, high, row.sub, 0, 0, 0, 0}));
    frames.push_back(Frame(0x605, {SdoDownloadRequest(ByteSize(row.type)), low, high, row.sub,
                                   static_cast<unsigned>(row.initial & 0xFF), 0, 0, 0}));
  }
  return frames;
}

/// What enables node 5 from anywhere, so that mutation also happens to a drive that hauls.
std::vector<CanFrame> Enabling() {
  return {Frame(0x605, {0x2F, 0x01, 0x22, 0, 0, 0, 0, 0}),
          Frame(0x000, {129, 5}),
          Frame(0x000, {1, 5}),
          Frame(0x205, {0x06, 0, 0, 0, 0, 0, 0, 0}),
          Frame(0x080, {}),
          Frame(0x205, {0x07, 0, 0, 0, 0, 0, 0, 0}),
          Frame(0x080, {}),
          Frame(0x205, {0x0F, 0, 0xC8, 0, 0, 0, 0, 0}),
          Frame(0x080, {})};
}

constexpr std::size_t kReset = 1;  // of Enabling()

class FrameSource {
 public:
  CanFrame Next() {
    if (Draw() % 800 == 0) script_at_ = 0;
    if (script_at_ < script_.size() && Draw() % 8 != 0) {
      starting_ = script_at_ == kReset + 1;
      return script_[script_at_++];
    }
    const unsigned kind = Draw() % 10;
    if (kind == 0) return Random();
    CanFrame frame = meaningful_[Draw() % meaningful_.size()];
    if (kind < 5) return frame;
    for (unsigned i = 0; i <= Draw() % 3; ++i) Mutate(frame);
    return frame;
  }
  /// Mostly a few hundred microseconds, at times a silence that lets watchdogs expire; after the
  /// script's reset, time for a low torque to end and for the boot-up.
  std::int64_t Wait_us() {
    if (std::exchange(starting_, false)) return 10'000;
    return Draw() % 4096 == 0 ? 300'000 : Draw() % 250;
  }

 private:
  CanFrame Random() {
    CanFrame frame;
    frame.id = Draw() % 2 == 0 ? Draw() & 0x7FFU : Draw();
    frame.size = static_cast<std::uint8_t>(Draw());
    frame.extended = Draw() % 8 == 0;
    frame.remote = Draw() % 8 == 0;
    frame.error = Draw() % 8 == 0;
    for (auto& byte : frame.data) byte = static_cast<std::uint8_t>(Draw());
    return frame;
  }
  void Mutate(CanFrame& frame) {
    switch (Draw() % 5) {
      case 0:
        frame.id ^= 1U << Draw() % 11;
        break;
      case 1:
        frame.size = static_cast<std::uint8_t>(Draw() % 9);
        break;
      case 2:
        frame.data[Draw() % 8] = static_cast<std::uint8_t>(Draw());
        break;
      default:
        frame.data[Draw() % 8] ^= static_cast<std::uint8_t>(1U << Draw() % 8);
        break;
    }
  }

  std::uint32_t Draw() { return static_cast<std::uint32_t>(random_()); }

  std::mt19937 random_{301402};
  std::vector<CanFrame> meaningful_ = Meaningful();
  std::vector<CanFrame> script_ = Enabling();
  std::size_t script_at_{script_.size()};
  bool starting_{false};
};

TEST(Fuzz, MillionFramesLeaveTheDriveSound) {
  FuzzedDrive drive;
  FrameSource source;
  const int count = FrameCount();
  int enabled = 0;
  int faults = 0;
  for (int i = 0; i < count; ++i) {
    const CanFrame frame = source.Next();
    const char* wrong = drive.Put(frame, source.Wait_us());
    ASSERT_EQ(wrong, nullptr) << wrong << " at frame " << i;
    enabled += drive.drive().state() == DriveState::kOperationEnabled ? 1 : 0;
    faults += drive.drive().state() == DriveState::kFault ? 1 : 0;
  }
  // The frames reached every part of the drive.
  EXPECT_GT(enabled, count / 50);
  EXPECT_GT(faults, count / 50);
  EXPECT_GT(drive.frames_out(), static_cast<std::uint64_t>(count / 10));
  RecordProperty("enabled", enabled);
  std::printf("%d frames in, %llu out; enabled after %d of them, in fault after %d\n", count,
              static_cast<unsigned long long>(drive.frames_out()), enabled, faults);
}

TEST(Fuzz, TheDriveStillObeysAfterwards) {
  FuzzedDrive fuzzed;
  FrameSource source;
  for (int i = 0; i < 20'000; ++i) {
    ASSERT_EQ(fuzzed.Put(source.Next(), source.Wait_us()), nullptr);
  }
  fuzzed.Put(Frame(0x605, {0x2F, 0x01, 0x22, 0, 0, 0, 0, 0}), 10'000);
  fuzzed.Put(Frame(0x000, {129, 5}), 10'000);
  fuzzed.Put(Frame(0x000, {129, 5}), 4'000'000);
  fuzzed.Put(Frame(0x605, {0x2F, 0x01, 0x22, 0, 0, 0, 0, 0}), 100'000);
  ASSERT_EQ(fuzzed.drive().state(), DriveState::kSwitchOnDisabled);
  fuzzed.Put(Frame(0x000, {1, 5}), 1'000);
  for (const unsigned word : {6U, 7U, 15U, 15U}) {
    fuzzed.Put(Frame(0x205, {word, 0, 0, 0, 0, 0, 0, 0}), 10'000);
    fuzzed.Put(Frame(0x080, {}), 100);
  }
  EXPECT_EQ(fuzzed.drive().state(), DriveState::kOperationEnabled);
}

}  // namespace
}  // namespace mantle::firmware_sim
