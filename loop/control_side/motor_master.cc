#include "loop/control_side/motor_master.h"

#include <algorithm>
#include <cassert>

#include "loop/control_side/simulated_winch.h"
#include "loop/drive_options.h"

namespace mantle::loop {
namespace {

firmware_sim::MasterOptions MasterOf(int motors, std::int64_t period_us,
                                     const firmware_sim::SupervisorOptions& supervisor) {
  firmware_sim::MasterOptions master{{}, supervisor};
  for (int i = 1; i <= motors; ++i) {
    master.nodes.push_back(static_cast<firmware_sim::NodeId>(i));
  }
  firmware_sim::DriveSettings& settings = master.supervisor.settings;
  settings.period_us = period_us;
  settings.mode = firmware_sim::OperationMode::kCyclicTorque;
  settings.rpdo_timeout_us = std::max(settings.rpdo_timeout_us, 3 * period_us);
  return master;
}

const DriveOptions& Checked(const DriveOptions& options) {
  CheckDriveOptions(options);
  return options;
}

}  // namespace

MotorMaster::MotorMaster(firmware_sim::Bus& bus, int motors, const DriveOptions& drives,
                         const firmware_sim::SupervisorOptions& supervisor)
    : winch_map_(SimulatedWinch()),
      period_us_(Period_us(Checked(drives))),
      master_(bus, MasterOf(motors, period_us_, supervisor)),
      bring_up_(master_, winch_map_, drives) {}

void MotorMaster::SetTorques(std::span<const MotorCommand> commands) {
  assert(commands.size() == master_.drive_count());
  for (std::size_t i = 0; i < commands.size(); ++i) {
    master_.SetTarget(i, {.torque_permille = commands[i].torque_permille});
  }
}

Status MotorMaster::CheckStopped() const {
  for (int i = 0; i < motor_count(); ++i) {
    if (report(i).step != firmware_sim::DriveStep::kStopped) {
      return {false, "a drive did not stop as it should: " + firmware_sim::Describe(report(i))};
    }
  }
  return {};
}

double MotorMaster::ReportedReel_m(int i) const {
  return winch_map_.metres_per_count * (report(i).position_counts + 0.5 - bring_up_.zero_counts(i));
}

double MotorMaster::ReportedRate_m_s(int i) const {
  return winch_map_.metres_per_count * report(i).velocity_counts_s;
}

}  // namespace mantle::loop
