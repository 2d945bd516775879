#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "controller/winch_map.h"
#include "firmware_sim/bus/candump_log.h"
#include "firmware_sim/bus/loop_bus.h"
#include "firmware_sim/bus/recording_bus.h"
#include "firmware_sim/master/master.h"
#include "loop/drive_rack.h"
#include "loop/lock_step_bus.h"
#include "loop/metered_bus.h"
#include "loop/options.h"
#include "loop/pacer.h"
#include "loop/reel.h"
#include "model/simulation.h"

/// The full plant pulled by CANopen drives, one SYNC period at a time:
///
///   Vehicle vehicle(plant, run, motors, drives);
///   if (!vehicle.BringUp().ok) ...
///   every period: vehicle.Cycle(commands)     // then state(), report(i), ... are of its end
///   vehicle.Stop()
///
/// Cycle k: targets go out in RPDOs, SYNC makes the drives apply them and sample what their TPDOs
/// say, drives and plant advance by one period, the TPDOs are read. So report(i) is of the
/// beginning of the last cycle, as on a real bus. Drives and plant advance by turns, in coupling
/// steps of a whole share of the period (reel.h): first the drives, with the cable's law about the
/// plant's last state as their load, then the plant, with the reels' motion as boundary condition.
///
/// Time is simulated, whatever the bus: with one that takes wall time every exchange is waited for
/// (lock_step_bus.h). Nothing in a cycle allocates but the plant's stepper on failure.

namespace mantle::loop {

struct MotorCommand {
  std::int16_t torque_permille{0};  ///< target torque, 1/1000 of rated (controller/winch_map.h)
};

struct VehicleOptions {
  int coupling_steps{0};                   ///< per period; 0: CouplingSteps()
  double initial_slack_m{0.01};            ///< of every motor's cable, taken up by BringUp
  bool real_time{false};                   ///< Cycle k begins at t0 + k period of the wall clock
  std::int64_t bus_timeout_us{2'000'000};  ///< for a frame of a bus that takes wall time
  firmware_sim::CandumpWriter* record{nullptr};  ///< every frame the master sends and receives
  firmware_sim::SupervisorOptions supervisor{};  ///< period and mode are set by the vehicle
};

/// Coupling steps per period that keep drum and cable resolved: the drum's mass on a cable of this
/// stiffness turns by at most a quarter of a radian per step (docs/vehicle.md has the measurement).
/// A step is a whole number of the drives' sub-steps.
int CouplingSteps(const DriveOptions& options);

/// The figures of the simulated drive (firmware_sim/canopen/motor_data.h).
controller::WinchMap SimulatedWinch();

/// Work between drums and plant since t = 0 [J]:
/// winch = plant + stored + dissipated, to the coupling's order.
struct CouplingWork {
  double winch_j{0};       ///< that the drums did on the cables
  double plant_j{0};       ///< that the cables did on the plant (trapezoidal over coupling steps)
  double dissipated_j{0};  ///< in the cables (alike)
  double stored_j{0};      ///< in the cables, against t = 0
};

class Vehicle {
 public:
  /// `plant` must outlive the vehicle. Throws std::invalid_argument naming motor or option, value
  /// and bound: 1 to 16 motors, each on cables only, every cable on one motor; period whole
  /// milliseconds. Throws BadRobot as Simulation does, std::system_error where the bus cannot be
  /// opened.
  Vehicle(const model::Plant& plant, const model::RunSettings& run,
          const std::vector<reduced::Actuator>& motors, const DriveOptions& drives,
          const VehicleOptions& options = {});
  Vehicle(const Vehicle&) = delete;
  Vehicle& operator=(const Vehicle&) = delete;

  /// Before t = 0, with the plant held at its initial state: the drives boot, are configured and
  /// enabled, find their cables' slack end and pull with the pretension. The reason of a failure
  /// names the drive.
  model::StepStatus BringUp();

  /// One SYNC period. Fails where the plant cannot be stepped or the bus lost a frame; a drive's
  /// fault is no failure of the cycle: see report(i). `commands` has one entry per motor.
  model::StepStatus Cycle(std::span<const MotorCommand> commands);

  /// Asks the drives to ramp their torque to zero, let go and stop; Cycle goes on meanwhile, its
  /// commands without effect.
  void RequestStop() { master_->Stop(now_us_); }
  bool stopped() const { return master_->stopped(); }
  /// RequestStop and cycles until every drive is stopped and its cable let go. The reason of a
  /// failure names the drive.
  model::StepStatus Stop();

