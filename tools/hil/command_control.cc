#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <filesystem>
#include <optional>
#include <thread>

#include "firmware_sim/bus/bus_load.h"
#include "firmware_sim/bus/candump_log.h"
#include "firmware_sim/bus/recording_bus.h"
#include "firmware_sim/bus/socket_time.h"
#include "loop/closed_loop.h"
#include "loop/control_side/simulated_winch.h"
#include "loop/drive_options.h"
#include "loop/lock_step.h"
#include "tools/hil/follow_controller.h"
#include "tools/hil/lcm_listener.h"
#include "tools/hil/lock_step_link.h"
#include "tools/hil/program_options.h"
#include "tools/mantle/interrupt.h"
#include "tools/mantle/loop_telemetry.h"
#include "tools/mantle/output_file.h"
#include "tools/mantle/process.h"
#include "tools/mantle/standard_output.h"
#include "tools/mantle/summary.h"
#include "tools/mantle/timing_summary.h"

/// `mantle control`: the control side of a scene as a program of its own, in real time.

namespace mantle::tools {
namespace {

constexpr const char* kHelp =
    "Control a vehicle from outside, in real time (docs/hil.md): this program knows it by the "
    "frames of its drives\n(CANopen CiA 402, node i + 1 is motor i) and by sensor messages on LCM "
    "(MANTLE_SENSORS) alone, whether it is\nsimulated (mantle plant) or real. The drives are "
    "brought up, the scene's goal is followed to its duration, the\ndrives are taken down.\n\n"
    "  mantle control scenes/steer.toml                     # and beside it: mantle plant "
    "scenes/steer.toml\n"
    "  mantle control scenes/steer.toml --controller pid --bus can:can0\n"
    "  mantle control scenes/steer.toml --follow            # tensions from MANTLE_COMMAND, by any "
    "program\n\n"
    "Ctrl-C takes the drives down. Sensor messages that cease for 150 ms: nothing is commanded "
    "until they come again.\n"
    "Exit status 0: done. 2: bad input. 3: the drives could not be brought up or taken down, or "
    "the run was stopped.";

constexpr std::int64_t kIdle_us = 4000;
constexpr double kCycle_s = 0.1;  // between two MANTLE_CYCLE
constexpr double kStatus_s = 0.1;
constexpr double kMostTimeOut_s = 1.0;
constexpr int kGoCycles = 5;             // by which a vehicle that is held is told when to go
constexpr double kStepTolerance = 1e-6;  // as in loop/closed_loop.cc

struct ControlProgramOptions {
  ProgramOptions program;
  std::string controller;
  bool follow{false}, lock_step{false};
  std::string record;
  double wait_s{60};
};

/// Sensor messages and commands, from the network to the fast loop.
class InputSink final : public TelemetrySink {
 public:
  InputSink(const reduced::ReducedModel& model, loop::SensorChannel& sensors,
            controller::Exchange<FollowCommand>& commands)
      : model_(model), sensors_(sensors), commands_(commands) {
    parsed_.state = InitialState(model);
  }
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
  void Write(const SensorsTelemetry& m) override {
    if (!SensorsOf(m, model_, &parsed_)) {
      refused_.fetch_add(1, std::memory_order_relaxed);
      return;
    }
    sensors_.Send(parsed_);
  }
  void Write(const CommandTelemetry& m) override {
    command_.came_us = firmware_sim::MonotonicTime_us();
    command_.time_out_s = m.time_out;
    command_.tension_n = Eigen::Map<const model::VectorX>(m.tension.data(), std::ssize(m.tension));
    const bool fits = std::ssize(m.tension) == model_.input_count() &&
                      command_.tension_n.allFinite() && m.time_out > 0 &&
                      m.time_out <= kMostTimeOut_s;
    if (fits) {
      commands_.Publish(command_);
    } else {
      refused_.fetch_add(1, std::memory_order_relaxed);
    }
  }
  std::uint64_t refused() const { return refused_.load(std::memory_order_relaxed); }

