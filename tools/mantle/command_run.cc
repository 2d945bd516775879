#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <limits>
#include <memory>
#include <optional>

#include "firmware_sim/bus/open_bus.h"
#include "tools/mantle/build_run.h"
#include "tools/mantle/control_run.h"
#include "tools/mantle/interrupt.h"
#include "tools/mantle/lcm_bridge.h"
#include "tools/mantle/output_folder.h"
#include "tools/mantle/progress.h"
#include "tools/mantle/reduced_run.h"
#include "tools/mantle/run_checkpoint.h"
#include "tools/mantle/run_log.h"
#include "tools/mantle/scene_options.h"
#include "tools/mantle/standard_output.h"
#include "tools/mantle/summary.h"
#include "tools/mantle/trajectory.h"
#include "tools/report/page_file.h"
#include "tools/studies/accuracy_choice.h"

namespace mantle::tools {
namespace {

constexpr double kSameTime_s = 1e-9;
constexpr const char* kHelp =
    "Run a scene in time; write summary.json, trajectory.csv and telemetry.lcmlog "
    "(docs/outputs.md).\nA scene with a table [control] runs in closed loop, through simulated "
    "drives on a CAN bus\n(docs/control.md).\n\n"
    "  mantle run scenes/paper.toml --out results\n"
    "  mantle run scenes/paper.toml --set time.step=0.002 --set time.integrator=sdirk3\n"
    "  mantle run scenes/paper.toml --json | python3 -m json.tool\n"
    "  mantle run scenes/paper.toml --accuracy 1%      # says what it chooses, and why\n"
    "  mantle run scenes/paper.toml --model reduced\n"
    "  mantle run scenes/paper.toml --out r --checkpoint-every 1    # Ctrl-C, then:\n"
    "  mantle run scenes/paper.toml --out r --resume r.partial/checkpoint\n"
    "  mantle run scenes/steer.toml --out results --report          # closed loop, and a page to "
    "look at\n"
    "  mantle run scenes/steer.toml --realtime --lcm 'udpm://239.255.76.67:7667?ttl=0'\n"
    "  mantle run scenes/steer.toml --bus can:vcan0 --record bus.log\n\n"
    "Exit status 0: done. 1: standard output could not be written. 2: bad input, nothing changed. "
    "3: "
    "the\nrun could not go on; what it reached is in the folder DIR.partial, and DIR is as it was.";

struct RunOptions {
  SceneOptions scene;
  double checkpoint_every_s{std::numeric_limits<double>::infinity()};
  double stop_at_s{std::numeric_limits<double>::infinity()};
  std::string resume;
  RunChoice choice;
  ControlRunOptions control;
  int shape_every{1};
  bool shape_every_given{false};
  std::string accuracy;  ///< as given; empty: the scene's own mesh and steps

  bool has_checkpoints() const {
    return std::isfinite(checkpoint_every_s) || std::isfinite(stop_at_s) || !resume.empty();
  }
};

double Seconds(std::chrono::steady_clock::duration d) {
  return std::chrono::duration<double>(d).count();
}

void PrintSummary(const Json& j, const std::filesystem::path& folder) {
  const Json& root = j["final"]["root"];
  const auto p = root["position_m"].get<std::vector<double>>();
  Print("{}: {:.6g} s simulated in {:.3g} s ({:.1f}x real time), {} steps, {} rejected\n",
        j["scene"].get<std::string>(), j["sim_time_s"].get<double>(),
        j["wall_time_s"].get<double>(), j["realtime_factor"].get<double>(), j["steps"].get<long>(),
        j["rejected_steps"].get<long>());
  Print("  root at ({:.4f}, {:.4f}, {:.4f}) m\n", p[0], p[1], p[2]);
  for (const auto& [name, tip] : j["final"]["tips"].items()) {
    const auto t = tip["position_m"].get<std::vector<double>>();
    Print("  tip of {} at ({:.4f}, {:.4f}, {:.4f}) m\n", name, t[0], t[1], t[2]);
  }
  if (!j["volume_m3"].is_null()) {
    Print("  volume {:.2f} to {:.2f} mL\n", 1e6 * j["volume_m3"]["min"].get<double>(),
          1e6 * j["volume_m3"]["max"].get<double>());
  }
  if (!j["power_balance_residual"].is_null()) {
    Print("  power balance residual {:.2e} of {:.3g} W", j["power_balance_residual"].get<double>(),
          j["power_balance_scale_w"].get<double>());
    if (!j["energy_drift"].is_null()) {
      Print(", energy drift {:.2e} of {:.3g} J", j["energy_drift"].get<double>(),
            j["energy_drift_scale_j"].get<double>());
    }
    Print("\n");
  }
  Print("  results in {}\n", folder.string());
}

// Without the titles.
std::int64_t RowCount(const std::string& csv) {
  return std::max<std::int64_t>(std::count(csv.begin(), csv.end(), '\n') - 1, 0);
}

/// One run of the command: owns what its sample-by-sample observer needs.
class RunJob {
 public:
  RunJob(const RunOptions& options)
      : options_(options),
        scene_(options.scene.Load()),
        plant_(BuildPlant(options.scene, scene_)),
        out_(options.scene.OutputFolder(scene_)) {
    DemandTime(options.scene, scene_, "mantle run");
  }

