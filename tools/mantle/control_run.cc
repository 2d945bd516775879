#include "tools/mantle/control_run.h"

#include <fmt/format.h>

#include <cmath>
#include <cstdio>
#include <iterator>
#include <memory>
#include <optional>
#include <stdexcept>
#include <system_error>

#include "loop/closed_loop.h"
#include "tools/mantle/control_summary.h"
#include "tools/mantle/control_table.h"
#include "tools/mantle/interrupt.h"
#include "tools/mantle/lcm_bridge.h"
#include "tools/mantle/loop_telemetry.h"
#include "tools/mantle/output_folder.h"
#include "tools/mantle/process.h"
#include "tools/mantle/progress.h"
#include "tools/mantle/reduced_run.h"
#include "tools/mantle/trajectory.h"

namespace mantle::tools {
namespace {

constexpr double kSameTime_s = 1e-9;

/// One closed loop and the files it leaves.
class ControlJob {
 public:
  ControlJob(const SceneOptions& scene_options, const ControlRunOptions& options)
      : scene_options_(scene_options),
        options_(options),
        scene_(scene_options.Load()),
        folder_(scene_options.OutputFolder(scene_)),
        kind_(options.controller.empty() ? scene_.control->controller
                                         : ControllerOf(options.controller)),
        bus_(options.bus.empty() ? scene_.drives.bus : options.bus) {}

  int Execute() {
    OpenLoop();
    PrepareFolder(folder_);
    RemoveOldResults(folder_, kRunResults);
    lcm_ = OpenLcm({.log_folder = folder_, .url = options_.lcm_url});
    trajectory_.emplace(folder_, "trajectory.csv", Titles());
    if (kind_ == controller::ControllerKind::kMpc) {
      solver_.emplace(folder_, "solver.csv",
                      "time_s,prepare_ms,solve_ms,iterations,cost,outcome\n");
    }
    bool locked = false;
    if (options_.real_time) {
      const std::string refused = LockMemory();
      locked = refused.empty();
      if (!locked) fmt::print(stderr, "mantle: {}\n", refused);
    }
    CatchInterrupts();
    progress_.emplace(0.0, scene_.run.duration_s, "s", true);
    const loop::LoopResult result =
        loop_->Run([this](const loop::LoopStep& step) { return OnStep(step); });
    progress_->Finish();
    return Conclude(result, locked);
  }

 private:
  const SceneOptions& scene_options_;
  const ControlRunOptions& options_;
  scene::Scene scene_;
  std::filesystem::path folder_;
  controller::ControllerKind kind_;
  std::string bus_;
  std::optional<firmware_sim::CandumpWriter> record_;
  std::unique_ptr<loop::ClosedLoop> loop_;
  std::unique_ptr<LcmLink> lcm_;
  std::optional<OutputFile> trajectory_, solver_;
  std::optional<Progress> progress_;
  VolumeRange volume_;
  double next_sample_s_{0};
  long iterations_{0};

  void OpenLoop() {
    loop::ClosedLoopOptions o;
    o.real_time = options_.real_time;
    o.controller = kind_;
    o.bus = bus_;
    try {
      if (!options_.record.empty()) {
        record_.emplace(options_.record, bus_.starts_with("can:") ? bus_.substr(4) : "vcan0");
        o.record = &*record_;
      }
      loop_ =
          InScene(scene_options_, [&] { return std::make_unique<loop::ClosedLoop>(scene_, o); });
    } catch (const std::invalid_argument& error) {
      throw BadInput(error.what());
    } catch (const std::system_error& error) {
      throw BadInput(error.what());
    }
  }

  // One walk for titles and values, so that they cannot disagree.
  template <typename Emit>
  void Walk(const loop::LoopStep* step, Emit emit) const {
    const auto& motors = scene_.reduction.actuators;
    for (std::size_t i = 0; i < motors.size(); ++i) {
      const auto k = static_cast<Eigen::Index>(i);
      emit("command_" + motors[i].name + "_n", step == nullptr ? 0.0 : step->command_n(k));
      emit("actual_" + motors[i].name + "_n", step == nullptr ? 0.0 : step->tension_n(k));
    }
    const controller::Reference& reference = loop_->reference();
    const controller::ReferencePoint at = reference.At(step == nullptr ? 0.0 : step->time_s);
    const auto vector = [&](const char* name, const model::Vector3& v, const char* unit) {
      const char* axes[] = {"x", "y", "z"};
      for (int k = 0; k < 3; ++k) emit(fmt::format("{}{}_{}", name, axes[k], unit), v(k));
    };
    if (reference.has_position()) vector("reference_", at.position, "m");
    if (reference.has_tip()) vector("reference_tip_", at.tip, "m");
    if (!reference.has_position() && !reference.has_tip()) {
      vector("reference_v", at.velocity, "m_s");
    }
    emit(reference.has_position() ? "error_position_m"
         : reference.has_tip()    ? "error_tip_m"
                                  : "error_mean_speed_m_s",
         step == nullptr ? 0.0 : step->error);
  }

