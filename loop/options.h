#pragma once

#include <string>

#include "model/robot.h"

/// @file
/// What a scene says of the drives and of how the plant differs from the controller's model: the
/// tables [drives] and [mismatch].

namespace mantle::loop {

/// The table [drives]: the bus, its period, and the cables between drums and vehicle.
struct DriveOptions {
  std::string vehicle{"plant"};     ///< what they pull: its name in vehicle_side.h
  std::string bus{"loop"};          ///< as OpenBus takes it
  double period_s{0.01};            ///< of SYNC and of the fast loop
  double cable_stiffness_n_m{500};  ///< of a motor's cable, at the drum
  double cable_damping_n_s_m{2};
  double pretension_n{0.02};  ///< taken up before t = 0
};

/// Factors on the plant's parameters that the controller does not know.
using Mismatch = model::Mismatch;

}  // namespace mantle::loop
