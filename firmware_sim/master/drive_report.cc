#include "firmware_sim/master/drive_report.h"

#include <fmt/format.h>

namespace mantle::firmware_sim {

namespace {

std::string DescribeState(const DriveReport& report) {
  if (!report.status_valid) return Name(report.nmt);
  return fmt::format("{}, torque {:.1f} %, {} counts", Name(report.state()),
                     report.torque_permille / 10.0, report.position_counts);
}

std::string DescribeProblem(const DriveReport& report) {
  const char* step = Name(report.problem_step);
  const auto object =
      fmt::format("{:04X}:{:02X}", report.problem_object.index, report.problem_object.sub);
  switch (report.problem) {
    case DriveProblem::kNone:
      return {};
    case DriveProblem::kNoAnswer:
      return fmt::format("no answer to SDO {} while {}", object, step);
    case DriveProblem::kWrongDevice:
      return fmt::format(
          "object {} is 0x{:X}, must be 0x{:X}: not a drive of this vehicle, while {}", object,
          report.problem_value, report.expected_value, step);
    case DriveProblem::kRefused:
      return fmt::format("SDO {} refused, 0x{:08X} {}, while {}", object, report.problem_abort_code,
                         Name(static_cast<SdoAbort>(report.problem_abort_code)), step);
    case DriveProblem::kStepTimeout:
      return fmt::format("time-out while {}", step);
    case DriveProblem::kFault:
      return report.emcy_count > 0 ? fmt::format("fault 0x{:04X} {} while {}",
                                                 static_cast<unsigned>(report.emcy[0].code),
                                                 Name(report.emcy[0].code), step)
                                   : fmt::format("fault while {}", step);
    case DriveProblem::kHeartbeatLost:
      return fmt::format("heartbeat lost while {}", step);
    case DriveProblem::kDuplicateNode:
      return fmt::format("two drives answer with this node number while {}", step);
  }
  return "unknown problem";
}

}  // namespace

const char* Name(DriveStep step) {
  switch (step) {
    case DriveStep::kIdentify:
      return "identifying";
    case DriveStep::kConfigure:
      return "configuring";
    case DriveStep::kStart:
      return "starting";
    case DriveStep::kExamine:
      return "examining";
    case DriveStep::kClearFault:
      return "resetting the fault";
    case DriveStep::kEnable:
      return "enabling";
    case DriveStep::kEnabled:
      return "enabled";
    case DriveStep::kReady:
      return "ready";
    case DriveStep::kFaulted:
      return "in fault";
    case DriveStep::kLost:
      return "lost";
    case DriveStep::kStopRamp:
      return "ramping down";
    case DriveStep::kStopDisable:
      return "disabling";
    case DriveStep::kStopNmt:
      return "stopping";
    case DriveStep::kStopped:
      return "stopped";
    case DriveStep::kFailed:
      return "failed";
  }
  return "unknown";
}

std::string Describe(const DriveReport& report) {
  std::string line = fmt::format("node {}: {}", report.node, Name(report.step));
  if (report.heard) line += ", " + DescribeState(report);
  if (report.problem != DriveProblem::kNone) line += "; " + DescribeProblem(report);
  return line;
}

}  // namespace mantle::firmware_sim
