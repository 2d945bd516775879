#include "loop/control_side/fast_loop.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "firmware_sim/bus/socket_time.h"

namespace mantle::loop {

using firmware_sim::DriveProblem;
using firmware_sim::MonotonicTime_us;
using firmware_sim::RealTime_us;
using firmware_sim::SleepUntil;

namespace {

/// The bus is read so often between two SYNCs, sensor messages are looked for so often.
constexpr std::int64_t kPoll_us = 1000, kLook_us = 100;
/// A message is waited for until so long before its SYNC is due, and what commands take besides:
/// the longest of late, falling by half within so many.
constexpr std::int64_t kReserve_us = 150;
constexpr double kFall = 0.993;  // 0.5^(1/100)
constexpr std::int64_t kStopLimit_us = 8'000'000;
constexpr std::int64_t kRetry_us = 300'000;
constexpr double kSameTime_s = 1e-9;
constexpr int kBegan = -1;  // of going_: the first plan is under way

}  // namespace

const char* ToString(ControlPhase phase) {
  switch (phase) {
    case ControlPhase::kBringUp:
      return "bringing up";
    case ControlPhase::kReady:
      return "ready";
    case ControlPhase::kRunning:
      return "running";
    case ControlPhase::kLost:
      return "vehicle lost";
    case ControlPhase::kStopping:
      return "stopping";
    case ControlPhase::kEnded:
      break;
  }
  return "ended";
}

FastLoop::FastLoop(ControlSide& control, SensorSource& sensors, const FastLoopOptions& options,
                   firmware_sim::SpscRing<ControlFrame>* frames)
    : control_(control),
      sensors_(sensors),
      options_(options),
      frames_(frames),
      period_us_(control.motors().period_us()),
      period_s_(1e-6 * static_cast<double>(period_us_)),
      nothing_(static_cast<std::size_t>(control.motors().motor_count())),
      frame_(MakeFrame(control)) {}

ControlFrame FastLoop::MakeFrame(const ControlSide& control) {
  ControlFrame frame;
  frame.estimate = control.estimate();
  frame.command_n = frame.before_n = control.command_n();
  frame.torques.assign(control.torques().begin(), control.torques().end());
  frame.disturbance = control.disturbance();
  const auto motors = static_cast<std::size_t>(control.motors().motor_count());
  frame.reports.resize(motors);
  frame.reeled_m.resize(motors);
  if (const Eigen::MatrixXd* c = control.covariance()) frame.variance = c->diagonal();
  return frame;
}

void FastLoop::Enter(ControlPhase phase) {
  begin_us_ = MonotonicTime_us();
  phase_.store(phase, std::memory_order_release);
  if (options_.on_phase) options_.on_phase(phase);
}

Status FastLoop::Run(const std::atomic<bool>& stop) {
  refused_ = RunAtOnce(kFastLoopPriority);
  Enter(ControlPhase::kBringUp);
  heard_us_ = begin_us_;
  std::int64_t due_us = begin_us_ + period_us_;
  Status status;
  while (phase() != ControlPhase::kEnded && !abandoned_.load(std::memory_order_acquire)) {
    Listen(due_us);
    if (status = Act(MonotonicTime_us(), due_us, stop.load(std::memory_order_relaxed));
        !status.ok) {
      break;
    }
    SleepUntil(due_us);
    control_.motors().Sync(MonotonicTime_us());
    const std::int64_t sent_us = MonotonicTime_us(), late_us = sent_us - due_us;
    if (phase() == ControlPhase::kRunning) {
      ++counters_.cycles;
      counters_.lateness.Add(late_us);
      if (late_us > period_us_ / 10) ++counters_.late_cycles;
      control_.PrepareNext();
    }
    control_.motors().Poll(sent_us);
    Tell();
    due_us += period_us_;
    SkipMissed(MonotonicTime_us(), &due_us);
  }
  phase_.store(ControlPhase::kEnded, std::memory_order_release);
  return status;
}

// A SYNC that is a whole period late is left out: two in turn would tell the drives nothing.
void FastLoop::SkipMissed(std::int64_t now_us, std::int64_t* due_us) {
  const std::int64_t missed = (now_us - *due_us) / period_us_;
  if (missed <= 0) return;
  *due_us += missed * period_us_;
  if (phase() == ControlPhase::kRunning) counters_.missed_cycles += missed;
}

// Until the command for the SYNC that is due has to be made.
void FastLoop::Listen(std::int64_t due_us) {
  const std::int64_t until_us =
      due_us - std::min(kReserve_us + static_cast<std::int64_t>(reserve_us_), period_us_ / 2);
  for (std::int64_t poll_us = 0;;) {
    const std::int64_t now_us = MonotonicTime_us();
    if (now_us >= poll_us) {
      control_.motors().Poll(now_us);
      poll_us = now_us + kPoll_us;
    }
    const bool came = TakeMessages();
    const bool running = phase() == ControlPhase::kRunning;
    if (running && came && newest_.time_s > time_s_ + 0.5 * period_s_) break;
    if (now_us >= until_us) break;
    // Messages are of the instant at which SYNC is due, and come shortly before.
    const bool close = running && due_us - now_us <= period_us_ / 2;
    SleepUntil(std::min(until_us, close ? now_us + kLook_us : poll_us));
  }
  control_.motors().Poll(MonotonicTime_us());
}

// True where newest_ is one that was not used.
bool FastLoop::TakeMessages() {
  while (sensors_.Receive(&message_)) {
    const std::int64_t now_us = MonotonicTime_us();
    const bool newer = message_.time_s > told_s_ + kSameTime_s;
    // A plant that was started again resumes an earlier time.
    const bool anew = phase() != ControlPhase::kRunning;
    if (heard_ && !newer && !anew) {
      ++counters_.old_messages;
      continue;
    }
    if (!message_.has_state && fresh_ && newest_.has_state) {  // both may have come since the last
      message_.has_state = true;
      std::swap(message_.state, newest_.state);
    }
    if (fresh_ && !newest_.measurements.empty()) {
      newest_.measurements.insert(newest_.measurements.end(), message_.measurements.begin(),
                                  message_.measurements.end());
      std::swap(message_.measurements, newest_.measurements);
    }
    if (message_.cables.size() != nothing_.size()) {
      ++counters_.old_messages;
      continue;
    }
    std::swap(message_, newest_);
    told_s_ = newest_.time_s;
    heard_ = fresh_ = true;
    heard_us_ = now_us;
  }
  return fresh_;
}

// What this cycle's RPDOs and SYNC say.
Status FastLoop::Act(std::int64_t now_us, std::int64_t due_us, bool stop) {
  MotorMaster& motors = control_.motors();
  const double silent_s = 1e-6 * static_cast<double>(now_us - heard_us_);
  const ControlPhase now = phase();
  if (stop && now != ControlPhase::kStopping) {
    motors.RequestStop(now_us);
    motors.SetTorques(nothing_);
    Enter(ControlPhase::kStopping);
    return {};
  }
  switch (now) {
    case ControlPhase::kBringUp:
      return ActBringUp(now_us);
    case ControlPhase::kReady:
      if (going_ > 1) {
        --going_;
      } else if (going_ == 1) {
        going_ = 0;
        Enter(ControlPhase::kRunning);
        Command();
      } else if (going_ == kBegan && control_.begun()) {
        going_ = std::max(1, options_.go_cycles);
        // The SYNC of so many cycles from now, or a little before it.
        go_us_.store(RealTime_us() + due_us - now_us + going_ * period_us_ - period_us_ / 2,
                     std::memory_order_release);
      } else if (going_ == 0 && fresh_ && newest_.has_state) {
        going_ = kBegan;
        control_.Begin(newest_);
        time_s_ = newest_.time_s - period_s_;
      }
      break;
    case ControlPhase::kRunning:
      if (silent_s > options_.silence_s) {
        ++counters_.lost;
        motors.SetTorques(nothing_);
        control_.Reset();
        go_us_.store(INT64_MAX, std::memory_order_release);
        Enter(ControlPhase::kLost);
        break;
      }
      Command();
      if (time_s_ >= options_.end_s - kSameTime_s) {
        complete_.store(true, std::memory_order_release);
        motors.RequestStop(now_us);
        motors.SetTorques(nothing_);
        Enter(ControlPhase::kStopping);
      }
      break;
    case ControlPhase::kLost:
      if (fresh_ && silent_s < options_.silence_s) {
        motors.Restart();
        Enter(ControlPhase::kBringUp);
      }
      break;
    case ControlPhase::kStopping:
      if (motors.stopped()) {
        Enter(ControlPhase::kEnded);
        return motors.CheckStopped();
      }
      if (now_us - begin_us_ > kStopLimit_us) {
        return {false, "drives did not stop:\n" + motors.Describe()};
      }
      break;
    case ControlPhase::kEnded:
      break;
  }
  return {};
}

Status FastLoop::ActBringUp(std::int64_t now_us) {
  MotorMaster& motors = control_.motors();
  // A vehicle that is held stands at its start.
  const bool moved = heard_ && (!newest_.held || newest_.time_s > 0);
  Status status = motors.BringUp(now_us, moved ? std::span<const CableReading>(newest_.cables)
                                               : std::span<const CableReading>());
  if (motors.ready()) Enter(ControlPhase::kReady);
  if (status.ok) return status;
  bool absent = false;
  for (int i = 0; i < motors.motor_count(); ++i) {
    const DriveProblem problem = motors.report(i).problem;
    absent = absent || problem == DriveProblem::kNoAnswer ||
             problem == DriveProblem::kHeartbeatLost || problem == DriveProblem::kStepTimeout ||
             problem == DriveProblem::kFault;  // on a machine that was held up: it is reset
  }
  const double waited_s = 1e-6 * static_cast<double>(now_us - begin_us_);
  if (!absent || waited_s > options_.patience_s) return status;
  motors.Restart();
  return {};
}

// From the newest message, or from what is expected where none has come.
void FastLoop::Command() {
  const std::int64_t begin_us = MonotonicTime_us();
  if (!fresh_ || newest_.time_s <= time_s_ + 0.5 * period_s_) Predict();
  fresh_ = false;
  control_.Turn(newest_);
  time_s_ = newest_.time_s;
  const std::int64_t took_us = MonotonicTime_us() - begin_us;
  counters_.command.Add(took_us);
  reserve_us_ = std::max(kFall * reserve_us_, static_cast<double>(took_us));
}

void FastLoop::Predict() {
  ++counters_.predicted;
  frame_.predicted = true;
  // What came late counts now; nothing counts twice.
  newest_.has_state = newest_.has_state && fresh_;
  if (!fresh_) newest_.measurements.clear();
  const double ahead_s = time_s_ + period_s_ - newest_.time_s;
  newest_.time_s += ahead_s;
  for (CableReading& cable : newest_.cables) cable.length_m += ahead_s * cable.rate_m_s;
}

void FastLoop::Tell() {
  if (frames_ == nullptr) return;
  frame_.time_s = time_s_;
  frame_.phase = phase();
  frame_.planned = frame_.phase == ControlPhase::kRunning && control_.planned();
  frame_.estimate = control_.estimate();
  frame_.command_n = control_.command_n();
  frame_.before_n = control_.before_n();
  std::copy(control_.torques().begin(), control_.torques().end(), frame_.torques.begin());
  frame_.disturbance = control_.disturbance();
  for (int i = 0; i < control_.motors().motor_count(); ++i) {
    frame_.reports[static_cast<std::size_t>(i)] = control_.motors().report(i);
    frame_.reeled_m[static_cast<std::size_t>(i)] = control_.motors().ReportedReel_m(i);
  }
  if (const Eigen::MatrixXd* c = control_.covariance()) frame_.variance = c->diagonal();
  counters_.late_plans = control_.counters().late_plans;
  frame_.counters = counters_;
  if (!frames_->Push(frame_)) ++counters_.unheard;
  frame_.predicted = false;
}

}  // namespace mantle::loop
