#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>

#include "firmware_sim/canopen/canopen.h"
#include "firmware_sim/canopen/cia402.h"
#include "firmware_sim/canopen/sdo_client.h"

namespace mantle::firmware_sim {

/// What the master writes into every drive before it starts it: the PDOs of the profile
/// (communication parameters and mapping, in the order CiA 301 7.5.2.36 asks: invalid, mapping,
/// valid), heartbeats, interpolation period, limits and mode. Each step is one expedited download.
struct DriveSettings {
  std::int64_t period_us{10'000};                    ///< SYNC period, 60C2
  std::int64_t master_heartbeat_us{50'000};          ///< how often the master's heartbeat leaves
  std::int64_t master_silence_us{200'000};           ///< 1016: the drive's patience with the master
  std::int64_t drive_heartbeat_us{100'000};          ///< 1017
  std::int64_t rpdo_timeout_us{100'000};             ///< 1400:5
  bool second_pdos{true};                            ///< RPDO2 and TPDO2 as well
  OperationMode mode{OperationMode::kCyclicTorque};  ///< 6060
  std::uint32_t torque_slope_permille_s{10'000};     ///< 6087
  std::uint16_t max_torque_permille{1000};           ///< 6072
  std::int32_t min_position_counts{INT32_MIN};       ///< 607D:1
  std::int32_t max_position_counts{INT32_MAX};       ///< 607D:2
  std::uint32_t following_error_counts{2000};        ///< 6065
};

/// Throws std::invalid_argument with name, value and bound.
void CheckSettings(const DriveSettings& settings);

/// The `step`-th write for `node`, none after the last. Does not allocate.
std::optional<SdoWrite> ConfigurationStep(const DriveSettings& settings, NodeId node,
                                          std::size_t step);

}  // namespace mantle::firmware_sim
