#include "firmware_sim/canopen/cia402.h"

#include <gtest/gtest.h>

namespace mantle::firmware_sim {
namespace {

struct Pattern {
  DriveState state;
  unsigned mask;
  unsigned value;
};
// canopen-profile.md, statusword (mask, value).
constexpr Pattern kPatterns[] = {
    {DriveState::kNotReady, 0x4F, 0x00},
    {DriveState::kSwitchOnDisabled, 0x4F, 0x40},
    {DriveState::kReadyToSwitchOn, 0x6F, 0x21},
    {DriveState::kSwitchedOn, 0x6F, 0x23},
    {DriveState::kOperationEnabled, 0x6F, 0x27},
    {DriveState::kQuickStopActive, 0x6F, 0x07},
    {DriveState::kFaultReactionActive, 0x4F, 0x0F},
    {DriveState::kFault, 0x4F, 0x08},
};

TEST(Cia402, EveryStatuswordDecodesByMaskAndValue) {
  for (unsigned word = 0; word <= 0xFFFF; ++word) {
    DriveState expected = DriveState::kNotReady;
    for (const Pattern& pattern : kPatterns) {
      if ((word & pattern.mask) == pattern.value) expected = pattern.state;
    }
    ASSERT_EQ(DecodeState(static_cast<std::uint16_t>(word)), expected) << std::hex << word;
  }
}

TEST(Cia402, EncodingIsDecodedBack) {
  for (const Pattern& pattern : kPatterns) {
    EXPECT_EQ(EncodeState(pattern.state), pattern.value);
    EXPECT_EQ(DecodeState(EncodeState(pattern.state)), pattern.state);
  }
}

TEST(Cia402, CommandsFollowTheControlwordTable) {
  for (unsigned word = 0; word <= 0xFFFF; ++word) {
    const auto decoded = DecodeCommand(static_cast<std::uint16_t>(word), 0, false);
    DriveCommand expected = DriveCommand::kNone;
    if ((word & 0x02U) == 0) {
      expected = DriveCommand::kDisableVoltage;  // xx0x
    } else if ((word & 0x06U) == 0x02U) {
      expected = DriveCommand::kQuickStop;  // x01x
    } else if ((word & 0x80U) != 0) {
      expected = DriveCommand::kNone;
    } else if ((word & 0x07U) == 0x06U) {
      expected = DriveCommand::kShutdown;  // x110
    } else if ((word & 0x0FU) == 0x07U) {
      expected = DriveCommand::kSwitchOn;  // 0111
    } else if ((word & 0x0FU) == 0x0FU) {
      expected = DriveCommand::kEnableOperation;  // 1111
    }
    ASSERT_EQ(decoded, expected) << std::hex << word;
  }
}

TEST(Cia402, OnlyARisingEdgeResetsAFault) {
  for (unsigned word = 0; word <= 0xFFFF; ++word) {
    const auto w = static_cast<std::uint16_t>(word);
    const bool bit = (word & 0x80U) != 0;
    EXPECT_EQ(DecodeCommand(w, 0x0000, true),
              bit ? DriveCommand::kFaultReset : DriveCommand::kNone);
    EXPECT_EQ(DecodeCommand(w, 0x0080, true), DriveCommand::kNone);
  }
}

}  // namespace
}  // namespace mantle::firmware_sim