 private:
  const reduced::ReducedModel& model_;
  loop::SensorChannel& sensors_;
  controller::Exchange<FollowCommand>& commands_;
  loop::Sensors parsed_;
  FollowCommand command_;
  std::atomic<std::uint64_t> refused_{0};
};

/// The bus of a lock-step run whose frames are recorded.
class RecordedSteps final : public loop::StepBus {
 public:
  RecordedSteps(loop::StepBus& bus, firmware_sim::RecordingBus* recorder)
      : bus_(bus), recorder_(recorder) {}
  void AdvanceTo(std::int64_t now_us) override {
    bus_.AdvanceTo(now_us);
    if (recorder_ != nullptr) recorder_->AdvanceTo(now_us);
  }
  loop::Status Check() const override { return bus_.Check(); }
  const std::string& spec() const override { return bus_.spec(); }

 private:
  loop::StepBus& bus_;
  firmware_sim::RecordingBus* recorder_;
};

class ControlProgram {
 public:
  explicit ControlProgram(const ControlProgramOptions& options)
      : options_(options), scene_(options.program.Load()), bus_(options.program.Bus(scene_)) {
    char name[256] = {};
    if (gethostname(name, sizeof name - 1) == 0) cycle_.host = name;
    cycle_.process = getpid();
  }

  int Execute() {
    if (options_.lock_step && options_.follow) {
      throw BadInput(
          "--follow: commands of other programs come by the wall clock, must be without "
          "--lockstep");
    }
    if (!options_.record.empty() && !options_.lock_step) {
      throw BadInput("--record: must be with --lockstep (mantle hil records in real time)");
    }
    if (options_.lock_step) return ExecuteInLockStep();
    Build();
    InputSink input(*model_, sensors_, commands_);
    const LcmListener listener(options_.program.lcm,
                               {SensorsTelemetry::kChannel, CommandTelemetry::kChannel}, input);
    link_ = OpenLcm({.url = options_.program.lcm});
    if (const std::string refused = LockMemory(); !refused.empty()) ComplainText(refused);
    CatchInterrupts();
    frames_.emplace(256, loop::FastLoop::MakeFrame(*control_));
    loop::FastLoop fast(*control_, sensors_,
                        {.end_s = scene_.run.duration_s,
                         .patience_s = options_.wait_s,
                         .go_cycles = kGoCycles,
                         .on_phase =
                             [this](loop::ControlPhase phase) {
                               if (phase == loop::ControlPhase::kRunning) meter_->RestartPeak();
                             }},
                        &*frames_);
    loop::BareTimer timer(loop::Period_us(scene_.drives));
    std::atomic<bool> stop{false};
    loop::Status status;
    std::thread loop_thread([&] { status = fast.Run(stop); });
    Say("{} motors on {}, sensors from {}", scene_.reduction.actuators.size(), bus_,
        options_.program.lcm);
    while (fast.phase() != loop::ControlPhase::kEnded) {
      firmware_sim::SleepFor(kIdle_us);
      if (Interrupted()) stop = true;
      Tell(fast);
    }
    loop_thread.join();
    timer.Stop();
    Tell(fast);
    control_->StopPlanner();
    if (!fast.refused().empty()) Complain("warning: {}", fast.refused());
    return Conclude(fast, timer, status, input.refused() + listener.malformed());
  }

