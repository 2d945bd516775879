#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "controller/winch_map.h"
#include "firmware_sim/master/master.h"
#include "loop/control_side/bring_up.h"
#include "loop/messages.h"
#include "loop/options.h"

namespace mantle::loop {

/// The control side's hand on the motors: the CANopen master of the drives, their bring-up, and
/// what their reports say of the reels. It knows the vehicle by the frames on its bus alone.
///
///   until ready():       BringUp(now), Sync(now)
///   every period after:  SetTorques, Sync(now)
///   at any instant:      Poll(now), a few times a period
///   at the end:          RequestStop(now), and periods until stopped()
///
/// Torques given before a SYNC are applied by the drives at it; report(i) is of the last SYNC, so
/// of the beginning of the period that ended. Nothing allocates after construction but reasons of
/// failures.
class MotorMaster {
 public:
  /// `bus` must outlive it. Motor i is node i + 1. `supervisor`'s period and mode are set here.
  /// Throws std::invalid_argument naming option, value and bound.
  MotorMaster(firmware_sim::Bus& bus, int motors, const DriveOptions& drives,
              const firmware_sim::SupervisorOptions& supervisor = {});
  MotorMaster(const MotorMaster&) = delete;
  MotorMaster& operator=(const MotorMaster&) = delete;

  /// Reads what has come, sends what is due.
  void Poll(std::int64_t now_us) { master_.Poll(now_us); }
  /// See bring_up.h. The reason of a failure names the drive.
  Status BringUp(std::int64_t now_us, std::span<const CableReading> cables = {}) {
    return bring_up_.Turn(now_us, cables);
  }
  /// Bring-up begins anew, wherever the drives are.
  void Restart() { bring_up_.Restart(); }
  bool ready() const { return bring_up_.done(); }
  /// One entry per motor.
  void SetTorques(std::span<const MotorCommand> commands);
  /// Sends this period's RPDOs and SYNC.
  void Sync(std::int64_t now_us) { master_.Cycle(now_us); }

  /// Asks the drives to ramp their torque to zero, let go and stop; torques have no effect then.
  void RequestStop(std::int64_t now_us) { master_.Stop(now_us); }
  bool stopped() const { return master_.stopped(); }
  /// Fails, naming the drive, unless every one stopped as it should.
  Status CheckStopped() const;

  std::int64_t period_us() const { return period_us_; }
  int motor_count() const { return static_cast<int>(master_.drive_count()); }
  const firmware_sim::DriveReport& report(int i) const {
    return master_.drive(static_cast<std::size_t>(i));
  }
  /// What a report's position says of the reeled length since the slack was gone [m], and rate.
  double ReportedReel_m(int i) const;
  double ReportedRate_m_s(int i) const;

  const controller::WinchMap& winch_map() const { return winch_map_; }
  const firmware_sim::MasterCounters& counters() const { return master_.counters(); }
  /// Every drive's step and state, one a line. Allocates.
  std::string Describe() const { return firmware_sim::Describe(master_); }

 private:
  controller::WinchMap winch_map_;
  std::int64_t period_us_;
  firmware_sim::Master master_;
  loop::BringUp bring_up_;
};

}  // namespace mantle::loop
