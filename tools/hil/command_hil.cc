#include <fmt/format.h>
#include <unistd.h>

#include <array>
#include <cstdlib>
#include <fstream>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "firmware_sim/bus/candump_log.h"
#include "firmware_sim/bus/socket_time.h"
#include "tools/hil/lcm_listener.h"
#include "tools/hil/program_options.h"
#include "tools/live/run_process.h"
#include "tools/mantle/interrupt.h"
#include "tools/mantle/output_file.h"
#include "tools/mantle/output_folder.h"
#include "tools/mantle/standard_output.h"
#include "tools/mantle/summary.h"

/// `mantle hil`: plant, control and a recorder as three programs.

namespace mantle::tools {
namespace {

namespace fs = std::filesystem;

constexpr const char* kHelp =
    "Hardware in the loop without the hardware (docs/hil.md): starts `mantle plant` and `mantle "
    "control` as programs\nof their own on a CAN bus and LCM, records both, shows how they do, and "
    "stops all.\n\n"
    "  mantle hil scenes/steer.toml --out results/hil\n"
    "  mantle hil scenes/steer.toml --controller pid --bus can:vcan0\n"
    "  mantle hil scenes/steer.toml --follow               # and your own controller beside it\n\n"
    "The bus, where --bus does not name one: a vcan of its own where this machine lets us make "
    "one, "
    "else multicast on\nthe loopback interface. DIR gets summary.json, plant.json, control.json, "
    "telemetry.lcmlog and bus.log.\n"
    "Exit status 0: done. 2: bad input. 3: a program could not go on, or all was stopped; what was "
    "reached is in DIR.partial.";

constexpr const char* kHilResults[] = {"summary.json",     "plant.json", "control.json", "bus.log",
                                       "telemetry.lcmlog", "timing.png", "checkpoint"};
constexpr std::int64_t kLook_us = 10'000;
constexpr std::int64_t kLine_us = 1'000'000;
constexpr std::int64_t kPlantPatience_us = 2'000'000;

struct HilOptions {
  ProgramOptions program;
  std::string controller;
  bool follow{false};
};

/// A vcan interface while it lives, where this machine lets us make one.
class OwnVcan {
 public:
  OwnVcan() : name_(fmt::format("mantle{}", getpid() % 100000)) {
    made_ = Run(fmt::format("ip link add dev {0} type vcan && ip link set up {0}", name_));
  }
  ~OwnVcan() {
    if (made_) Run("ip link delete " + name_);
  }
  OwnVcan(const OwnVcan&) = delete;
  OwnVcan& operator=(const OwnVcan&) = delete;
  bool made() const { return made_; }
  const std::string& name() const { return name_; }

 private:
  static bool Run(const std::string& command) {
    return std::system(("(" + command + ") >/dev/null 2>&1").c_str()) == 0;
  }
  std::string name_;
  bool made_;
};

/// Keeps what both programs say, and what the screen needs of it.
class Recording final : public TelemetrySink {
 public:
  explicit Recording(const fs::path& folder) : log_(OpenLcm({.log_folder = folder})) {}

  void Write(const StateTelemetry& m) override { Keep(m); }
  void Write(const ReducedStateTelemetry& m) override {
    time_s_ = 1e-6 * static_cast<double>(m.utime);
    position_ = m.root_position;
  }
  void Write(const PlanTelemetry& m) override { Keep(m); }
  void Write(const DrivesTelemetry& m) override { Keep(m); }
  void Write(const EnergyTelemetry& m) override { Keep(m); }
  void Write(const StatusTelemetry& m) override {
    Keep(m);
    status_ = m;
  }
  void Write(const ShapeTelemetry& m) override { Keep(m); }
  void Write(const ControlTelemetry& m) override { Keep(m); }
  void Write(const WaterTelemetry& m) override { Keep(m); }
  void Write(const SessionTelemetry& m) override { Keep(m); }
  void Write(const SensorsTelemetry& m) override { Keep(m); }
  void Write(const CommandTelemetry& m) override { Keep(m); }
  void Write(const CycleTelemetry& m) override {
    Keep(m);
    phase_ = m.phase;
  }

