#include <fmt/format.h>

#include <atomic>
#include <charconv>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <limits>
#include <optional>
#include <thread>

#include "firmware_sim/bus/socket_time.h"
#include "loop/closed_loop.h"
#include "loop/counted_bus.h"
#include "loop/drive_options.h"
#include "mantle/version.h"
#include "tools/hil/lcm_listener.h"
#include "tools/hil/lock_step_link.h"
#include "tools/hil/program_options.h"
#include "tools/mantle/interrupt.h"
#include "tools/mantle/loop_telemetry.h"
#include "tools/mantle/output_file.h"
#include "tools/mantle/process.h"
#include "tools/mantle/shape_telemetry.h"
#include "tools/mantle/standard_output.h"
#include "tools/mantle/summary.h"
#include "tools/mantle/timing_summary.h"

/// `mantle plant`: the plant side of a scene as a program of its own, in real time.

namespace mantle::tools {
namespace {

namespace fs = std::filesystem;

constexpr const char* kHelp =
    "Run a scene's vehicle, its drives and its instruments by themselves, in real time "
    "(docs/hil.md): the drives\nare CANopen nodes on a bus, the instruments speak on LCM "
    "(MANTLE_SENSORS). It is held at its start until a\ncontroller is ready (mantle control), and "
    "keeps the wall clock from then on, whoever is late.\n\n"
    "  mantle plant scenes/steer.toml                       # and beside it: mantle control "
    "scenes/steer.toml\n"
    "  mantle plant scenes/steer.toml --bus can:vcan0\n"
    "  mantle plant scenes/steer.toml --lockstep            # and mantle control ... --lockstep\n\n"
    "Ctrl-C ends it. One that was killed goes on, when it is started again, from where it was at "
    "most a second\nbefore (--fresh: from t = 0).\n"
    "Exit status 0: ended. 2: bad input. 3: the plant could not go on.";

constexpr double kCheckpoint_s = 0.5;
constexpr std::int64_t kIdle_us = 5000;
constexpr std::int64_t kFrame_us = 2'000'000;  // for a frame, in lock-step
constexpr const char* kCheckpoint = "checkpoint";

struct PlantOptions {
  ProgramOptions program;
  bool fresh{false}, free{false}, lock_step{false};
  double duration_s{0};
};

/// What a controller says of when the vehicle may go.
class CycleSink final : public TelemetrySink {
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
  void Write(const CycleTelemetry& m) override {
    go_us_.store(m.go_time, std::memory_order_release);
  }
  std::int64_t go_us() const { return go_us_.load(std::memory_order_acquire); }

 private:
  std::atomic<std::int64_t> go_us_{INT64_MAX};
};

class PlantJob {
 public:
  explicit PlantJob(const PlantOptions& options)
      : options_(options),
        scene_(options.program.Load()),
        bus_(options.program.Bus(scene_)),
        folder_(options.program.scene.out.empty() ? fs::path("results") / (scene_.name + ".plant")
                                                  : fs::path(options.program.scene.out)) {}

  int Execute() {
    Build();
    if (options_.lock_step) return ExecuteInLockStep();
    Resume();
    CycleSink cycles;
    const LcmListener listener(options_.program.lcm, {CycleTelemetry::kChannel}, cycles);
    LcmSensorSink sensors(options_.program.lcm);
    telemetry_ = OpenLcm({.url = options_.program.lcm});
    if (const std::string refused = LockMemory(); !refused.empty()) ComplainText(refused);
    CatchInterrupts();
    loop::PlantRunner runner(
        *vehicle_, *gate_, sensors,
        {.period_us = loop::Period_us(scene_.drives), .start_s = start_s_, .free = options_.free});
    std::atomic<bool> stop{false}, ended{false};
    loop::Status status;
    std::thread plant([&] {
      status = runner.Run(
          stop, [&] { return cycles.go_us(); }, [this](double t_s) { OnPeriod(t_s); });
      ended = true;
    });
    Say("held at t = {:.3f} s: {} drives on {}, instruments on {}", start_s_,
        scene_.reduction.actuators.size(), bus_, options_.program.lcm);
    const std::int64_t begin_us = firmware_sim::MonotonicTime_us();
    while (!Interrupted() && !ended) {
      firmware_sim::SleepFor(kIdle_us);
      Tell();
      const double ran_s = 1e-6 * static_cast<double>(firmware_sim::MonotonicTime_us() - begin_us);
      if (options_.duration_s > 0 && ran_s > options_.duration_s) break;
    }
    stop = true;
    plant.join();
    Tell();
    if (!runner.refused().empty()) Complain("warning: {}", runner.refused());
    std::error_code ignored;
    fs::remove(folder_ / kCheckpoint, ignored);  // a run that ended is not gone on with
    return Conclude(runner.counters(), runner.refused(), status);
  }

