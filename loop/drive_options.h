#pragma once

#include <cstdint>

#include "loop/options.h"

/// @file
/// What both sides of the wire need to know of the table [drives].

namespace mantle::loop {

/// Least and largest value of each key.
namespace drive_bounds {
inline constexpr double kPeriod_s[] = {1e-3, 0.09};
inline constexpr double kCableStiffness_n_m[] = {1.0, 1e5};
inline constexpr double kCableDamping_n_s_m[] = {0.0, 1e3};
inline constexpr double kPretension_n[] = {0.0, 1.0};
}  // namespace drive_bounds

/// SYNC period [us]. Throws std::invalid_argument unless it is whole milliseconds within its
/// bounds.
std::int64_t Period_us(const DriveOptions& options);

/// Throws std::invalid_argument naming the key, its value and bounds.
void CheckDriveOptions(const DriveOptions& options);

}  // namespace mantle::loop