  int Execute() {
    DemandCheckpoints();
    simulation_ = BuildFullRun(options_.scene, scene_, plant_);
    const Before before = Resume();
    if (shape_every_ > 0) log_.emplace(plant_, shape_every_);
    const double start_s = simulation_->time_s();
    WarnOfMismatch();
    CatchInterrupts();  // before there is a folder that an interrupt would leave half-made
    OpenFolder();
    StartTrajectory(before.trajectory.empty() ? TrajectoryTitles(plant_) : before.trajectory);
    if (log_) log_->Start(folder_->partial(), before.log, RowCount(before.trajectory));
    next_checkpoint_s_ = NextCheckpoint(start_s);
    Progress progress(start_s, scene_.run.duration_s, "s", true);
    const auto begin = std::chrono::steady_clock::now();
    const model::RunResult result = simulation_->Run([&](const model::Sample& sample) {
      progress.Update(sample.time_s);
      return OnSample(sample);
    });
    const double wall_s = Seconds(std::chrono::steady_clock::now() - begin);
    progress.Finish();
    return Conclude(result, wall_s, start_s);
  }

 private:
  const RunOptions& options_;
  scene::Scene scene_;
  model::Plant plant_;
  std::filesystem::path out_;
  std::unique_ptr<ResultFolder> folder_;
  std::unique_ptr<model::Simulation> simulation_;
  std::unique_ptr<OutputFile> trajectory_;
  std::uint64_t trajectory_hash_{scene::kEmptyHash};
  int shape_every_{options_.shape_every};
  std::optional<RunLog> log_;
  VolumeRange volume_;
  double next_checkpoint_s_{0};

  // What a resumed run has already written.
  struct Before {
    std::string trajectory, log;
  };

  void WarnOfMismatch() const {
    if (scene_.mismatch.none()) return;
    Complain(
        "warning: {}: mismatch: acts in a closed loop alone; this run is of the robot as it is "
        "described",
        scene_.name);
  }

  // CVODE keeps a history that a checkpoint cannot hold.
  bool can_checkpoint() const { return scene_.run.stepper.integrator != model::Integrator::kCvode; }

  void DemandCheckpoints() const {
    if (can_checkpoint()) return;
    const char* option = std::isfinite(options_.checkpoint_every_s) ? "--checkpoint-every"
                         : std::isfinite(options_.stop_at_s)        ? "--stop-at"
                         : !options_.resume.empty()                 ? "--resume"
                                                                    : nullptr;
    if (option == nullptr) return;
    throw BadInput(fmt::format(
        "{}: needs another integrator than cvode, whose history no checkpoint holds", option));
  }

