#pragma once

#include <cstdint>

/// @file
/// Names for the numbers of CANopen CiA 301 that drives and master share: COB-IDs, NMT, SDO, EMCY
/// and object indices. Enum values equal wire values. All multi-byte data are little-endian.
///
///   service         COB-ID             content
///   NMT             0x000              [command, node (0 = all)]
///   SYNC            0x080              none
///   EMCY            0x080 + node       [u16 code, u8 error register, 5 bytes]
///   TPDO1 / TPDO2   0x180 / 0x280 + n  on SYNC (transmission type 1)
///   RPDO1 / RPDO2   0x200 / 0x300 + n  applied at SYNC (transmission type 1)
///   SDO reply       0x580 + node       [command, u16 index, u8 sub-index, u32 data or abort code]
///   SDO request     0x600 + node       [command, u16 index, u8 sub-index, u32 data]
///   heartbeat       0x700 + node       [NMT state]

namespace mantle::firmware_sim {

using NodeId = std::uint8_t;  ///< 1..127

inline constexpr NodeId kMasterNode = 0x7F;
inline constexpr NodeId kMaxNode = 0x7F;

inline constexpr std::uint32_t kCobNmt = 0x000;
inline constexpr std::uint32_t kCobSync = 0x080;
constexpr std::uint32_t CobEmcy(NodeId node) { return 0x080U + node; }
constexpr std::uint32_t CobTpdo1(NodeId node) { return 0x180U + node; }
constexpr std::uint32_t CobRpdo1(NodeId node) { return 0x200U + node; }
constexpr std::uint32_t CobTpdo2(NodeId node) { return 0x280U + node; }
constexpr std::uint32_t CobRpdo2(NodeId node) { return 0x300U + node; }
constexpr std::uint32_t CobSdoReply(NodeId node) { return 0x580U + node; }
constexpr std::uint32_t CobSdoRequest(NodeId node) { return 0x600U + node; }
constexpr std::uint32_t CobHeartbeat(NodeId node) { return 0x700U + node; }

enum class NmtCommand : std::uint8_t {
  kStart = 1,
  kStop = 2,
  kPreOperational = 128,
  kResetNode = 129,
  kResetCommunication = 130,
};

/// As the heartbeat carries it.
enum class NmtState : std::uint8_t {
  kBootUp = 0,
  kStopped = 4,
  kOperational = 5,
  kPreOperational = 127,
};

constexpr const char* Name(NmtState state) {
  switch (state) {
    case NmtState::kBootUp:
      return "boot-up";
    case NmtState::kStopped:
      return "stopped";
    case NmtState::kOperational:
      return "operational";
    case NmtState::kPreOperational:
      return "pre-operational";
  }
  return "unknown";
}

// SDO command bytes (expedited transfers). n = bytes of data, 1..4.
inline constexpr std::uint8_t kSdoUploadRequest = 0x40;
inline constexpr std::uint8_t kSdoDownloadReply = 0x60;
inline constexpr std::uint8_t kSdoDownloadNoSize = 0x22;
inline constexpr std::uint8_t kSdoAbortCommand = 0x80;
constexpr std::uint8_t SdoUploadReply(unsigned n) {
  return static_cast<std::uint8_t>(0x43U | (4U - n) << 2U);
}
constexpr std::uint8_t SdoDownloadRequest(unsigned n) {
  return static_cast<std::uint8_t>(0x23U | (4U - n) << 2U);
}

enum class SdoAbort : std::uint32_t {
  kNone = 0,
  kCommandUnknown = 0x05040001,
  kWriteOnly = 0x06010001,
  kReadOnly = 0x06010002,
  kNoObject = 0x06020000,
  kCannotBeMapped = 0x06040041,
  kMappingTooLong = 0x06040042,
  kTooLong = 0x06070012,
  kTooShort = 0x06070013,
  kNoSubIndex = 0x06090011,
  kValueRange = 0x06090030,
  kWrongDeviceState = 0x08000022,
};

constexpr const char* Name(SdoAbort abort) {
  switch (abort) {
    case SdoAbort::kNone:
      return "none";
    case SdoAbort::kCommandUnknown:
      return "command unknown";
    case SdoAbort::kWriteOnly:
      return "object is write-only";
    case SdoAbort::kReadOnly:
      return "object is read-only";
    case SdoAbort::kNoObject:
      return "object does not exist";
    case SdoAbort::kCannotBeMapped:
      return "object cannot be mapped";
    case SdoAbort::kMappingTooLong:
      return "mapped objects exceed the PDO";
    case SdoAbort::kTooLong:
      return "data too long";
    case SdoAbort::kTooShort:
      return "data too short";
    case SdoAbort::kNoSubIndex:
      return "sub-index does not exist";
    case SdoAbort::kValueRange:
      return "value out of range";
    case SdoAbort::kWrongDeviceState:
      return "wrong device state";
  }
  return "unknown abort code";
}

enum class EmcyCode : std::uint16_t {
  kNoError = 0x0000,  ///< all errors gone
  kOverCurrent = 0x2310,
  kOverVoltage = 0x3210,
  kUnderVoltage = 0x3220,
  kOverTemperatureDevice = 0x4210,
  kOverTemperatureMotor = 0x4310,
  kEncoder = 0x7320,
  kHeartbeatLost = 0x8130,
  kPdoLength = 0x8210,
  kRpdoTimeout = 0x8250,
  kFollowingError = 0x8611,
};

constexpr const char* Name(EmcyCode code) {
  switch (code) {
    case EmcyCode::kNoError:
      return "no error";
    case EmcyCode::kOverCurrent:
      return "over-current";
    case EmcyCode::kOverVoltage:
      return "over-voltage";
    case EmcyCode::kUnderVoltage:
      return "under-voltage";
    case EmcyCode::kOverTemperatureDevice:
      return "device over-temperature";
    case EmcyCode::kOverTemperatureMotor:
      return "motor over-temperature";
    case EmcyCode::kEncoder:
      return "encoder fault";
    case EmcyCode::kHeartbeatLost:
      return "heartbeat of the master lost";
    case EmcyCode::kPdoLength:
      return "RPDO too short";
    case EmcyCode::kRpdoTimeout:
      return "RPDO or SYNC missing";
    case EmcyCode::kFollowingError:
      return "following error";
  }
  return "unknown error";
}

/// Bit of the error register (object 1001) that an EMCY code sets besides bit 0.
constexpr std::uint8_t ErrorRegisterBit(EmcyCode code) {
  switch (code) {
    case EmcyCode::kNoError:
      return 0;
    case EmcyCode::kOverCurrent:
      return 1U << 1U;
    case EmcyCode::kOverVoltage:
    case EmcyCode::kUnderVoltage:
      return 1U << 2U;
    case EmcyCode::kOverTemperatureDevice:
    case EmcyCode::kOverTemperatureMotor:
      return 1U << 3U;
    case EmcyCode::kEncoder:
    case EmcyCode::kFollowingError:
      return 1U << 5U;
    case EmcyCode::kHeartbeatLost:
    case EmcyCode::kPdoLength:
    case EmcyCode::kRpdoTimeout:
      return 1U << 4U;
  }
  return 0;
}
inline constexpr std::uint8_t kErrorRegisterGeneric = 1U << 0U;

inline constexpr std::uint32_t kPdoInvalid = 1U << 31U;    ///< COB-ID bit: the PDO does not exist
inline constexpr std::uint32_t kPdoNoRtr = 1U << 30U;      ///< COB-ID bit: no remote request
inline constexpr std::uint32_t kCobExtended = 1U << 29U;   ///< COB-ID bit: 29-bit identifier
inline constexpr std::uint32_t kCobIdMask = 0x7FF;         ///< 11-bit identifier
inline constexpr std::uint32_t kDeviceType = 0x0002'0192;  ///< object 1000: servo drive, CiA 402

/// Object indices of the profile.
namespace object {
inline constexpr std::uint16_t kDeviceType = 0x1000;
inline constexpr std::uint16_t kErrorRegister = 0x1001;
inline constexpr std::uint16_t kErrorHistory = 0x1003;
inline constexpr std::uint16_t kCobIdSync = 0x1005;
inline constexpr std::uint16_t kDeviceName = 0x1008;
inline constexpr std::uint16_t kCobIdEmcy = 0x1014;
inline constexpr std::uint16_t kEmcyInhibit = 0x1015;        ///< unit 100 us
inline constexpr std::uint16_t kConsumerHeartbeat = 0x1016;  ///< :1 = node << 16 | time_ms
inline constexpr std::uint16_t kProducerHeartbeat = 0x1017;  ///< ms
inline constexpr std::uint16_t kIdentity = 0x1018;
inline constexpr std::uint16_t kErrorBehaviour = 0x1029;
inline constexpr std::uint16_t kRpdo1 = 0x1400;  ///< :1 COB-ID, :2 type, :5 time-out [ms]
inline constexpr std::uint16_t kRpdo2 = 0x1401;
inline constexpr std::uint16_t kRpdo1Mapping = 0x1600;
inline constexpr std::uint16_t kRpdo2Mapping = 0x1601;
inline constexpr std::uint16_t kTpdo1 = 0x1800;  ///< :1 COB-ID, :2 type, :3 inhibit, :5 event timer
inline constexpr std::uint16_t kTpdo2 = 0x1801;
inline constexpr std::uint16_t kTpdo1Mapping = 0x1A00;
inline constexpr std::uint16_t kTpdo2Mapping = 0x1A01;
inline constexpr std::uint16_t kTemperature = 0x2200;  ///< i8 deg C
inline constexpr std::uint16_t kDisturbance = 0x2201;  ///< what to break, see Disturbance
inline constexpr std::uint16_t kAbortConnection = 0x6007;
inline constexpr std::uint16_t kErrorCode = 0x603F;
inline constexpr std::uint16_t kControlword = 0x6040;
inline constexpr std::uint16_t kStatusword = 0x6041;
inline constexpr std::uint16_t kQuickStopOption = 0x605A;
inline constexpr std::uint16_t kHaltOption = 0x605D;
inline constexpr std::uint16_t kFaultReactionOption = 0x605E;
inline constexpr std::uint16_t kMode = 0x6060;
inline constexpr std::uint16_t kModeDisplay = 0x6061;
inline constexpr std::uint16_t kPositionActual = 0x6064;  ///< counts
inline constexpr std::uint16_t kFollowingErrorWindow = 0x6065;
inline constexpr std::uint16_t kVelocityActual = 0x606C;  ///< counts/s
inline constexpr std::uint16_t kTargetTorque = 0x6071;    ///< 1/1000 of 6076
inline constexpr std::uint16_t kMaxTorque = 0x6072;       ///< 1/1000 of 6076
inline constexpr std::uint16_t kRatedCurrent = 0x6075;    ///< mA
inline constexpr std::uint16_t kRatedTorque = 0x6076;     ///< mN m
inline constexpr std::uint16_t kTorqueActual = 0x6077;    ///< 1/1000 of 6076
inline constexpr std::uint16_t kCurrentActual = 0x6078;   ///< 1/1000 of 6075
inline constexpr std::uint16_t kTargetPosition = 0x607A;  ///< counts
inline constexpr std::uint16_t kPositionLimits = 0x607D;  ///< :1 min, :2 max [counts]
inline constexpr std::uint16_t kDeceleration = 0x6084;    ///< counts/s^2
inline constexpr std::uint16_t kQuickStopDeceleration = 0x6085;
inline constexpr std::uint16_t kTorqueSlope = 0x6087;  ///< 1/1000 of 6076 per second
inline constexpr std::uint16_t kEncoderResolution = 0x608F;
inline constexpr std::uint16_t kGearRatio = 0x6091;
inline constexpr std::uint16_t kFeedConstant = 0x6092;         ///< :1 micrometres, :2 drum turns
inline constexpr std::uint16_t kTorqueOffset = 0x60B2;         ///< 1/1000 of 6076
inline constexpr std::uint16_t kInterpolationPeriod = 0x60C2;  ///< :1 value, :2 exponent of 10 s
inline constexpr std::uint16_t kTargetVelocity = 0x60FF;       ///< counts/s
inline constexpr std::uint16_t kSupportedModes = 0x6502;
}  // namespace object

}  // namespace mantle::firmware_sim