  /// One period in which the master says nothing, as if its program had died: no RPDO, no SYNC, no
  /// heartbeat. The drives' watchdogs then act.
  model::StepStatus CycleWithoutMaster();

  std::int64_t time_us() const { return now_us_ - origin_us_; }  ///< from t = 0
  std::int64_t period_us() const { return period_us_; }
  int motor_count() const { return static_cast<int>(reels_.size()); }
  int coupling_steps() const { return coupling_steps_; }

  const model::PlantState& state() const { return simulation_.state(); }
  model::Sample Observe() { return simulation_.Observe(); }
  /// Works, balance and indices of the plant so far.
  model::RunResult PlantResult() { return simulation_.Result(); }
  const model::Simulation& simulation() const { return simulation_; }

  const firmware_sim::DriveReport& report(int i) const { return master_->drive(i); }
  firmware_sim::WinchOutput winch(int i) const { return (*rack_)[i].output(); }
  const firmware_sim::Drive& drive(int i) const { return (*rack_)[i]; }
  /// What a report's position says of the reeled length since the slack was gone [m], and rate.
  double ReportedReel_m(int i) const;
  double ReportedRate_m_s(int i) const;

  const Reel& reel(int i) const { return reels_[i]; }
  /// True tension at the drum, T = G u for u per unit gain; true length lambda and rate (reel.h).
  double drum_tension_n(int i) const { return drum_tension_n_[i]; }
  double length_m(int i) const { return length_m_[i]; }
  double length_rate_m_s(int i) const { return length_rate_m_s_[i]; }
  CouplingWork coupling_work(int i) const;

  const controller::WinchMap& winch_map() const { return winch_map_; }
  firmware_sim::BusCounters bus_counters() const { return master_bus_->counters(); }
  const BusTraffic& traffic() const { return meter_->traffic(); }
  const firmware_sim::MasterCounters& master_counters() const { return master_->counters(); }
  const Pacer& pacer() const { return pacer_; }

 private:
  // vehicle.cc
  void OpenBuses(const std::string& spec);
  void AdvanceBuses();
  /// Frames both ways at the present time.
  void Exchange();
  model::StepStatus CheckBus() const;
  model::StepStatus Couple(bool with_master);
  model::StepStatus CoupleOnce(std::int64_t to_us);
  void ReadPlant();
  void AccountCoupling(double step_s);

  // bring_up.cc
  model::StepStatus Enable();
  model::StepStatus TakeUpSlack();
  void RunDrives(std::int64_t span_us, bool sync);
  model::StepStatus CheckDrives(const char* what) const;

  model::RunSettings RunWithReels(model::RunSettings run);

  VehicleOptions options_;
  DriveOptions drive_options_;
  controller::WinchMap winch_map_;
  std::int64_t period_us_;
  int coupling_steps_;
  std::vector<Reel> reels_;
  model::Simulation simulation_;

  std::unique_ptr<firmware_sim::LoopMedium> medium_;
  std::unique_ptr<firmware_sim::Bus> master_station_, drive_station_;
  std::unique_ptr<LockStepBus> master_link_, drive_link_;
  std::unique_ptr<MeteredBus> meter_;
  std::unique_ptr<firmware_sim::RecordingBus> recorder_;
  firmware_sim::Bus* master_bus_{nullptr};  ///< outermost
  firmware_sim::Bus* drive_bus_{nullptr};
  std::unique_ptr<DriveRack> rack_;
  std::unique_ptr<firmware_sim::Master> master_;
  Pacer pacer_;

  std::int64_t now_us_{0};           ///< of the drives' clocks
  std::int64_t origin_us_{0};        ///< t = 0
  std::vector<double> slack_m_;      ///< true reeled length where the slack is gone
  std::vector<double> zero_counts_;  ///< that length as BringUp found it
  std::vector<double> drum_tension_n_, length_m_, length_rate_m_s_;
  struct Account {
    double winch_at_start_j{0}, stored_at_start_j{0};
    double plant_w{0}, dissipated_w{0};  ///< at the end of the last coupling step
    double plant_j{0}, dissipated_j{0}, stored_j{0};
  };
  std::vector<Account> accounts_;
};

}  // namespace mantle::loop