 private:
  const PlantOptions& options_;
  scene::Scene scene_;
  std::string bus_;
  fs::path folder_;
  std::optional<model::Plant> plant_;
  std::unique_ptr<reduced::ReducedPlant> model_;
  std::unique_ptr<firmware_sim::Bus> station_;
  std::optional<loop::WatchingBus> watch_bus_;
  std::optional<loop::GatedBus> gate_;
  std::optional<loop::CountedBus> counted_;  ///< in lock-step
  std::unique_ptr<loop::PlantVehicle> vehicle_;
  std::optional<loop::PlantWatch> watch_;
  std::unique_ptr<LcmLink> telemetry_;
  std::optional<ShapeMessages> shapes_;
  std::optional<controller::Reference> reference_;
  controller::ControlOptions control_;
  std::optional<loop::LoopAccount> account_;
  loop::LoopResult result_;
  firmware_sim::SpscRing<std::string> checkpoints_{2};
  double start_s_{0}, next_checkpoint_s_{0};  ///< the latter of the plant's thread
  bool released_{false};
  std::uint64_t foreign_told_{0};

  // Paced by the control side; simulated time.
  int ExecuteInLockStep() {
    telemetry_ = OpenLcm({.url = options_.program.lcm});
    StepServer server(options_.program.lcm, *vehicle_, *counted_, loop::Period_us(scene_.drives));
    CatchInterrupts();
    Say("lock-step: {} drives on {}, waits for `mantle control --lockstep`",
        scene_.reduction.actuators.size(), bus_);
    const loop::Status status = server.Run([] { return Interrupted(); },
                                           [this](double t_s) {
                                             watch_->Look(t_s);
                                             Tell();
                                           });
    return Conclude(loop::PlantRunnerCounters{}, std::string(), status);
  }

  template <typename... Args>
  void Say(fmt::format_string<Args...> format, Args&&... args) const {
    if (options_.program.scene.json) return;
    Print("plant: {}\n", fmt::format(format, std::forward<Args>(args)...));
    FlushOutput();
  }

  void Build() {
    station_ = OpenStation(bus_, false);
    watch_bus_.emplace(*station_);
    gate_.emplace(*watch_bus_);
    counted_.emplace(*station_, kFrame_us);
    firmware_sim::Bus& own =
        options_.lock_step ? static_cast<firmware_sim::Bus&>(*counted_) : *gate_;
    InScene(options_.program.scene, [&] {
      plant_.emplace(loop::PlantRobot(scene_));
      model_ =
          std::make_unique<reduced::ReducedPlant>(loop::BelievedRobot(scene_), scene_.reduction);
      vehicle_ = std::make_unique<loop::PlantVehicle>(*plant_, *model_, scene_.run,
                                                      scene_.reduction.actuators, scene_.drives,
                                                      scene_.sensors, own);
      control_ = *scene_.control;
      reference_.emplace(control_.goal, model_->robot);
      account_.emplace(*model_, control_, *reference_, scene_.run.duration_s);
      return 0;
    });
    const int arm = reference_->has_tip() ? reference_->arm() : -1;
    watch_.emplace(*vehicle_, &vehicle_->side(), model_->input_count(),
                   loop::PlantWatch::Options{std::numeric_limits<double>::infinity(),
                                             scene_.run.output_interval_s, arm});
    shapes_.emplace(*plant_);
    account_->Start(scene_.robot.root_pose.position, &result_);
  }

  std::string Header() const {
    return fmt::format("mantle-plant {} {:016x}", kVersion, scene_.fingerprint);
  }

  void Resume() {
    std::error_code error;
    fs::create_directories(folder_, error);
    const fs::path file = folder_ / kCheckpoint;
    std::ifstream in(file, std::ios::binary);
    if (!in) return;
    if (options_.fresh) {
      Say("--fresh: from t = 0, not from {}", file.string());
      return;
    }
    const std::string text{std::istreambuf_iterator<char>(in), {}};
    const std::size_t line = text.find('\n');
    if (line == std::string::npos || text.substr(0, line) != Header()) {
      throw BadInput(fmt::format("{}: is of another scene or version: --fresh begins at t = 0",
                                 file.string()));
    }
    try {
      vehicle_->side().Restore(text.substr(line + 1));
    } catch (const model::BadRobot& refused) {
      throw BadInput(fmt::format("{}: {}", file.string(), refused.what()));
    }
    start_s_ = vehicle_->side().simulation().time_s();
    next_checkpoint_s_ = start_s_ + kCheckpoint_s;
    Say("goes on from t = {:.3f} s ({})", start_s_, file.string());
  }

