#include "firmware_sim/canopen/state_machine.h"

namespace mantle::firmware_sim {

Transition CommandTransition(DriveState state, DriveCommand command, int quick_stop_option) {
  using enum DriveState;
  using enum DriveCommand;
  const bool takes_voltage = command == kDisableVoltage || command == kQuickStop;
  switch (state) {
    case kSwitchOnDisabled:
      if (command == kShutdown) return {kReadyToSwitchOn, 2};
      break;
    case kReadyToSwitchOn:
      if (command == kSwitchOn) return {kSwitchedOn, 3};
      if (command == kEnableOperation) return {kOperationEnabled, 4};
      if (takes_voltage) return {kSwitchOnDisabled, 7};
      break;
    case kSwitchedOn:
      if (command == kEnableOperation) return {kOperationEnabled, 4};
      if (command == kShutdown) return {kReadyToSwitchOn, 6};
      if (takes_voltage) return {kSwitchOnDisabled, 10};
      break;
    case kOperationEnabled:
      if (command == kSwitchOn) return {kSwitchedOn, 5};
      if (command == kShutdown) return {kReadyToSwitchOn, 8};
      if (command == kDisableVoltage) return {kSwitchOnDisabled, 9};
      if (command == kQuickStop) return {kQuickStopActive, 11};
      break;
    case kQuickStopActive:
      if (command == kDisableVoltage) return {kSwitchOnDisabled, 12};
      if (command == kEnableOperation && quick_stop_option >= 5) return {kOperationEnabled, 16};
      break;
    case kFault:
      if (command == kFaultReset) return {kSwitchOnDisabled, 15};
      break;
    case kNotReady:
    case kFaultReactionActive:
      break;
  }
  return {state, 0};
}

}  // namespace mantle::firmware_sim
