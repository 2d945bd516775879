#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <string>

#include "loop/plant_side/gated_bus.h"
#include "loop/sensor_channel.h"
#include "loop/timing.h"
#include "loop/vehicle_side.h"

namespace mantle::loop {

/// The clock that a vehicle keeps, and where it starts.
struct PlantRunnerOptions {
  std::int64_t period_us{10'000};  ///< of SYNC
  double start_s{0};               ///< time of the vehicle at its start: above 0 where it resumes
  bool free{false};                ///< not held: goes at once
};

/// Figures of a plant's run; whole when it has ended.
struct PlantRunnerCounters {
  DurationHistogram lateness;   ///< of a slot's begin, after the instant at which it was due
  DurationHistogram work;       ///< of a slot
  long periods{0};              ///< since the vehicle was released
  long late_periods{0};         ///< that ended later than due by more than a tenth of the period
  long syncs{0};                ///< SYNCs that the drives got
  long foreign{0};              ///< frames that carried an identifier of the drives
  std::uint32_t foreign_id{0};  ///< of the first one
};

/// The plant side in real time, in one thread: vehicle and drives keep the wall clock whatever the
/// control side does. What comes late is late, and the drives' watchdogs see it.
///
/// Until `go` the vehicle is held at its start, the drives run, and the first sensor message is
/// told every period. The first SYNC from then on is t = 0 (or the time at which it resumes), and
/// sets the phase of the vehicle's clock; CLOCK_MONOTONIC keeps it.
///
/// From then on time goes in slots of one or more coupling steps (vehicle_side.h), a whole share of
/// the period. A slot is computed when a small part of it, the guard, has passed: frames that were
/// on the bus by then count as of its beginning. So a SYNC that is late by less than the guard acts
/// where one in lock-step would, and the message of an instant is there shortly before it. A later
/// frame counts as of the next slot. Slots are as short as the vehicle's own cost allows for that.
/// A vehicle that was held up catches up, frame by frame as they came.
class PlantRunner {
 public:
  /// All must outlive it; `bus` is the vehicle's own.
  PlantRunner(VehicleSide& vehicle, GatedBus& bus, SensorSink& sensors,
              const PlantRunnerOptions& options);

  /// Until `stop`. `go_us` as FastLoop::go_us. `observer` is called for the state of every period's
  /// end, and for the start, in this thread. Fails where the vehicle cannot go on.
  Status Run(const std::atomic<bool>& stop, const std::function<std::int64_t()>& go_us,
             const std::function<void(double time_s)>& observer = {});

  const PlantRunnerCounters& counters() const { return counters_; }
  /// Why SCHED_FIFO was refused; empty where it was not.
  const std::string& refused() const { return refused_; }
  /// Length of a slot now, and of its guard [us].
  std::int64_t slot_us() const { return slot_us_; }
  std::int64_t guard_us() const { return guard_us_; }

 private:
  Status HoldUntilGo(const std::atomic<bool>& stop, const std::function<std::int64_t()>& go_us);
  Status Slot();
  void SetSteps(int steps);
  void Adapt();

  VehicleSide& vehicle_;
  GatedBus& bus_;
  SensorSink& sensors_;
  PlantRunnerOptions options_;
  std::int64_t slot_us_, guard_us_;
  int steps_{1};                 ///< of coupling, per slot
  double step_us_{0};            ///< what one costs, the longest of late
  std::int64_t now_us_{0};       ///< of the drives' clocks
  std::int64_t origin_us_{0};    ///< CLOCK_MONOTONIC where that is 0
  std::int64_t released_us_{0};  ///< of the drives' clocks
  Sensors message_;
  PlantRunnerCounters counters_;
  std::string refused_;
};

}  // namespace mantle::loop
