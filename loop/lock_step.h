#pragma once

#include <cstdint>

#include "loop/control_side/motor_master.h"
#include "loop/vehicle_side.h"
#include "loop/wire.h"

namespace mantle::loop {

/// Runs the two sides of one process by turns, in simulated time, so that the same scene gives the
/// same bits whatever the machine does meanwhile:
///
///   BringUp            the plant held, until the motors are ready; then it is released: t = 0
///   Cycle              SYNC, frames both ways, a period of drives and plant, frames both ways
///   Stop               cycles until every drive is stopped and its cable let go
///
/// In a cycle the torques go out in RPDOs, SYNC makes the drives apply them and sample what their
/// TPDOs say, drives and plant advance by one period, the TPDOs are read. So what the motors report
/// is of the beginning of the last cycle, as on a real bus. Nothing allocates in a cycle. The
/// vehicle may be in another program (StepBus).
class LockStep {
 public:
  /// All must outlive it; the drives are as many as the motors.
  LockStep(DrivenVehicle& vehicle, MotorMaster& motors, StepBus& wire);

  /// The reason of a failure names the drive.
  Status BringUp();
  /// One SYNC period, with the torques that the motors were given. Fails where the plant cannot be
  /// stepped or the bus lost a frame; a drive's fault is no failure of the cycle: see the reports.
  Status Cycle();
  /// One period in which the master says nothing, as if its program had died: no RPDO, no SYNC, no
  /// heartbeat. The drives' watchdogs then act.
  Status CycleWithoutControl();
  /// The reason of a failure names the drive.
  Status Stop();

  std::int64_t now_us() const { return now_us_; }                ///< of the drives' clocks
  std::int64_t time_us() const { return now_us_ - origin_us_; }  ///< from t = 0

 private:
  void Exchange();
  void AdvanceTo(std::int64_t now_us);
  Status CheckBus() const;
  void HeldPeriod();
  Status AdvancePeriod(bool with_control);

  DrivenVehicle& vehicle_;
  MotorMaster& motors_;
  StepBus& wire_;
  std::int64_t now_us_{0}, origin_us_{0};
};

}  // namespace mantle::loop
