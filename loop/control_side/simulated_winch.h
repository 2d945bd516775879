#pragma once

#include <vector>

#include "controller/winch_map.h"
#include "firmware_sim/master/drive_supervisor.h"

namespace mantle::loop {

/// The figures of the simulated drive, as its data sheet gives them
/// (firmware_sim/canopen/motor_data.h).
controller::WinchMap SimulatedWinch();

/// What a drive has to say of itself so that the map above is true of it: vendor and product
/// (1018), supported modes (6502), rated current and torque (6075, 6076), encoder, gear and drum
/// (608F, 6091, 6092).
std::vector<firmware_sim::ExpectedObject> ExpectedOfWinch();

}  // namespace mantle::loop
