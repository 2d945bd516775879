#pragma once

#include <cstdint>

#include "loop/options.h"

/// @file
/// What both sides of the wire need to know of the table [drives].

namespace mantle::loop {

/// SYNC period [us]. Throws std::invalid_argument unless it is 1 to 100 whole milliseconds.
std::int64_t Period_us(const DriveOptions& options);

/// Throws std::invalid_argument naming the key, its value and bounds.
void CheckDriveOptions(const DriveOptions& options);

}  // namespace mantle::loop
