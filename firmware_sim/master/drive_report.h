#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>

#include "firmware_sim/canopen/canopen.h"
#include "firmware_sim/canopen/cia402.h"
#include "firmware_sim/canopen/sdo_client.h"

namespace mantle::firmware_sim {

/// Where the master is with a drive, in the order of a bring-up.
enum class DriveStep : std::uint8_t {
  kIdentify,     ///< uploads 1000 and 1018
  kConfigure,    ///< downloads ConfigurationStep by step
  kStart,        ///< NMT start sent, waits for operational and a statusword
  kExamine,      ///< uploads 6041 of a drive that changed by itself
  kClearFault,   ///< reset edges
  kEnable,       ///< climbs the states of CiA 402
  kEnabled,      ///< follows the targets
  kReady,        ///< operational, ready to switch on, waits for Enable
  kFaulted,      ///< waits for Enable, which resets it
  kLost,         ///< its heartbeat is missing
  kStopRamp,     ///< halt in torque mode until the torque is gone
  kStopDisable,  ///< down to switch-on disabled
  kStopNmt,      ///< NMT stop sent, waits for stopped
  kStopped,
  kFailed,  ///< see the problem
};

enum class DriveProblem : std::uint8_t {
  kNone,
  kNoAnswer,       ///< no reply to an SDO
  kWrongDevice,    ///< problem_object does not hold what the master expects of its drives
  kRefused,        ///< SDO abort
  kStepTimeout,    ///< the drive did not reach what the step waits for
  kFault,          ///< the drive reports a fault
  kHeartbeatLost,  ///< silent for the time that the options allow
  kDuplicateNode,  ///< two TPDO1 for each SYNC, over and over
};

/// Objects 1000 and 1018: what the master reads when a drive boots.
struct DriveIdentity {
  std::uint32_t device_type{0};
  std::uint32_t vendor{0};
  std::uint32_t product{0};
  std::uint32_t revision{0};
  std::uint32_t serial{0};
};

/// An emergency message as it came.
struct EmcyRecord {
  std::int64_t time_us{0};  ///< the master's clock
  EmcyCode code{EmcyCode::kNoError};
  std::uint8_t error_register{0};
};

/// What a drive follows; which of them depends on its mode.
struct DriveTarget {
  std::int16_t torque_permille{0};
  std::int16_t torque_offset_permille{0};  ///< needs the second PDOs
  std::int32_t position_counts{0};
  std::int32_t velocity_counts_s{0};  ///< needs the second PDOs
};

/// What the master knows of one drive: plain values, copied out for reports, and their words.
struct DriveReport {
  static constexpr std::size_t kEmcyHistory = 8;

  NodeId node{0};
  DriveStep step{DriveStep::kIdentify};
  DriveProblem problem{DriveProblem::kNone};
  DriveStep problem_step{DriveStep::kIdentify};
  SdoObject problem_object{};           ///< of kNoAnswer, kRefused and kWrongDevice
  std::uint32_t problem_abort_code{0};  ///< of kRefused
  std::uint32_t problem_value{0};       ///< of kWrongDevice: what the object holds
  std::uint32_t expected_value{0};      ///< alike: what it must hold
  DriveIdentity identity{};

  bool heard{false};  ///< any heartbeat or boot-up since the master began
  NmtState nmt{NmtState::kBootUp};
  std::int64_t last_heard_us{0};  ///< any frame of this node

  // From the TPDOs; `status_valid` once one came since the last start.
  bool status_valid{false};
  std::uint16_t statusword{0};
  std::int16_t torque_permille{0};
  std::int32_t position_counts{0};
  std::int32_t velocity_counts_s{0};
  std::int16_t current_permille{0};
  std::int8_t mode_display{0};
  std::int8_t temperature_celsius{0};
  std::int64_t tpdo1_time_us{0};  ///< the transport's stamp of the last TPDO1

  std::array<EmcyRecord, kEmcyHistory> emcy{};  ///< newest first
  std::uint64_t emcy_count{0};
  std::uint64_t reboots{0};  ///< boot-ups that the master had not commanded
  std::uint64_t tpdo1_count{0};
  std::uint64_t tpdo2_count{0};
  std::uint64_t syncs{0};         ///< that made a TPDO1 of this drive, operational, due
  std::uint64_t tpdo1_late{0};    ///< not there by the next SYNC (late, or lost)
  std::uint64_t short_frames{0};  ///< TPDOs, EMCYs, heartbeats with too few bytes

  DriveState state() const { return DecodeState(statusword); }
};

const char* Name(DriveStep step);

/// One line for a person: "node 3: operation enabled, torque 12.5 %, 10234 counts" or "node 3: no
/// answer to SDO 1600:02 while configuring". Allocates: not for cyclic code.
std::string Describe(const DriveReport& report);

}  // namespace mantle::firmware_sim
