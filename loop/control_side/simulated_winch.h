#pragma once

#include "controller/winch_map.h"

namespace mantle::loop {

/// The figures of the simulated drive, as its data sheet gives them
/// (firmware_sim/canopen/motor_data.h).
controller::WinchMap SimulatedWinch();

}  // namespace mantle::loop
