#include "tools/hil/lock_step_link.h"

#include <fmt/format.h>
#include <unistd.h>

#include "firmware_sim/bus/socket_time.h"
#include "tools/mantle/loop_telemetry.h"

namespace mantle::tools {

using firmware_sim::MonotonicTime_us;
using loop::Status;

namespace {

constexpr std::int64_t kFrame_us = 2'000'000;    // for a frame on the bus
constexpr std::int64_t kAgain_us = 250'000;      // then a question is asked again
constexpr std::int64_t kAnswer_us = 10'000'000;  // for an answer
constexpr int kWait_ms = 50;

/// All that others say is of no interest.
class Deaf : public TelemetrySink {
 public:
  void Write(const StateTelemetry&) override {}
  void Write(const ReducedStateTelemetry&) override {}
  void Write(const PlanTelemetry&) override {}
  void Write(const DrivesTelemetry&) override {}
  void Write(const EnergyTelemetry&) override {}
  void Write(const StatusTelemetry&) override {}
  void Write(const ShapeTelemetry&) override {}
  void Write(const ControlTelemetry&) override {}
  void Write(const WaterTelemetry&) override {}
  void Write(const SessionTelemetry&) override {}
};

}  // namespace

class RemoteVehicle::Answers final : public Deaf {
 public:
  explicit Answers(const reduced::ReducedModel& model) : model_(model) {
    sensors.state = InitialState(model);
  }
  void Write(const SteppedTelemetry& m) override { answer = m; }
  void Write(const SensorsTelemetry& m) override { fits = SensorsOf(m, model_, &sensors); }

  SteppedTelemetry answer;
  loop::Sensors sensors;
  bool fits{false};