  // In the plant's thread.
  void OnPeriod(double time_s) {
    watch_->Look(time_s);
    if (time_s < next_checkpoint_s_) return;
    next_checkpoint_s_ = time_s + kCheckpoint_s;
    checkpoints_.Push(vehicle_->side().Checkpoint());
  }

  void Tell() {
    for (std::string text; checkpoints_.Pop(&text);) {
      WriteWhole(folder_, kCheckpoint, Header() + "\n" + text);
    }
    for (loop::PlantFrame frame; watch_->Receive(&frame);) {
      if (!released_) Say("goes at t = {:.3f} s", frame.time_s);
      released_ = true;
      result_.time_s = frame.time_s;
      telemetry_->Write(ReducedStateMessage(frame.truth));
      if (frame.time_s > scene_.run.duration_s + 1e-6) continue;  // the drives are taken down
      account_->Look(frame.truth, frame.tip, &result_);
      account_->Add(frame.truth, scene_.drives.period_s, frame.tension_n, frame.tension_n,
                    frame.tension_n, &result_);
      ++result_.cycles;
    }
    for (const loop::PlantSnapshot* s = watch_->Front(); s != nullptr; s = watch_->Front()) {
      telemetry_->Write(StateMessage(*plant_, s->sample));
      telemetry_->Write(EnergyMessage(s->sample, s->energy));
      telemetry_->Write(shapes_->Of(s->state, s->sample.cable_tension_n));
      watch_->DropSnapshot();
    }
    if (const std::uint64_t foreign = watch_bus_->foreign(); foreign > foreign_told_) {
      if (foreign_told_ == 0) {
        Complain(
            "plant: bus {}: a foreign frame with identifier {:03X} of these drives: other drives "
            "of the same nodes are on the bus",
            bus_, watch_bus_->first_foreign());
      }
      foreign_told_ = foreign;
    }
  }

  int Conclude(const loop::PlantRunnerCounters& counters, const std::string& refused,
               const loop::Status& status) {
    account_->Conclude(&result_);
    Json j;
    j["scene"] = scene_.name;
    j["started_s"] = start_s_;
    j["time_s"] = result_.time_s;
    j["ok"] = status.ok;
    j["reason"] = status.reason;
    j["error"] = {{"name", result_.error_name},
                  {"mean", result_.mean_error},
                  {"max", result_.max_error},
                  {"final", result_.final_error}};
    j["waypoints"] = nullptr;
    if (!result_.waypoints.empty()) j["waypoints"] = Json::array();
    for (const loop::WaypointResult& w : result_.waypoints) {
      j["waypoints"].push_back(
          {{"distance_m", std::isfinite(w.distance_m) ? Json(w.distance_m) : Json()},
           {"time_s", w.time_s},
           {"passed", w.passed}});
    }
    j["body_length_m"] = plant_->body_length_m;
    j["bus"] = bus_;
    j["foreign_frames"] = watch_bus_->foreign();
    j["real_time"] = nullptr;
    if (!options_.lock_step) {
      j["real_time"] = PlantRunnerJson(counters);
      j["real_time"]["scheduled_fifo"] = refused.empty();
    }
    std::error_code exists;
    fs::create_directories(folder_, exists);
    WriteWhole(folder_, "plant.json", Dump(j));
    if (options_.program.scene.json) PrintText(Dump(j));
    if (!status.ok) {
      Complain("plant: {}: {} at t = {:.3f} s", scene_.name, status.reason, result_.time_s);
      return kExitCannotContinue;
    }
    if (options_.lock_step) {
      Say("ended at t = {:.3f} s; {}", result_.time_s, (folder_ / "plant.json").string());
      return 0;
    }
    Say("ended at t = {:.3f} s: {} of {} periods late; {}", result_.time_s, counters.late_periods,
        counters.periods, (folder_ / "plant.json").string());
    return 0;
  }
};

}  // namespace

void AddPlantCommand(CLI::App& app, int& exit_status) {
  static PlantOptions options;  // lives as long as the parser that points to it
  CLI::App* command = app.add_subcommand("plant", kHelp);
  AddProgramOptions(command, &options.program);
  command
      ->add_option("--out", options.program.scene.out,
                   "Folder for plant.json and the checkpoint (default: results/SCENE.plant)")
      ->type_name("DIR");
  command->add_flag("--fresh", options.fresh, "From t = 0, whatever checkpoint is there");
  command->add_flag("--free", options.free,
                    "Not held: the vehicle goes at once (for masters that do not speak LCM)");
  command->add_flag("--lockstep", options.lock_step,
                    "Simulated time, paced by `mantle control --lockstep`");
  command
      ->add_option("--duration", options.duration_s, "End after so many seconds (default: Ctrl-C)")
      ->type_name("SECONDS")
      ->check(CLI::PositiveNumber);
  command->callback([&exit_status] { exit_status = PlantJob(options).Execute(); });
}

}  // namespace mantle::tools
