#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "firmware_sim/bus/bus.h"
#include "loop/messages.h"
#include "loop/plant_side/drive_rack.h"
#include "loop/plant_side/reel.h"
#include "loop/vehicle_side.h"
#include "model/simulation.h"

namespace mantle::loop {

/// How drives and plant are coupled, and how slack the cables are at first.
struct PlantSideOptions {
  int coupling_steps{0};         ///< per SYNC period; 0: CouplingSteps()
  double initial_slack_m{0.01};  ///< of every motor's cable, before it is taken up
};

/// Coupling steps per period that keep drum and cable resolved: the drum's mass on a cable of this
/// stiffness turns by at most a quarter of a radian per step (docs/vehicle.md has the measurement).
/// A step is a whole number of the drives' sub-steps.
int CouplingSteps(const DriveOptions& options);

/// Work between drums and plant since t = 0 [J]:
/// winch = plant + stored + dissipated, to the coupling's order.
struct CouplingWork {
  double winch_j{0};       ///< that the drums did on the cables
  double plant_j{0};       ///< that the cables did on the plant (trapezoidal over coupling steps)
  double dissipated_j{0};  ///< in the cables (alike)
  double stored_j{0};      ///< in the cables, against t = 0
};

/// The plant's side of the wire: the full plant pulled by the reels of CANopen drives. It knows the
/// rest of the world by the frames on its bus alone (vehicle_side.h has the order of calls).
///
/// Drives and plant advance by turns, in coupling steps of a whole share of the SYNC period
/// (reel.h): first the drives, with the cable's law about the plant's last state as their load,
/// then the plant, with the reels' motion as boundary condition. Time is an input, in microseconds
/// of the drives' clocks. Nothing allocates after construction but the plant's stepper on failure.
class PlantSide final : public DrivenVehicle {
 public:
  /// `plant` and `bus` must outlive it. Motor i is node i + 1. Throws std::invalid_argument naming
  /// motor or option, value and bound: 1 to 16 motors, each on cables only, every cable on one
  /// motor; period whole milliseconds. Throws BadRobot as Simulation does.
  PlantSide(const model::Plant& plant, const model::RunSettings& run,
            const std::vector<reduced::Actuator>& motors, const DriveOptions& drives,
            firmware_sim::Bus& bus, const PlantSideOptions& options = {});
  PlantSide(const PlantSide&) = delete;
  PlantSide& operator=(const PlantSide&) = delete;

  void Pump(std::int64_t now_us) override { rack_.Pump(now_us); }
  void Hold(std::int64_t now_us) override { rack_.AdvanceTo(now_us); }
  void Release(std::int64_t now_us) override;
  /// One coupling step, to `now_us`. Fails where the plant cannot be stepped.
  Status Advance(std::int64_t now_us) override;

  /// Text from which a plant of the same scene goes on: its own checkpoint, and where each drum
  /// stands. The drives' electronics begin anew, as after a loss of power; their brakes held.
  std::string Checkpoint() const;
  /// Before the first call of Hold. Throws BadRobot where the checkpoint is of another robot or
  /// damaged.
  void Restore(const std::string& checkpoint);

  std::int64_t period_us() const { return period_us_; }
  int coupling_steps() const override { return coupling_steps_; }
  int motor_count() const { return static_cast<int>(reels_.size()); }
  bool braked() const override { return rack_.braked(); }

  // The truth, for instruments and accounts.
  const model::PlantState& state() const { return simulation_.state(); }
  model::Sample Observe() { return simulation_.Observe(); }
  /// Works, balance and indices of the plant so far.
  model::RunResult PlantResult() { return simulation_.Result(); }
  const model::Simulation& simulation() const { return simulation_; }
  firmware_sim::WinchOutput winch(int i) const { return rack_[i].output(); }
  const firmware_sim::Drive& drive(int i) const { return rack_[i]; }
  firmware_sim::Drive& drive(int i) { return rack_[i]; }  ///< to disturb it
  const Reel& reel(int i) const { return reels_[i]; }
  /// True tension at the drum [N], T = G u for u per unit gain (reel.h).
  double drum_tension_n(int i) const { return drum_tension_n_[i]; }
  double length_m(int i) const { return length_m_[i]; }  ///< true lambda (reel.h)
  double length_rate_m_s(int i) const { return length_rate_m_s_[i]; }
  CouplingWork coupling_work(int i) const;

 private:
  model::RunSettings RunWithReels(model::RunSettings run);
  void ReadPlant();
  void AccountCoupling(double step_s);

  std::int64_t period_us_;
  int coupling_steps_;
  std::vector<Reel> reels_;
  model::Simulation simulation_;
  DriveRack rack_;
  std::int64_t origin_us_{0};    ///< t = 0
  std::vector<double> slack_m_;  ///< true reeled length where the slack is gone
  std::vector<double> drum_tension_n_, length_m_, length_rate_m_s_;
  struct Account {
    double winch_at_start_j{0}, stored_at_start_j{0};
    double plant_w{0}, dissipated_w{0};  ///< at the end of the last coupling step
    double plant_j{0}, dissipated_j{0}, stored_j{0};
  };
  std::vector<Account> accounts_;
};

}  // namespace mantle::loop
