#pragma once

#include <cstdint>

/// @file
/// Drive states, statusword and controlword of CiA 402 (IEC 61800-7-201), shared by drive, master
/// and monitor.
///
///   statusword (mask, value)            controlword bits 3..0 (bit 7 = 0)
///   not ready              004F, 0000   shutdown         x110
///   switch-on disabled     004F, 0040   switch on        0111
///   ready to switch on     006F, 0021   enable operation 1111
///   switched on            006F, 0023   disable voltage  xx0x
///   operation enabled      006F, 0027   quick stop       x01x
///   quick stop active      006F, 0007   fault reset      rising edge of bit 7
///   fault reaction active  004F, 000F
///   fault                  004F, 0008

namespace mantle::firmware_sim {

enum class DriveState : std::uint8_t {
  kNotReady,
  kSwitchOnDisabled,
  kReadyToSwitchOn,
  kSwitchedOn,
  kOperationEnabled,
  kQuickStopActive,
  kFaultReactionActive,
  kFault,
};
inline constexpr int kDriveStateCount = 8;

constexpr const char* Name(DriveState state) {
  switch (state) {
    case DriveState::kNotReady:
      return "not ready to switch on";
    case DriveState::kSwitchOnDisabled:
      return "switch-on disabled";
    case DriveState::kReadyToSwitchOn:
      return "ready to switch on";
    case DriveState::kSwitchedOn:
      return "switched on";
    case DriveState::kOperationEnabled:
      return "operation enabled";
    case DriveState::kQuickStopActive:
      return "quick stop active";
    case DriveState::kFaultReactionActive:
      return "fault reaction active";
    case DriveState::kFault:
      return "fault";
  }
  return "unknown";
}

namespace statusword {
inline constexpr std::uint16_t kVoltageEnabled = 1U << 4U;
inline constexpr std::uint16_t kWarning = 1U << 7U;
inline constexpr std::uint16_t kRemote = 1U << 9U;
inline constexpr std::uint16_t kInternalLimit = 1U << 11U;
inline constexpr std::uint16_t kFollowsCommand = 1U << 12U;
inline constexpr std::uint16_t kFollowingError = 1U << 13U;
}  // namespace statusword

/// The bits of the statusword that carry the state (others zero).
constexpr std::uint16_t EncodeState(DriveState state) {
  switch (state) {
    case DriveState::kNotReady:
      return 0x00;
    case DriveState::kSwitchOnDisabled:
      return 0x40;
    case DriveState::kReadyToSwitchOn:
      return 0x21;
    case DriveState::kSwitchedOn:
      return 0x23;
    case DriveState::kOperationEnabled:
      return 0x27;
    case DriveState::kQuickStopActive:
      return 0x07;
    case DriveState::kFaultReactionActive:
      return 0x0F;
    case DriveState::kFault:
      return 0x08;
  }
  return 0;
}

/// The state a statusword shows; a pattern outside the table reads as kNotReady.
constexpr DriveState DecodeState(std::uint16_t word) {
  switch (word & 0x4FU) {
    case 0x40:
      return DriveState::kSwitchOnDisabled;
    case 0x0F:
      return DriveState::kFaultReactionActive;
    case 0x08:
      return DriveState::kFault;
    default:
      break;
  }
  switch (word & 0x6FU) {
    case 0x21:
      return DriveState::kReadyToSwitchOn;
    case 0x23:
      return DriveState::kSwitchedOn;
    case 0x27:
      return DriveState::kOperationEnabled;
    case 0x07:
      return DriveState::kQuickStopActive;
    default:
      return DriveState::kNotReady;
  }
}

namespace controlword {
inline constexpr std::uint16_t kShutdown = 0x0006;
inline constexpr std::uint16_t kSwitchOn = 0x0007;  ///< also "disable operation"
inline constexpr std::uint16_t kEnableOperation = 0x000F;
inline constexpr std::uint16_t kDisableVoltage = 0x0000;
inline constexpr std::uint16_t kQuickStop = 0x0002;
inline constexpr std::uint16_t kFaultReset = 0x0080;
inline constexpr std::uint16_t kHalt = 1U << 8U;
}  // namespace controlword

enum class DriveCommand : std::uint8_t {
  kNone,
  kShutdown,
  kSwitchOn,
  kEnableOperation,
  kDisableVoltage,
  kQuickStop,
  kFaultReset,
};

/// The command in `word`, given the controlword before it. While bit 7 is set only what takes power
/// away (disable voltage, quick stop) counts; its rising edge is a fault reset, which a drive that
/// has no fault reads as the rest of the word.
constexpr DriveCommand DecodeCommand(std::uint16_t word, std::uint16_t previous, bool in_fault) {
  const bool reset_bit = (word & controlword::kFaultReset) != 0;
  if (in_fault) {
    return reset_bit && (previous & controlword::kFaultReset) == 0 ? DriveCommand::kFaultReset
                                                                   : DriveCommand::kNone;
  }
  if ((word & 0x02U) == 0) return DriveCommand::kDisableVoltage;
  if ((word & 0x04U) == 0) return DriveCommand::kQuickStop;
  if (reset_bit) return DriveCommand::kNone;
  switch (word & 0x0FU) {
    case 0x07:
      return DriveCommand::kSwitchOn;
    case 0x0F:
      return DriveCommand::kEnableOperation;
    default:
      return DriveCommand::kShutdown;
  }
}

/// Modes of operation (objects 6060, 6061).
enum class OperationMode : std::int8_t {
  kNone = 0,
  kCyclicPosition = 8,
  kCyclicVelocity = 9,
  kCyclicTorque = 10,
};

}  // namespace mantle::firmware_sim
