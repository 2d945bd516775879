#pragma once

#include <atomic>
#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "loop/control_side/fast_loop.h"
#include "loop/plant_side/plant_runner.h"
#include "loop/plant_watch.h"

namespace mantle::loop {

/// Figures of a run in real time.
struct RealTimeFigures {
  FastLoopCounters control;
  PlantRunnerCounters plant;
  DurationHistogram timer;  ///< a bare timer's lateness beside it
  double rate_hz{0};        ///< achieved, of SYNC
  long late_plans{0}, overtaken_plans{0}, stuck_cycles{0};
  /// SCHED_FIFO was refused, and why; empty where it was not.
  std::string refused;
};

/// Both sides of a loop in one process and in real time: vehicle and control side in threads of
/// their own, joined by a bus and a sensor channel alone, planner and listener in two more. What
/// happened comes to the listener, the calling thread, by value.
class RealTimeRun {
 public:
  /// A SYNC period, in order; the state is that of its beginning.
  struct Step {
    const ControlFrame& control;
    const PlantFrame& plant;
    const PlantSnapshot* snapshot;  ///< null but at output instants
    const PlanReport* plan;         ///< null where the controller has made none at this SYNC
  };
  /// What it runs; all must outlive it.
  struct Parts {
    VehicleSide& vehicle;
    PlantSide* plant;  ///< of the vehicle; null where it is of a user's own
    GatedBus& gate;    ///< its station
    SensorChannel& channel;
    ControlSide& control;
  };
  /// How long, and by which clocks.
  struct Options {
    double duration_s{0}, output_interval_s{0};
    std::int64_t period_us{10'000};
    int tip_arm{-1};  ///< -1: of no interest
    /// FastLoopOptions::on_phase.
    std::function<void(ControlPhase)> on_phase{};
  };
  RealTimeRun(const Parts& parts, const Options& options);

  /// To the duration and until the drives are stopped. `listener` returns false to end the run.
  /// `idle` is called now and then in between.
  Status Run(const std::function<bool(const Step&)>& listener, const std::function<Status()>& idle);
  /// When Run has ended.
  RealTimeFigures figures() const;
  bool complete() const { return loop_.complete(); }

 private:
  void Drain();
  bool Match(const std::function<bool(const Step&)>& listener, bool at_end);

  Parts parts_;
  Options options_;
  firmware_sim::SpscRing<ControlFrame> control_frames_;
  PlantWatch watch_;
  FastLoop loop_;
  PlantRunner runner_;
  // The listener's.
  std::deque<ControlFrame> control_;
  std::deque<PlantFrame> plant_;
  std::deque<PlanReport> plans_;
  std::optional<ControlFrame> last_;
  std::int64_t waited_us_{0};
  DurationHistogram timer_;
  double wall_s_{0};
};

}  // namespace mantle::loop
