#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "reduced/reduced_model.h"

/// @file
/// What passes between the two sides of a closed loop besides CAN frames, and what both say of how
/// a call went. Plain values: in one process they go through a SensorChannel, between processes
/// over a network.

namespace mantle::loop {

/// How a call went; where it failed, why.
struct Status {
  bool ok{true};
  std::string reason;
};

/// One motor's cable path ([physics.md] 2): its length against that at t = 0, and its rate.
struct CableReading {
  double length_m{0}, rate_m_s{0};
};

/// One reading of an instrument ([[sensors.instrument]], docs/instruments.md), as it arrives.
struct Measurement {
  int instrument{0};  ///< its place in the scene's list, from 0
  double time_s{0};   ///< when it was taken, from t = 0; at or before the message's
  int size{0};        ///< of the entries of value that are used, 1 to 6; the others are 0
  std::array<double, 6> value{};  ///< in the instrument's units and frame
};

/// From the plant side to the control side, once per SYNC, before it.
struct Sensors {
  double time_s{0};  ///< of the SYNC, from t = 0
  /// The vehicle is held at its start until the control side is ready, and the time stands.
  bool held{false};
  /// Whether a measurement of the state arrives now. The first message always has one.
  bool has_state{false};
  reduced::ReducedState
      state;  ///< the earth's; stamped with the time it was taken, at or before time_s
  std::vector<CableReading> cables;  ///< one per motor, as measured now
  /// What the named instruments say that arrives now, the oldest first; empty where none is named.
  std::vector<Measurement> measurements;
};

/// From the control side: what the next RPDOs ask of one motor.
struct MotorCommand {
  std::int16_t torque_permille{0};  ///< target torque, 1/1000 of rated (controller/winch_map.h)
};

}  // namespace mantle::loop
