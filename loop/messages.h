#pragma once

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

/// From the plant side to the control side, once per SYNC, before it.
struct Sensors {
  double time_s{0};  ///< of the SYNC, from t = 0
  /// Whether a measurement of the state arrives now. The first message always has one.
  bool has_state{false};
  reduced::ReducedState
      state;  ///< the earth's; stamped with the time it was taken, at or before time_s
  std::vector<CableReading> cables;  ///< one per motor, as measured now
};

/// From the control side: what the next RPDOs ask of one motor.
struct MotorCommand {
  std::int16_t torque_permille{0};  ///< target torque, 1/1000 of rated (controller/winch_map.h)
};

}  // namespace mantle::loop