 private:
  const reduced::ReducedModel& model_;
};

RemoteVehicle::RemoteVehicle(const std::string& url, const std::string& spec,
                             firmware_sim::Bus& station, const reduced::ReducedModel& model,
                             std::int64_t patience_us)
    : spec_(spec),
      bus_(station, kFrame_us),
      answers_(std::make_unique<Answers>(model)),
      link_(OpenLcm({.url = url,
                     .receive = true,
                     .channels = {SteppedTelemetry::kChannel, SensorsTelemetry::kChannel}})),
      patience_us_(patience_us) {
  question_.run = MonotonicTime_us() * 100'000 + getpid() % 100'000;
}

RemoteVehicle::~RemoteVehicle() = default;

Status RemoteVehicle::Ask(StepAction action, std::int64_t now_us) {
  if (!failed_.ok) return failed_;
  ++question_.number;
  question_.utime = question_.now = now_us;
  question_.action = static_cast<std::int8_t>(action);
  question_.frames_sent = static_cast<std::int64_t>(bus_.counters().sent);
  answers_->fits = false;
  const bool first = question_.number == 1;
  const std::int64_t begin_us = MonotonicTime_us();
  const std::int64_t limit_us = begin_us + (first ? patience_us_ : kAnswer_us);
  std::int64_t again_us = begin_us;
  for (;;) {
    const std::int64_t wall_us = MonotonicTime_us();
    if (wall_us >= again_us) {
      if (again_us != begin_us) ++repeated_;
      link_->Write(question_);
      again_us = wall_us + kAgain_us;
    }
    link_->Receive(kWait_ms, *answers_);
    const SteppedTelemetry& answer = answers_->answer;
    const bool answered = answer.run == question_.run && answer.number == question_.number;
    if (answered && (answer.ok == 0 || action != StepAction::kMeasure || answers_->fits)) break;
    if (MonotonicTime_us() < limit_us) continue;
    failed_ = {false, fmt::format("MANTLE_STEP {} (action {}): no answer from the plant within "
                                  "{:.3g} s",
                                  question_.number, question_.action,
                                  1e-6 * static_cast<double>(limit_us - begin_us))};
    return failed_;
  }
  const SteppedTelemetry& answer = answers_->answer;
  bus_.Expect(answer.frames_sent);
  braked_ = answer.braked != 0;
  if (answer.ok == 0) failed_ = {false, "plant: " + answer.reason};
  return failed_;
}

Status RemoteVehicle::Measure(loop::Sensors* message) {
  if (Status status = Ask(StepAction::kMeasure, now_us_); !status.ok) return status;
  *message = answers_->sensors;
  return {};
}

Status RemoteVehicle::Check() const {
  if (!failed_.ok) return failed_;
  if (bus_.foreign() > 0) {
    return {false,
            fmt::format("bus {}: {} foreign frames, identifier {:03X} at last: another run or "
                        "master is on the bus",
                        spec_, bus_.foreign(), bus_.last().id)};
  }
  if (bus_.stalled()) {
    return {false,
            fmt::format("bus {}: {} frames that the drives sent did not come within {:.3g} s",
                        spec_, bus_.missing(), 1e-6 * static_cast<double>(kFrame_us))};
  }
  return {};
}

/// The newest question.
class StepServer::Questions final : public Deaf {
 public:
  void Write(const StepTelemetry& m) override {
    question = m;
    came = true;
  }
  StepTelemetry question;
  bool came{false};
};

StepServer::StepServer(const std::string& url, loop::VehicleSide& vehicle, loop::CountedBus& bus,
                       std::int64_t period_us)
    : vehicle_(vehicle),
      bus_(bus),
      period_us_(period_us),
      link_(OpenLcm({.url = url, .receive = true, .channels = {StepTelemetry::kChannel}})) {}

Status StepServer::Run(const std::function<bool()>& stop,
                       const std::function<void(double)>& on_period) {
  Questions questions;
  SteppedTelemetry answer;
  while (!stop()) {
    questions.came = false;
    link_->Receive(kWait_ms, questions);
    if (!questions.came) continue;
    const StepTelemetry& question = questions.question;
    if (answer.run != 0 && question.run != answer.run) {
      return {false, "MANTLE_STEP of another run: a plant in lock-step has one, start it again"};
    }
    const bool again = answer.number == question.number;
    if (!again) {
      if (question.number != answer.number + 1) {
        return {false, fmt::format("MANTLE_STEP {} after {}: began in the middle of a run",
                                   question.number, answer.number)};
      }
      answer.run = question.run;
      answer.number = question.number;
      status_ = Do(question);
      answer.utime = question.now;
      answer.ok = status_.ok ? 1 : 0;
      answer.reason = status_.reason;
      answer.braked = vehicle_.braked() ? 1 : 0;
      answer.frames_sent = static_cast<std::int64_t>(bus_.counters().sent);
    }
    const bool measure = question.action == static_cast<std::int8_t>(StepAction::kMeasure);
    if (measure && status_.ok) link_->Write(SensorsMessage(message_));
    link_->Write(answer);
    if (measure && !again && status_.ok && on_period) on_period(time_s_);
    if (!status_.ok || question.action == static_cast<std::int8_t>(StepAction::kEnd)) {
      return status_;
    }
  }
  return {};
}

Status StepServer::Do(const StepTelemetry& question) {
  const std::int64_t to_us = question.now;
  bus_.AdvanceTo(now_us_);
  switch (static_cast<StepAction>(question.action)) {
    case StepAction::kFrames:
      now_us_ = to_us;
      bus_.AdvanceTo(to_us);
      bus_.Expect(question.frames_sent);
      vehicle_.Pump(to_us);
      if (bus_.stalled())
        return {false, fmt::format("{} frames of the master did not come", bus_.missing())};
      if (bus_.foreign() > 0) {
        return {false, fmt::format("a foreign frame, identifier {:03X} at last: another run or "
                                   "master is on the bus",
                                   bus_.last().id)};
      }
      return {};
    case StepAction::kHold:
      vehicle_.Hold(to_us);
      now_us_ = to_us;
      return {};
    case StepAction::kRelease:
      vehicle_.Release(to_us);
      origin_us_ = now_us_ = to_us;
      return {};
    case StepAction::kAdvance: {
      const std::int64_t start_us = now_us_;
      const int steps = vehicle_.coupling_steps();
      for (int i = 1; i <= steps; ++i) {
        const std::int64_t step_us = start_us + i * (to_us - start_us) / steps;
        if (Status status = vehicle_.Advance(step_us); !status.ok) return status;
      }
      now_us_ = to_us;
      return {};
    }
    case StepAction::kMeasure: {
      const double period_s = static_cast<double>(period_us_) / 1e6;
      time_s_ = static_cast<double>((now_us_ - origin_us_) / period_us_) * period_s;
      if (Status status = vehicle_.Look(time_s_); !status.ok) return status;
      vehicle_.Measure(&message_);
      return {};
    }
    case StepAction::kEnd:
      return {};
  }
  return {false,
          fmt::format("MANTLE_STEP {}: action {} is none", question.number, question.action)};
}

}  // namespace mantle::tools