  // Both empty for a run from the start.
  Before Resume() {
    if (options_.resume.empty()) return {};
    const RunCheckpoint c = ReadCheckpoint(options_.resume, scene_.fingerprint);
    try {
      simulation_->Restore(c.simulation);
    } catch (const model::BadRobot& error) {
      throw BadInput(fmt::format("--resume: {}: {}", options_.resume, error.what()));
    }
    volume_ = c.volume;
    if (options_.shape_every_given && options_.shape_every != c.shape_every) {
      throw BadInput(fmt::format("--shape-every: {}, must be {} as in the run that is resumed",
                                 options_.shape_every, c.shape_every));
    }
    shape_every_ = c.shape_every;
    return {TrajectoryBefore(options_.resume, c), LogBefore(options_.resume, c)};
  }

  // What it goes on from stays until there is something newer.
  void OpenFolder() {
    constexpr const char* kResumed[] = {"trajectory.csv", "telemetry.lcmlog", "checkpoint"};
    ResultFolder::Kept kept;
    if (!options_.resume.empty()) {
      kept = {std::filesystem::absolute(options_.resume).parent_path(), kResumed};
    }
    folder_ = std::make_unique<ResultFolder>(out_, kSceneResults, kept);
  }

  void StartTrajectory(const std::string& begin) {
    trajectory_ = std::make_unique<OutputFile>(folder_->partial(), "trajectory.csv", begin);
    trajectory_hash_ = scene::Hash(begin);
  }

  double NextCheckpoint(double t_s) const {
    const double every = options_.checkpoint_every_s;
    return std::isfinite(every) ? (std::floor(t_s / every + kSameTime_s) + 1.0) * every : every;
  }

  void SaveCheckpoint() {
    trajectory_->Flush();
    const RunLog::Mark log = log_ ? log_->Flush() : RunLog::Mark{};
    WriteWhole(
        folder_->partial(), "checkpoint",
        CheckpointText({scene_.fingerprint, trajectory_->size_bytes(), trajectory_hash_,
                        shape_every_, log.bytes, log.hash, volume_, simulation_->Checkpoint()}));
  }

  bool OnSample(const model::Sample& sample) {
    const std::string row = TrajectoryRow(plant_, sample);
    trajectory_->Write(row);
    trajectory_hash_ = scene::Hash(row, trajectory_hash_);
    if (log_) {
      const bool at_end = sample.time_s >= scene_.run.duration_s - kSameTime_s;
      log_->Add(sample, simulation_->state(), &simulation_->energy(), at_end);
    }
    if (plant_.shell) volume_.Add(sample.volume_m3);
    if (sample.time_s >= next_checkpoint_s_ - kSameTime_s) {
      SaveCheckpoint();
      next_checkpoint_s_ = NextCheckpoint(sample.time_s);
    }
    return !Interrupted() && sample.time_s < options_.stop_at_s - kSameTime_s;
  }