 private:
  const ControlProgramOptions& options_;
  scene::Scene scene_;
  std::string bus_;
  std::unique_ptr<reduced::ReducedPlant> model_;
  std::unique_ptr<firmware_sim::Bus> station_;
  std::optional<loop::WatchingBus> watch_;
  std::optional<loop::MeteredBus> meter_;
  controller::Exchange<FollowCommand> commands_;
  loop::SensorChannel sensors_{64};
  std::unique_ptr<loop::ControlSide> control_;
  std::unique_ptr<LcmLink> link_;
  std::optional<firmware_sim::SpscRing<loop::ControlFrame>> frames_;
  CycleTelemetry cycle_;
  loop::ControlPhase told_{loop::ControlPhase::kEnded};
  double next_cycle_s_{0}, next_status_s_{0};
  loop::PlanReport plan_;
  loop::ControlFrame frame_;
  loop::ControlFrame last_;  ///< in command
  bool commanded_{false}, foreign_told_{false};

  template <typename... Args>
  void Say(fmt::format_string<Args...> format, Args&&... args) const {
    if (options_.program.scene.json) return;
    Print("control: {}\n", fmt::format(format, std::forward<Args>(args)...));
    FlushOutput();
  }

  // As ClosedLoop does in one process, with the plant in another.
  int ExecuteInLockStep() {
    station_ = OpenStation(bus_, true);
    BuildModel();
    RemoteVehicle vehicle(options_.program.lcm, bus_, *station_, *model_,
                          static_cast<std::int64_t>(1e6 * options_.wait_s));
    std::optional<firmware_sim::CandumpWriter> log;
    std::optional<firmware_sim::RecordingBus> recorder;
    firmware_sim::Bus* bus = &vehicle.bus();
    if (!options_.record.empty()) {
      log.emplace(options_.record, bus_.starts_with("can:") ? bus_.substr(4) : "vcan0");
      bus = &recorder.emplace(vehicle.bus(), *log);
    }
    BuildControl(*bus, false);
    link_ = OpenLcm({.url = options_.program.lcm});
    RecordedSteps steps(vehicle, recorder ? &*recorder : nullptr);
    loop::LockStep lock_step(vehicle, control_->motors(), steps);
    CatchInterrupts();
    Say("lock-step: {} motors on {}", scene_.reduction.actuators.size(), bus_);
    loop::Status status = lock_step.BringUp();
    const bool up = status.ok;
    const long cycles = std::lround(scene_.run.duration_s / scene_.drives.period_s);
    long cycle = 0;
    for (loop::Sensors message; status.ok && cycle < cycles && !Interrupted(); ++cycle) {
      if (status = vehicle.Measure(&message); !status.ok) break;
      control_->Turn(message);
      control_->PrepareNext();
      status = lock_step.Cycle();
      if (!status.ok) break;
    }
    // The state that the last command led to is part of the plant's run.
    if (loop::Sensors message; status.ok) status = vehicle.Measure(&message);
    const bool whole = status.ok && cycle == cycles;
    if (up) {
      const loop::Status stopped = lock_step.Stop();
      if (status.ok) status = stopped;
    }
    vehicle.End();
    if (log) log->Flush();
    const controller::Mpc* mpc = control_->mpc();
    Json j;
    j["scene"] = scene_.name;
    j["controller"] = control_->options().controller;
    j["complete"] = whole && status.ok;
    j["reason"] = !status.ok ? status.reason : whole ? "" : "interrupted";
    j["time_s"] = static_cast<double>(cycle) * scene_.drives.period_s;
    j["bus"] = bus_;
    j["plans"] = mpc == nullptr ? 0 : mpc->counters().solves;
    j["questions_repeated"] = vehicle.repeated();
    j["real_time"] = nullptr;
    return Finish(j);
  }

  int Finish(const Json& j) {
    if (!options_.program.scene.out.empty()) {
      std::filesystem::create_directories(options_.program.scene.out);
      WriteWhole(options_.program.scene.out, "control.json", Dump(j));
    }
    const bool complete = j["complete"];
    const int exit_status = complete ? 0 : kExitCannotContinue;
    if (!complete) {
      Complain("control: {}: {} at t = {:.3f} s", scene_.name, j["reason"].get<std::string>(),
               j["time_s"].get<double>());
    }
    if (options_.program.scene.json) PrintText(Dump(j), exit_status);
    return exit_status;
  }