  std::string Titles() const {
    std::string line = TrajectoryTitles(loop_->plant());
    line.pop_back();
    Walk(nullptr, [&](const std::string& name, double) { line += "," + name; });
    return line + "\n";
  }

  std::string Row(const model::Sample& sample, const loop::LoopStep& step) const {
    std::string line = TrajectoryRow(loop_->plant(), sample);
    line.pop_back();
    Walk(&step, [&](const std::string&, double value) {
      fmt::format_to(std::back_inserter(line), ",{}", value);
    });
    return line + "\n";
  }

  bool OnStep(const loop::LoopStep& step) {
    progress_->Update(step.time_s);
    const bool at_end = step.time_s >= scene_.run.duration_s - kSameTime_s;
    if (step.time_s >= next_sample_s_ - kSameTime_s || at_end) {
      const double interval = scene_.run.output_interval_s;
      next_sample_s_ = (std::floor(step.time_s / interval + kSameTime_s) + 1.0) * interval;
      OnSample(step);
    }
    if (step.planned && step.mpc != nullptr) OnPlan(step);
    return !Interrupted();
  }

  void OnSample(const loop::LoopStep& step) {
    const model::Sample sample = loop_->vehicle().Observe();
    trajectory_->Write(Row(sample, step));
    if (loop_->plant().shell) volume_.Add(sample.volume_m3);
    lcm_->Write(StateMessage(loop_->plant(), sample));
    lcm_->Write(ReducedStateMessage(step.truth));
    lcm_->Write(DrivesMessage(scene_.reduction.actuators, step));
    lcm_->Write(EnergyMessage(sample, step.vehicle.simulation().energy()));
    lcm_->Write(StatusMessage(ControllerName(kind_), step, iterations_));
  }

  void OnPlan(const loop::LoopStep& step) {
    const controller::MpcStatus& s = step.mpc->status();
    iterations_ += s.iterations;
    lcm_->Write(PlanMessage(loop_->reduced(), step, options_.real_time));
    if (!solver_) return;
    solver_->Write(fmt::format("{},{:.4f},{:.4f},{},{},\"{}\"\n", step.time_s, 1e3 * s.prepare_s,
                               1e3 * s.solve_s, s.iterations, s.cost, ToString(s.outcome)));
  }

  int Conclude(const loop::LoopResult& result, bool locked) {
    const bool complete = result.ok && result.time_s >= scene_.run.duration_s - kSameTime_s;
    const std::string reason = result.ok && !complete ? "interrupted" : result.reason;
    Json summary =
        RunSummary({&scene_, &loop_->plant(), &result.plant, volume_, scene_options_.overrides,
                    result.wall_s, result.time_s, complete, reason});
    summary["reduced"] = ReductionSummary(scene_, loop_->reduced());
    summary["control"] =
        ControlSummary({&scene_, loop_.get(), &result, kind_, bus_, options_.real_time, locked});
    OutputFile file(folder_, "summary.json", summary.dump(2) + "\n");
    trajectory_->Flush();
    file.Flush();
    if (record_ && !record_->Flush()) {
      throw std::runtime_error(options_.record + ": cannot be written; is the disk full?");
    }
    if (complete) {
      lcm_->FinishLog();
      trajectory_->Publish();
      if (solver_) solver_->Publish();
      file.Publish();
    }
    Report(summary, complete);
    if (lcm_->counters().publish_failures > 0) {
      fmt::print(stderr, "mantle: --lcm: {}: {} messages were not taken by the network\n",
                 options_.lcm_url, lcm_->counters().publish_failures);
    }
    if (complete) return 0;
    fmt::print(stderr, "mantle: {}: {} at t = {:.6g} s; partial results in {}\n", scene_.name,
               reason, result.time_s, folder_.string());
    return kExitCannotContinue;
  }

  void Report(const Json& summary, bool complete) const {
    if (scene_options_.json) {
      fmt::print("{}\n", summary.dump(2));
    } else if (complete) {
      fmt::print("{}  results in {}\n", ControlTable(summary), folder_.string());
    }
    std::fflush(stdout);
  }
};

}  // namespace

const char* ControlRunOptions::FirstGiven() const {
  return !controller.empty() ? "--controller"
         : !bus.empty()      ? "--bus"
         : real_time         ? "--realtime"
         : !lcm_url.empty()  ? "--lcm"
         : !record.empty()   ? "--record"
                             : nullptr;
}

int RunControlScene(const SceneOptions& scene, const ControlRunOptions& options) {
  return ControlJob(scene, options).Execute();
}

}  // namespace mantle::tools
