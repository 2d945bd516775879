#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "firmware_sim/bus/can_frame.h"

/// @file
/// Frames in words: what a frame means under the profile (canopen.h, cia402.h), with the mapping of
/// the profile for PDOs. For people and logs; allocates.

namespace mantle::firmware_sim {

/// One value that a frame carries.
struct TrafficField {
  std::string_view name;  ///< "state", "torque_percent", ...: the key in JSON
  std::variant<std::int64_t, double, std::string> value;
};

/// A frame in the terms of the profile.
struct DecodedFrame {
  std::string_view service;  ///< "NMT", "SYNC", "EMCY", "TPDO1", "SDO request", ..., "unknown"
  int node{0};               ///< 0: none, or all
  std::vector<TrafficField> fields;
  std::string text;  ///< the same in one line, e.g. "operation enabled, torque 12.5 %"
};

/// Takes any frame; what the profile does not know is service "unknown" (or "error frame").
DecodedFrame Decode(const CanFrame& frame);

/// id, data and meaning in one line, e.g.
/// "181  37 12 64 00 10 27 00 00  TPDO1 node 1: operation enabled, torque 10.0 %, 10000 counts"
std::string Describe(const CanFrame& frame);

}  // namespace mantle::firmware_sim