  int Conclude(const model::RunResult& result, double wall_s, double start_s) {
    const bool complete = result.ok && result.sim_time_s >= scene_.run.duration_s - kSameTime_s;
    std::string reason = result.reason;
    if (result.ok && !complete) reason = Interrupted() ? "interrupted" : "stopped by --stop-at";
    if (result.ok && !complete && can_checkpoint()) SaveCheckpoint();
    const Json summary = RunSummary({&scene_, &plant_, &result, volume_, options_.scene.overrides,
                                     wall_s, result.sim_time_s - start_s, complete, reason});
    trajectory_->Close();
    if (log_) log_->Close();
    WriteWhole(folder_->partial(), "summary.json", Dump(summary));
    if (complete) {
      folder_->Publish();
    } else {
      Complain("{}: {} at t = {:.6g} s; partial results in {}", scene_.name, reason,
               result.sim_time_s, folder_->partial().string());
    }
    const bool as_commanded = complete || (result.ok && !Interrupted());
    const int status = as_commanded ? 0 : kExitCannotContinue;
    if (options_.scene.json) {
      PrintText(Dump(summary), status);
    } else if (complete) {
      PrintSummary(summary, folder_->folder());
    }
    ReportBeside(options_.scene.report, complete ? folder_->folder() : folder_->partial(),
                 options_.scene.json || !complete);
    ComplainOfWarnings(scene_.name, result.warnings);
    return status;
  }
};

int Execute(const RunOptions& options) {
  const bool reduced = options.choice.reduced();
  const bool closed = options.choice.closed(options.scene.Load());
  if (const char* given = options.control.FirstGiven(); given != nullptr && !closed) {
    throw BadInput(fmt::format("{}: is for a closed loop, must be with {}", given,
                               reduced                    ? "--model full"
                               : options.choice.open_loop ? "--open-loop left out"
                                                          : "a scene that has a table [control]"));
  }
  if ((closed || reduced) && options.has_checkpoints()) {
    throw BadInput(reduced ? "--model reduced: has no checkpoints"
                           : "a closed loop has no checkpoints: --checkpoint-every, --resume and "
                             "--stop-at need --open-loop");
  }
  DemandReportPage(options.scene.report);
  if (!options.accuracy.empty()) {
    const double target = ParseAccuracy(options.accuracy);
    if (closed || reduced || !options.resume.empty()) {
      throw BadInput(fmt::format("--accuracy: chooses mesh and steps of the plant, must be {}",
                                 reduced  ? "with --model full"
                                 : closed ? "with --open-loop"
                                          : "without --resume"));
    }
    const AccuracyChoice choice =
        ChooseAccuracy(options.scene.scene_file, options.scene.overrides, target);
    ComplainText(choice.text, "accuracy");
    RunOptions with = options;
    with.scene.overrides.insert(with.scene.overrides.end(), choice.overrides.begin(),
                                choice.overrides.end());
    return RunJob(with).Execute();
  }
  if (closed) return RunControlScene(options.scene, options.control, options.shape_every);
  return reduced ? RunReducedScene(options.scene, options.shape_every) : RunJob(options).Execute();
}

void AddControlOptions(CLI::App* command, ControlRunOptions* options) {
  const char* group = "Closed loop";
  command->add_option("--controller", options->controller, "Instead of the scene's")
      ->check(CLI::IsMember({"mpc", "gait", "pursuit", "pid", "lqr"}))
      ->group(group);
  command
      ->add_option("--bus", options->bus,
                   "Instead of the scene's: " + std::string(firmware_sim::kBusSpecHelp))
      ->type_name("SPEC")
      ->group(group);
  command
      ->add_flag("--realtime", options->real_time,
                 "Paced by the wall clock, the solver stopped at its deadline")
      ->group(group);
  command->add_option("--lcm", options->lcm_url, std::string("Publish there: ") + kLcmUrlHelp)
      ->type_name("URL")
      ->group(group);
  command->add_option("--record", options->record, "Write the bus's frames as a candump log")
      ->type_name("FILE")
      ->group(group);
}

}  // namespace

void AddRunCommand(CLI::App& app, int& exit_status) {
  CLI::App* command = app.add_subcommand("run", kHelp);
  static RunOptions options;  // lives as long as the parser that points to it
  AddSceneOptions(command, &options.scene);
  AddOutOption(command, &options.scene);
  AddReportOption(command, &options.scene.report);
  command
      ->add_option("--checkpoint-every", options.checkpoint_every_s,
                   "Write DIR.partial/checkpoint every so many simulated seconds, at a sample")
      ->type_name("SECONDS")
      ->check(CLI::PositiveNumber);
  command->add_option("--resume", options.resume, "Go on from a checkpoint, with the same bits")
      ->type_name("FILE");
  command
      ->add_option("--stop-at", options.stop_at_s,
                   "Stop at the first sample at or after this simulated time, with a checkpoint")
      ->type_name("SECONDS")
      ->check(CLI::PositiveNumber);
  const CLI::Option* shapes =
      command
          ->add_option("--shape-every", options.shape_every,
                       "Log the whole bodies (MANTLE_SHAPE) of every N-th sample; 0: never, and in "
                       "open loop no log")
          ->type_name("N")
          ->check(CLI::Range(0, 1'000'000))
          ->capture_default_str();
  command
      ->add_option("--accuracy", options.accuracy,
                   "Choose elements, integrator and step for this largest error of root and tips, "
                   "in body lengths: 1%, 0.003")
      ->type_name("SHARE");
  AddRunChoice(command, &options.choice);
  AddControlOptions(command, &options.control);
  command->callback([&exit_status, shapes] {
    options.shape_every_given = shapes->count() > 0;
    exit_status = Execute(options);
  });
}

}  // namespace mantle::tools
