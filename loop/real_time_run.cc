#include "loop/real_time_run.h"

#include <cmath>
#include <thread>

#include "firmware_sim/bus/socket_time.h"

namespace mantle::loop {
namespace {

using firmware_sim::MonotonicTime_us;
using firmware_sim::SleepFor;

constexpr std::size_t kMostFrames = 1024;
constexpr std::int64_t kIdle_us = 4000;
/// A plan that is under way is waited for with what is told of its SYNC.
constexpr std::int64_t kPlanPatience_us = 500'000;
constexpr std::int64_t kBrakePatience_us = 2'000'000;
constexpr double kSameTime_s = 1e-6;

}  // namespace

RealTimeRun::RealTimeRun(const Parts& parts, const Options& options)
    : parts_(parts),
      options_(options),
      control_frames_(kMostFrames, FastLoop::MakeFrame(parts.control)),
      watch_(parts.vehicle, parts.plant, parts.control.motors().motor_count(),
             {options.duration_s, options.output_interval_s, options.tip_arm}),
      loop_(parts.control, parts.channel,
            {.end_s = options.duration_s, .on_phase = options.on_phase}, &control_frames_),
      runner_(parts.vehicle, parts.gate, parts.channel, {.period_us = options.period_us}) {}

void RealTimeRun::Drain() {
  for (ControlFrame frame; control_frames_.Pop(&frame);) {
    if (frame.phase == ControlPhase::kRunning || frame.phase == ControlPhase::kStopping) {
      control_.push_back(frame);
    }
  }
  for (PlantFrame frame; watch_.Receive(&frame);) plant_.push_back(frame);
  Planner* planner = parts_.control.planner();
  for (PlanReport report; planner != nullptr && planner->Receive(&report);) {
    plans_.push_back(report);
  }
}

// Hands out the SYNCs of which all is known; at the end, also those of which not all has come.
bool RealTimeRun::Match(const std::function<bool(const Step&)>& listener, bool at_end) {
  const bool plans = parts_.control.planner() != nullptr;
  while (!plant_.empty()) {
    const PlantFrame& plant = plant_.front();
    while (!control_.empty() && control_.front().time_s < plant.time_s - kSameTime_s) {
      last_ = control_.front();
      control_.pop_front();
    }
    const bool met = !control_.empty() && control_.front().time_s < plant.time_s + kSameTime_s &&
                     control_.front().phase == ControlPhase::kRunning;
    if (!met && control_.empty() && !at_end) return true;
    const ControlFrame* control = met ? &control_.front() : last_ ? &*last_ : nullptr;
    while (!plans_.empty() && plans_.front().time_s < plant.time_s - kSameTime_s) {
      plans_.pop_front();
    }
    const bool answered = !plans_.empty() && plans_.front().time_s < plant.time_s + kSameTime_s;
    if (met && plans && control->planned && !answered && !at_end) {
      if (waited_us_ == 0) waited_us_ = MonotonicTime_us();
      if (MonotonicTime_us() - waited_us_ < kPlanPatience_us) return true;
    }
    waited_us_ = 0;
    bool go = true;
    if (control != nullptr && plant.time_s <= options_.duration_s + kSameTime_s) {
      const PlanReport* plan = answered && met ? &plans_.front() : nullptr;
      go = listener({*control, plant, watch_.SnapshotAt(plant.time_s), plan});
    }
    if (met) {
      last_ = control_.front();
      control_.pop_front();
    }
    plant_.pop_front();
    if (!go) return false;
  }
  return true;
}

Status RealTimeRun::Run(const std::function<bool(const Step&)>& listener,
                        const std::function<Status()>& idle) {
  std::atomic<bool> stop_control{false}, stop_plant{false}, plant_failed{false};
  Status plant_status, control_status, idle_status;
  BareTimer timer(options_.period_us);
  const std::int64_t begin_us = MonotonicTime_us();
  std::thread plant([&] {
    plant_status = runner_.Run(
        stop_plant, [this] { return loop_.go_us(); }, [this](double t_s) { watch_.Look(t_s); });
    if (!plant_status.ok) plant_failed = true;
  });
  std::thread control([&] { control_status = loop_.Run(stop_control); });
  bool go = true;
  while (loop_.phase() != ControlPhase::kEnded) {
    SleepFor(kIdle_us);
    Drain();
    go = go && Match(listener, false);
    if (idle_status.ok) idle_status = idle();
    if (!go || !idle_status.ok) stop_control = true;
    if (plant_failed) loop_.Abandon();
  }
  control.join();
  for (const std::int64_t until_us = MonotonicTime_us() + kBrakePatience_us;
       !watch_.braked() && !plant_failed && MonotonicTime_us() < until_us;) {
    SleepFor(kIdle_us);
    Drain();
  }
  stop_plant = true;
  plant.join();
  wall_s_ = 1e-6 * static_cast<double>(MonotonicTime_us() - begin_us);
  timer.Stop();
  timer_ = timer.lateness();
  parts_.control.StopPlanner();
  Drain();
  if (go) Match(listener, true);
  for (const Status* status : {&plant_status, &control_status, &idle_status}) {
    if (!status->ok) return *status;
  }
  return idle();
}

RealTimeFigures RealTimeRun::figures() const {
  const ControlCounters& c = parts_.control.counters();
  RealTimeFigures f;
  f.control = loop_.counters();
  f.plant = runner_.counters();
  f.timer = timer_;
  f.late_plans = c.late_plans;
  f.overtaken_plans = c.overtaken_plans;
  f.stuck_cycles = c.stuck_cycles;
  f.refused = loop_.refused();
  const double planned_s = static_cast<double>(f.control.cycles + f.control.missed_cycles) * 1e-6 *
                           static_cast<double>(options_.period_us);
  if (planned_s > 0) f.rate_hz = static_cast<double>(f.control.cycles) / planned_s;
  return f;
}

}  // namespace mantle::loop