  void Build() {
    if (options_.follow) RegisterFollowController(commands_);
    station_ = OpenStation(bus_, true);
    watch_.emplace(*station_);
    meter_.emplace(*watch_);
    BuildModel();
    BuildControl(*meter_, true);
  }

  void BuildModel() {
    InScene(options_.program.scene, [&] {
      model_ =
          std::make_unique<reduced::ReducedPlant>(loop::BelievedRobot(scene_), scene_.reduction);
      return 0;
    });
  }

  void BuildControl(firmware_sim::Bus& bus, bool real_time) {
    InScene(options_.program.scene, [&] {
      controller::ControlOptions control = *scene_.control;
      if (!options_.controller.empty()) control.controller = options_.controller;
      if (options_.follow) control.controller = kFollow;
      loop::ControlSetup setup{
          *model_,
          {scene_.reduction.scheme, std::max(scene_.reduction.tolerance, kStepTolerance)},
          control,
          scene_.sensors,
          scene_.drives,
          {},
          real_time};
      if (real_time) setup.supervisor.expected = loop::ExpectedOfWinch();
      control_ = std::make_unique<loop::ControlSide>(setup, bus);
      return 0;
    });
  }

  // From the fast loop and the planner to people and programs.
  void Tell(const loop::FastLoop& fast) {
    while (frames_->Pop(&frame_)) {
      if (frame_.phase != loop::ControlPhase::kRunning) continue;
      last_ = frame_;
      commanded_ = true;
    }
    const loop::ControlPhase phase = fast.phase();
    const double now_s = 1e-6 * static_cast<double>(firmware_sim::MonotonicTime_us());
    const bool changed = phase != told_ || fast.go_us() != cycle_.go_time;
    if (changed || now_s >= next_cycle_s_) {
      next_cycle_s_ = now_s + kCycle_s;
      cycle_.utime = TelemetryTime(last_.time_s);
      cycle_.phase = ToString(phase);
      cycle_.go_time = fast.go_us();
      link_->Write(cycle_);
    }
    if (phase != told_) {
      told_ = phase;
      Say("{}{}", ToString(phase),
          commanded_ ? fmt::format(" (t = {:.3f} s)", last_.time_s) : std::string());
    }
    loop::Planner* planner = control_->planner();
    while (planner != nullptr && planner->Receive(&plan_)) {
      link_->Write(PlanMessageOf(*model_, plan_));
    }
    if (commanded_ && now_s >= next_status_s_) {
      next_status_s_ = now_s + kStatus_s;
      link_->Write(Status());
      link_->Write(Drives());
    }
    if (!foreign_told_ && watch_->foreign() > 0) {
      foreign_told_ = true;
      Complain(
          "control: bus {}: a foreign frame with identifier {:03X} of this master: another "
          "master is on the bus",
          bus_, watch_->first_foreign());
    }
  }

  StatusTelemetry Status() const {
    StatusTelemetry m;
    m.utime = TelemetryTime(last_.time_s);
    m.control_mode = control_->options().controller;
    m.solves = static_cast<std::int64_t>(plan_.counters.solves);
    m.iterations = plan_.iterations;
    m.misses = static_cast<std::int64_t>(plan_.counters.deadline_misses);
    m.fallbacks = static_cast<std::int64_t>(plan_.counters.shifted + plan_.counters.safe);
    m.safe_decays = static_cast<std::int64_t>(plan_.counters.safe);
    m.text = ToString(told_);
    AddTiming(last_.counters, scene_.drives.period_s, &m);
    return m;
  }

