#pragma once

#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "controller/estimator.h"
#include "controller/mpc.h"
#include "controller/position_history.h"
#include "controller/stage_cost.h"
#include "loop/metered_bus.h"
#include "loop/real_time_run.h"
#include "model/simulation.h"

namespace mantle::loop {

/// How a waypoint of the path was passed.
struct WaypointResult {
  double distance_m;  ///< least distance of the root; infinite where its turn has not come
  double time_s;      ///< when
  bool passed;        ///< within the tolerance, after the one before
};

/// How well the water's velocity was estimated [m/s, world].
struct CurrentResult {
  model::Vector3 estimated{model::Vector3::Zero()};  ///< at the end
  model::Vector3 actual{model::Vector3::Zero()};     ///< at the end
  double rms_error{0}, max_error{0};                 ///< over the second half of the run
};

/// What a closed loop has achieved, and at what cost: figures of a run, over its true states.
struct LoopResult {
  bool ok{false};
  std::string reason;  ///< why it ended before its time; empty where ok
  /// In what state it ended that a user has to know of, though it went on to its time: on
  /// fallbacks, or with drives in fault; else empty.
  std::string ended;
  std::set<int> lost_motors;    ///< that got no tension at the end (control_side/motor_health.h)
  double time_s{0}, wall_s{0};  ///< length of the run, in simulated and in wall time
  double cost{0};  ///< integral of the stage cost (controller/options.h) over the true states
  std::vector<std::pair<std::string, double>> cost_terms;  ///< its shares by the scene's weights
  /// Distance of the root from its reference, of the tip from its (after the approach), speed's
  /// error over a pulse [m, m, m/s]: mean and largest; and at the end.
  double mean_error{0}, max_error{0}, final_error{0};
  std::string error_name;                 ///< "position_m", "tip_m", "mean_speed_m_s"
  std::vector<WaypointResult> waypoints;  ///< in the order of the path
  double effort_n2_s{0};      ///< integral of the sum of squares of the tensions commanded
  double cable_work_j{0};     ///< that drums did on cables, positive part of the powers
  double mean_speed_m_s{0};   ///< of the root along its path
  double energetic_index{0};  ///< mean of W_o over mean of W_i ([physics.md] 5)
  double tension_error_n{0};  ///< root mean square of actual minus commanded, over all motors
  long limit_touches{0};      ///< motor periods in which a bound or rate cut what was commanded
  long cycles{0};             ///< SYNC periods that went well
  std::vector<double> prepare_s, solve_s;  ///< of every plan
  controller::MpcCounters counters;        ///< all zero for baselines
  long iterations{0};                      ///< of the solver, over all plans
  controller::EstimatorCounters estimator;
  std::optional<CurrentResult> current;  ///< where it was estimated, and the vehicle is the plant
  std::optional<RealTimeFigures> real_time;  ///< none in lock-step
  long late_cycles{0};                       ///< in real time, by more than a tenth of the period
  double worst_lateness_s{0};                ///< alike
  BusTraffic traffic;                        ///< from t = 0 on
  double bus_load{0};                        ///< share of 1 Mbit/s, worst case of stuffing
  double bus_load_peak{0};                   ///< of the fullest SYNC period, alike
  unsigned long long late_pdos{0};           ///< TPDO1 that had not come by the next SYNC
  model::RunResult plant;                    ///< by itself: works, balance, indices, last sample
};

/// Fills the figures that follow from states and tensions.
class LoopAccount {
 public:
  /// All must outlive it.
  /// `duration_s` of the whole run: the current's error counts from half of it.
  LoopAccount(const reduced::ReducedModel& model, const controller::ControlOptions& control,
              const controller::Reference& reference, double duration_s = 0);

  /// At t = 0, with the root's place.
  void Start(const model::Vector3& position, LoopResult* result);
  /// The state that was reached: error, waypoints. `tip`: place of the arm's tip [m], where the
  /// goal is its. Returns the error.
  double Look(const reduced::ReducedState& truth, const model::Vector3& tip, LoopResult* result);
  /// The period of length dt that begins there, with the tensions commanded now and before,
  /// and the actual ones.
  void Add(const reduced::ReducedState& truth, double dt_s, const model::VectorX& command_n,
           const model::VectorX& before_n, const model::VectorX& actual_n, LoopResult* result);
  /// The period of length dt at time t: the water's velocity as estimated, and as it was.
  void AddCurrent(double t_s, double dt_s, const model::Vector3& estimated,
                  const model::Vector3& actual, LoopResult* result);
  /// At the end: sums become means.
  void Conclude(LoopResult* result) const;

 private:
  model::Vector3 MeanVelocityError(const reduced::ReducedState& truth) const;

  const controller::ControlOptions& control_;
  const controller::Reference& reference_;
  controller::StageCost cost_;
  controller::PositionHistory history_;
  model::VectorX residual_;
  model::Vector3 position_before_{model::Vector3::Zero()};
  double travelled_m_{0}, squared_error_{0}, error_time_s_{0}, error_{0};
  double half_s_, current_time_s_{0};
  bool error_counts_{false};
};

}  // namespace mantle::loop
