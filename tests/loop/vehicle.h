#pragma once

#include <memory>
#include <span>
#include <vector>

#include "loop/control_side/motor_master.h"
#include "loop/lock_step.h"
#include "loop/plant_side/plant_side.h"
#include "loop/wire.h"

/// A plant side and the motors' master on one wire, driven by torques: both sides of a loop without
/// estimator and controller.

namespace mantle::loop {

struct VehicleOptions {
  int coupling_steps{0};
  double initial_slack_m{0.01};
  std::int64_t bus_timeout_us{2'000'000};
  firmware_sim::CandumpWriter* record{nullptr};
  firmware_sim::SupervisorOptions supervisor{};
};

class Vehicle {
 public:
  Vehicle(const model::Plant& plant, const model::RunSettings& run,
          const std::vector<reduced::Actuator>& motors, const DriveOptions& drives,
          const VehicleOptions& options = {})
      : wire_(drives.bus, options.bus_timeout_us, options.record),
        plant_(plant, run, motors, drives, wire_.plant_station(),
               {options.coupling_steps, options.initial_slack_m}),
        motors_(wire_.control_station(), static_cast<int>(motors.size()), drives,
                options.supervisor),
        lock_step_(plant_, motors_, wire_) {}

  Status BringUp() { return lock_step_.BringUp(); }
  Status Cycle(std::span<const MotorCommand> commands) {
    motors_.SetTorques(commands);
    return lock_step_.Cycle();
  }
  Status CycleWithoutMaster() { return lock_step_.CycleWithoutControl(); }
  Status Stop() { return lock_step_.Stop(); }

  std::int64_t time_us() const { return lock_step_.time_us(); }
  int motor_count() const { return motors_.motor_count(); }
  int coupling_steps() const { return plant_.coupling_steps(); }
  const model::PlantState& state() const { return plant_.state(); }
  model::Sample Observe() { return plant_.Observe(); }
  const firmware_sim::DriveReport& report(int i) const { return motors_.report(i); }
  firmware_sim::WinchOutput winch(int i) const { return plant_.winch(i); }
  const firmware_sim::Drive& drive(int i) const { return plant_.drive(i); }
  double ReportedReel_m(int i) const { return motors_.ReportedReel_m(i); }
  double ReportedRate_m_s(int i) const { return motors_.ReportedRate_m_s(i); }
  const Reel& reel(int i) const { return plant_.reel(i); }
  double drum_tension_n(int i) const { return plant_.drum_tension_n(i); }
  double length_m(int i) const { return plant_.length_m(i); }
  double length_rate_m_s(int i) const { return plant_.length_rate_m_s(i); }
  CouplingWork coupling_work(int i) const { return plant_.coupling_work(i); }
  const controller::WinchMap& winch_map() const { return motors_.winch_map(); }

 private:
  Wire wire_;
  PlantSide plant_;
  MotorMaster motors_;
  LockStep lock_step_;
};

}  // namespace mantle::loop