  DrivesTelemetry Drives() const {
    DrivesTelemetry m;
    m.utime = TelemetryTime(last_.time_s);
    const controller::WinchMap& winch = control_->motors().winch_map();
    for (std::size_t i = 0; i < last_.reports.size(); ++i) {
      const firmware_sim::DriveReport& r = last_.reports[i];
      const reduced::Actuator& motor = scene_.reduction.actuators[i];
      double square = 0, rest_m = 0;
      for (const reduced::ActuatorTarget& target : motor.targets) {
        square += target.gain * target.gain;
        rest_m += target.gain * model_->cable_rest_m[static_cast<std::size_t>(target.index)];
      }
      AddDrive(motor.name, r, last_.torques[i].torque_permille, winch, square,
               rest_m / square - last_.reeled_m[i], &m);
    }
    return m;
  }

  int Conclude(const loop::FastLoop& fast, const loop::BareTimer& timer, const loop::Status& status,
               std::uint64_t refused) {
    const loop::ControlCounters& c = control_->counters();
    const bool complete = status.ok && fast.complete();
    const std::string reason = !status.ok         ? status.reason
                               : !fast.complete() ? "interrupted"
                                                  : std::string();
    Json j;
    j["scene"] = scene_.name;
    j["controller"] = control_->options().controller;
    j["complete"] = complete;
    j["reason"] = reason;
    j["time_s"] = last_.time_s;
    j["bus"] = bus_;
    j["bus_load_peak"] = static_cast<double>(meter_->peak_worst_bits()) /
                         (scene_.drives.period_s * static_cast<double>(firmware_sim::kBitRate));
    j["foreign_frames"] = watch_->foreign();
    j["messages_refused"] = refused;
    j["plans"] = c.prepare_s.size();
    j["real_time"] = FastLoopJson(fast.counters());
    j["real_time"]["late_plans"] = c.late_plans;
    j["real_time"]["overtaken_plans"] = c.overtaken_plans;
    j["real_time"]["stuck_cycles"] = c.stuck_cycles;
    j["real_time"]["scheduled_fifo"] = fast.refused().empty();
    j["real_time"]["bare_timer"] = HistogramJson(timer.lateness());
    const int exit_status = Finish(j);
    if (!options_.program.scene.json && commanded_) {
      const Json& r = j["real_time"];
      Print(
          "control: {} SYNCs, {} late by more than a tenth of the period, {} left out; {} "
          "without a sensor message in time; {} of {} plans late\n  {}\n  {}\n  {}\n",
          fast.counters().cycles, fast.counters().late_cycles, fast.counters().missed_cycles,
          fast.counters().predicted, c.late_plans, c.prepare_s.size(),
          HistogramLine("SYNC lateness", r["sync_lateness"]),
          HistogramLine("bare timer", r["bare_timer"]), HistogramLine("command", r["command"]));
    }
    return exit_status;
  }
};

}  // namespace

void AddControlCommand(CLI::App& app, int& exit_status) {
  static ControlProgramOptions options;  // lives as long as the parser that points to it
  CLI::App* command = app.add_subcommand("control", kHelp);
  AddProgramOptions(command, &options.program);
  CLI::Option* instead =
      command->add_option("--controller", options.controller, "Instead of the scene's")
          ->check(CLI::IsMember({"mpc", "gait", "pursuit", "pid", "lqr"}));
  command
      ->add_flag("--follow", options.follow,
                 "Tensions come from another program (MANTLE_COMMAND), within the motors' limits")
      ->excludes(instead);
  command->add_flag("--lockstep", options.lock_step,
                    "Simulated time, with `mantle plant --lockstep`: the bits of a run in one "
                    "process");
  command->add_option("--record", options.record, "In lock-step: the bus's frames as a candump log")
      ->type_name("FILE");
  command->add_option("--out", options.program.scene.out, "Write control.json into this folder")
      ->type_name("DIR");
  command->add_option("--wait", options.wait_s, "So long the drives may take to appear on the bus")
      ->type_name("SECONDS")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  command->callback([&exit_status] { exit_status = ControlProgram(options).Execute(); });
}

}  // namespace mantle::tools
