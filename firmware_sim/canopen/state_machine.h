#pragma once

#include "firmware_sim/canopen/cia402.h"

/// @file
/// The transitions of CiA 402 that a command causes, as one pure function. Transitions 0, 1
/// (automatic after the boot-up), 12 after a stop, 13 (fault) and 14 (reaction done) are the
/// drive's.
///
///   from \ command          shutdown  switch on  enable  disable V.  quick stop  fault reset
///   not ready                  -         -         -         -           -           -
///   switch-on disabled         2         -         -         -           -           -
///   ready to switch on         -         3        3+4        7           7           -
///   switched on                6         -         4        10          10           -
///   operation enabled          8         5         -         9          11           -
///   quick stop active          -         -        16*       12           -           -
///   fault reaction active      -         -         -         -           -           -
///   fault                      -         -         -         -           -          15
///
///   * only where 605A is 5 to 8

namespace mantle::firmware_sim {

/// Where a command leads.
struct Transition {
  DriveState next;
  int number;  ///< 0: none; 4 stands for 3 and 4 where ready passes through switched on
};

Transition CommandTransition(DriveState state, DriveCommand command, int quick_stop_option);

/// Whether the drive function is active or being wound down: operation enabled, quick stop active
/// or fault reaction active.
constexpr bool IsEnabled(DriveState state) {
  return state == DriveState::kOperationEnabled || state == DriveState::kQuickStopActive ||
         state == DriveState::kFaultReactionActive;
}

}  // namespace mantle::firmware_sim