  std::string Line() const {
    const double due = static_cast<double>(status_.cycles + status_.missed_cycles);
    return fmt::format(
        "t = {:7.2f} s  {:<12}  root ({:.3f}, {:.3f}, {:.3f}) m  {} SYNCs at {:.1f} "
        "Hz, {} late, {} left out; {} plans late",
        time_s_, phase_, position_[0], position_[1], position_[2], status_.cycles,
        due > 0 ? status_.rate : 0.0, status_.late_cycles, status_.missed_cycles,
        status_.late_plans);
  }
  void Finish() { log_->FinishLog(); }

 private:
  template <typename Message>
  void Keep(const Message& m) {
    log_->Write(m);
  }

  std::unique_ptr<LcmLink> log_;
  double time_s_{0};
  Triple position_{};
  StatusTelemetry status_;
  std::string phase_{"starting"};
};

class HilJob {
 public:
  explicit HilJob(const HilOptions& options) : options_(options), scene_(options.program.Load()) {}

  int Execute() {
    folder_ =
        std::make_unique<ResultFolder>(options_.program.scene.OutputFolder(scene_), kHilResults);
    std::optional<OwnVcan> vcan;
    bus_ = options_.program.Bus(scene_);
    if (options_.program.bus.empty() && scene_.drives.bus == "loop") {
      vcan.emplace();
      if (vcan->made()) bus_ = "can:" + vcan->name();
    }
    const std::unique_ptr<firmware_sim::Bus> station = OpenStation(bus_, false);
    frames_.emplace((folder_->partial() / "bus.log").string(),
                    bus_.starts_with("can:") ? bus_.substr(4) : "vcan0");
    Recording recording(folder_->partial());
    const std::unique_ptr<LcmLink> heard = OpenLcm({.url = options_.program.lcm, .receive = true});
    CatchInterrupts();
    Say("bus {}, LCM {}", bus_, options_.program.lcm);
    RunProcess plant(Arguments("plant"));
    RunProcess control(Arguments("control"));
    const std::int64_t begin_us = firmware_sim::MonotonicTime_us();
    std::int64_t line_us = begin_us + kLine_us;
    std::optional<int> controlled, planted;
    for (;;) {
      heard->Receive(static_cast<int>(kLook_us / 1000), recording);
      Record(*station);
      planted = planted ? planted : plant.Poll();
      controlled = controlled ? controlled : control.Poll();
      if (controlled) break;
      if (Interrupted() || planted) control.Stop();
      if (firmware_sim::MonotonicTime_us() < line_us) continue;
      line_us += kLine_us;
      Say("{}", recording.Line());
    }
    // The drives are down; their cables are let go.
    for (const std::int64_t until_us = firmware_sim::MonotonicTime_us() + kPlantPatience_us / 4;
         firmware_sim::MonotonicTime_us() < until_us && !planted;) {
      heard->Receive(static_cast<int>(kLook_us / 1000), recording);
      Record(*station);
      planted = plant.Poll();
    }
    plant.Stop();
    if (!planted) planted = plant.Wait();
    Record(*station);
    recording.Finish();
    frames_->Flush();
    return Conclude(*controlled, *planted,
                    1e-6 * static_cast<double>(firmware_sim::MonotonicTime_us() - begin_us));
  }

 private:
  const HilOptions& options_;
  scene::Scene scene_;
  std::string bus_;
  std::unique_ptr<ResultFolder> folder_;
  std::optional<firmware_sim::CandumpWriter> frames_;

  template <typename... Args>
  void Say(fmt::format_string<Args...> format, Args&&... args) const {
    if (options_.program.scene.json) return;
    Print("hil: {}\n", fmt::format(format, std::forward<Args>(args)...));
    FlushOutput();
  }

