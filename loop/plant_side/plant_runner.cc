#include "loop/plant_side/plant_runner.h"

#include <algorithm>
#include <cmath>

#include "firmware_sim/bus/socket_time.h"

namespace mantle::loop {

using firmware_sim::MonotonicTime_us;
using firmware_sim::RealTime_us;
using firmware_sim::SleepUntil;

namespace {

constexpr std::int64_t kTick_us = 1000;  // while held
constexpr std::int64_t kShortestSlot_us = 2000;
constexpr std::int64_t kLongestGuard_us = 1000;

/// From the message of an instant to its SYNC, for the control side.
constexpr std::int64_t kControl_us = 700;
constexpr double kFall = 0.999;  // of the longest cost, per coupling step

}  // namespace

PlantRunner::PlantRunner(VehicleSide& vehicle, GatedBus& bus, SensorSink& sensors,
                         const PlantRunnerOptions& options)
    : vehicle_(vehicle), bus_(bus), sensors_(sensors), options_(options) {
  Adapt();
}

void PlantRunner::SetSteps(int steps) {
  steps_ = steps;
  slot_us_ = steps * options_.period_us / vehicle_.coupling_steps();
  guard_us_ = std::min(slot_us_ / 2, kLongestGuard_us);
}

// At the end of a period. The fewest steps that divide it and leave time for guard, vehicle and
// control side; all of them where none do.
void PlantRunner::Adapt() {
  const int steps = vehicle_.coupling_steps();
  for (int n = 1; n <= steps; ++n) {
    if (steps % n != 0) continue;
    SetSteps(n);
    const auto needed_us =
        guard_us_ + kControl_us + static_cast<std::int64_t>(step_us_ * static_cast<double>(n));
    if (slot_us_ >= std::max(kShortestSlot_us, needed_us)) return;
  }
}

Status PlantRunner::Run(const std::atomic<bool>& stop, const std::function<std::int64_t()>& go_us,
                        const std::function<void(double)>& observer) {
  refused_ = RunAtOnce(kPlantPriority);
  if (Status status = vehicle_.Look(options_.start_s); !status.ok) return status;
  vehicle_.Measure(&message_);
  origin_us_ = MonotonicTime_us();
  if (Status status = HoldUntilGo(stop, go_us); !status.ok) return status;
  if (observer && !stop) observer(options_.start_s);
  for (long slot = 0; !stop.load(std::memory_order_relaxed); ++slot) {
    if (Status status = Slot(); !status.ok) return status;
    const std::int64_t passed_us = now_us_ - released_us_;
    if (passed_us % options_.period_us != 0) continue;
    // As lock-step counts: no sum of rounded periods.
    const double period_s = static_cast<double>(options_.period_us) / 1e6;
    const long before = std::lround(options_.start_s / period_s);
    const double time_s = static_cast<double>(before + passed_us / options_.period_us) * period_s;
    if (Status status = vehicle_.Look(time_s); !status.ok) return status;
    vehicle_.Measure(&message_);
    sensors_.Send(message_);
    ++counters_.periods;
    const std::int64_t late_us = MonotonicTime_us() - origin_us_ - now_us_;
    if (late_us > options_.period_us / 10) ++counters_.late_periods;
    if (observer) observer(time_s);
    Adapt();
  }
  counters_.syncs = static_cast<long>(bus_.syncs());
  return {};
}

Status PlantRunner::HoldUntilGo(const std::atomic<bool>& stop,
                                const std::function<std::int64_t()>& go_us) {
  while (!stop.load(std::memory_order_relaxed)) {
    SleepUntil(origin_us_ + now_us_ + kTick_us / 2);
    const std::int64_t wall_us = MonotonicTime_us();
    bus_.Open(std::min(wall_us, origin_us_ + now_us_ + kTick_us));
    const std::int64_t go = options_.free ? 0 : go_us();
    const std::int64_t offset_us = wall_us - RealTime_us();
    const auto sync = go == INT64_MAX ? std::nullopt : bus_.FindSync(go + offset_us);
    if (options_.free || sync) {
      vehicle_.Release(now_us_);
      if (Status status = vehicle_.Look(options_.start_s); !status.ok) return status;
      released_us_ = now_us_;
      if (sync) {
        // Its clock shows a whole number of periods when a SYNC is due, however late this one was.
        const std::int64_t due_us = go + offset_us + options_.period_us / 2;
        const std::int64_t later = (*sync - due_us + options_.period_us / 2) / options_.period_us;
        origin_us_ = due_us + std::max<std::int64_t>(later, 0) * options_.period_us - now_us_;
      }
      return {};
    }
    vehicle_.Pump(now_us_);
    vehicle_.Hold(now_us_ + kTick_us);
    now_us_ += kTick_us;
    if (now_us_ % options_.period_us != 0) continue;
    message_.held = true;
    sensors_.Send(message_);
    message_.held = false;
  }
  return {};
}

Status PlantRunner::Slot() {
  const std::int64_t due_us = origin_us_ + now_us_ + guard_us_;
  SleepUntil(due_us);
  const std::int64_t begin_us = MonotonicTime_us();
  counters_.lateness.Add(begin_us - due_us);
  bus_.Open(due_us);
  vehicle_.Pump(now_us_);
  const std::int64_t start_us = now_us_;
  for (int i = 1; i <= steps_; ++i) {
    const std::int64_t to_us = start_us + i * slot_us_ / steps_;
    if (Status status = vehicle_.Advance(to_us); !status.ok) return status;
    now_us_ = to_us;
  }
  const std::int64_t took_us = MonotonicTime_us() - begin_us;
  counters_.work.Add(took_us);
  step_us_ = std::max(kFall * step_us_, static_cast<double>(took_us) / steps_);
  return {};
}

}  // namespace mantle::loop