  std::vector<std::string> Arguments(const std::string& program) const {
    const ProgramOptions& p = options_.program;
    std::vector<std::string> words{
        program, p.scene.scene_file,         "--bus", bus_, "--lcm", p.lcm,
        "--out", folder_->partial().string()};
    for (const std::string& set : p.scene.overrides) {
      words.insert(words.end(), {"--set", set});
    }
    if (program == "plant") words.emplace_back("--fresh");
    if (program == "control") {
      if (options_.follow) words.emplace_back("--follow");
      if (!options_.controller.empty()) {
        words.insert(words.end(), {"--controller", options_.controller});
      }
    }
    return words;
  }

  void Record(firmware_sim::Bus& station) {
    std::array<firmware_sim::CanFrame, 256> batch;
    for (int i = 0; i < 16; ++i) {
      const std::size_t count = station.Receive(batch);
      for (std::size_t k = 0; k < count; ++k) frames_->Write(batch[k]);
      if (count == 0) break;
    }
  }

  Json Read(const char* name) const {
    std::ifstream in(folder_->partial() / name);
    return in ? Json::parse(in, nullptr, false) : Json();
  }

  int Conclude(int controlled, int planted, double wall_s) {
    const bool complete = controlled == 0 && planted == 0;
    const std::string reason = complete        ? ""
                               : Interrupted() ? "interrupted"
                               : controlled != 0
                                   ? fmt::format("mantle control ended with status {}", controlled)
                                   : fmt::format("mantle plant ended with status {}", planted);
    Json j;
    j["scene"] = scene_.name;
    j["complete"] = complete;
    j["reason"] = reason;
    j["wall_time_s"] = wall_s;
    j["bus"] = bus_;
    j["frames"] = frames_->written();
    j["plant"] = Read("plant.json");
    j["control"] = Read("control.json");
    WriteWhole(folder_->partial(), "summary.json", Dump(j));
    const int status = complete ? 0 : kExitCannotContinue;
    if (complete) {
      folder_->Publish();
    } else {
      Complain("hil: {}: {}; partial results in {}", scene_.name, reason,
               folder_->partial().string());
    }
    if (options_.program.scene.json) {
      PrintText(Dump(j), status);
    } else {
      PrintGoal(j["plant"]);
      Print("hil: results in {}\n", (complete ? folder_->folder() : folder_->partial()).string());
    }
    return status;
  }

  void PrintGoal(const Json& plant) const {
    if (!plant.is_object() || plant["waypoints"].is_null()) return;
    const double length_m = plant["body_length_m"];
    for (std::size_t i = 0; i < plant["waypoints"].size(); ++i) {
      const Json& w = plant["waypoints"][i];
      if (w["distance_m"].is_null()) {
        Print("hil: waypoint {}: its turn did not come\n", i + 1);
        continue;
      }
      const double distance_m = w["distance_m"];
      Print("hil: waypoint {}: {} at {:.2f} s, {:.1f} mm away ({:.1f} % of body length)\n", i + 1,
            w["passed"].get<bool>() ? "passed" : "MISSED, closest", w["time_s"].get<double>(),
            1e3 * distance_m, 100.0 * distance_m / length_m);
    }
  }
};

}  // namespace

void AddHilCommand(CLI::App& app, int& exit_status) {
  static HilOptions options;  // lives as long as the parser that points to it
  CLI::App* command = app.add_subcommand("hil", kHelp);
  AddProgramOptions(command, &options.program);
  AddOutOption(command, &options.program.scene);
  CLI::Option* instead =
      command->add_option("--controller", options.controller, "Instead of the scene's")
          ->check(CLI::IsMember({"mpc", "gait", "pursuit", "pid", "lqr"}));
  command->add_flag("--follow", options.follow, "As mantle control --follow")->excludes(instead);
  command->callback([&exit_status] { exit_status = HilJob(options).Execute(); });
}

}  // namespace mantle::tools
