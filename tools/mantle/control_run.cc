#include "tools/mantle/control_run.h"

#include <fmt/format.h>

#include <cmath>
#include <cstdio>
#include <iterator>
#include <memory>
#include <optional>
#include <stdexcept>
#include <system_error>

#include "tools/mantle/build_run.h"
#include "tools/mantle/control_summary.h"
#include "tools/mantle/control_table.h"
#include "tools/mantle/interrupt.h"
#include "tools/mantle/lcm_bridge.h"
#include "tools/mantle/loop_telemetry.h"
#include "tools/mantle/output_folder.h"
#include "tools/mantle/process.h"
#include "tools/mantle/progress.h"
#include "tools/mantle/reduced_run.h"
#include "tools/mantle/shape_telemetry.h"
#include "tools/mantle/standard_output.h"
#include "tools/mantle/trajectory.h"
#include "tools/mantle/water_telemetry.h"
#include "tools/report/page_file.h"

namespace mantle::tools {
namespace {

constexpr double kSameTime_s = 1e-9;
constexpr double kSession_s = 1.0;  // between two announcements of the run

/// One closed loop and the files it leaves.
class ControlJob {
 public:
  ControlJob(const SceneOptions& scene_options, const ControlRunOptions& options, int shape_every)
      : scene_options_(scene_options),
        options_(options),
        shape_every_(shape_every),
        scene_(scene_options.Load()),
        out_(scene_options.OutputFolder(scene_)),
        controller_(options.controller.empty() ? scene_.control->controller : options.controller),
        bus_(options.bus.empty() ? scene_.drives.bus : options.bus) {}

  int Execute() {
    Check();
    const std::filesystem::path partial = folder_->partial();
    lcm_->StartLog(partial);
    trajectory_.emplace(partial, "trajectory.csv", Titles());
    if (loop_->control_side().mpc() != nullptr) {
      solver_.emplace(partial, "solver.csv",
                      "time_s,prepare_ms,solve_ms,iterations,cost,outcome\n");
    }
    bool locked = false;
    if (options_.real_time) {
      const std::string refused = LockMemory();
      locked = refused.empty();
      if (!locked) ComplainText(refused);
    }
    progress_.emplace(0.0, scene_.run.duration_s, "s", true);
    const loop::LoopResult result =
        loop_->Run([this](const loop::LoopStep& step) { return OnStep(step); });
    progress_->Finish();
    if (result.real_time && !result.real_time->refused.empty()) {
      Complain("warning: {}", result.real_time->refused);
    }
    return Conclude(result, locked);
  }

 private:
  // All that may be refused, before anything is written.
  void Check() {
    try {
      OpenLoop();
      if (shape_every_ > 0) {
        shapes_.emplace(loop_->plant());
        waters_.emplace(loop_->plant(), shapes_->thinning());
      }
      lcm_ = OpenLcm({.url = options_.lcm_url});
      CatchInterrupts();
      folder_.emplace(out_, kSceneResults);
      if (!options_.lcm_url.empty()) {
        announcer_ = OpenLcm({.url = options_.lcm_url});
        session_ = SessionMessage(scene_, loop_->plant(), controller_, bus_, options_.real_time,
                                  std::filesystem::absolute(out_).lexically_normal().string());
      }
    } catch (...) {
      if (record_) std::filesystem::remove(PartialRecord());
      throw;
    }
  }

  const SceneOptions& scene_options_;
  const ControlRunOptions& options_;
  int shape_every_;
  scene::Scene scene_;
  std::filesystem::path out_;
  std::optional<ResultFolder> folder_;
  std::string controller_;
  std::string bus_;
  std::optional<firmware_sim::CandumpWriter> record_;
  std::unique_ptr<loop::ClosedLoop> loop_;
  std::unique_ptr<LcmLink> lcm_;
  std::optional<ShapeMessages> shapes_;
  std::optional<WaterMessages> waters_;
  /// Who speaks; apart from lcm_, whose log is the same on every machine.
  std::unique_ptr<LcmLink> announcer_;
  SessionTelemetry session_;
  std::optional<OutputFile> trajectory_, solver_;
  std::optional<Progress> progress_;
  VolumeRange volume_;
  double next_sample_s_{0}, next_session_s_{0};
  std::int64_t samples_{0};
  long iterations_{0};

  void OpenLoop() {
    loop::ClosedLoopOptions o;
    o.real_time = options_.real_time;
    o.controller = controller_;
    o.bus = bus_;
    try {
      if (!options_.record.empty()) {
        record_.emplace(PartialRecord(), bus_.starts_with("can:") ? bus_.substr(4) : "vcan0");
        o.record = &*record_;
      }
    } catch (const std::invalid_argument& error) {
      throw BadInput(error.what());
    } catch (const std::system_error& error) {
      throw BadInput(error.what());
    }
    loop_ = BuildLoop(scene_options_, scene_, o);
  }

  // An old record stays until the new one is whole.
  std::string PartialRecord() const { return options_.record + ".partial"; }

  void CheckRecord() const {
    if (record_ && !record_->good()) {
      throw CannotGoOn(
          fmt::format("--record: {}: cannot be written; is the disk full?", PartialRecord()));
    }
  }

  void FinishRecord(bool complete) {
    if (!record_) return;
    record_->Flush();
    CheckRecord();
    std::error_code error;
    if (complete) std::filesystem::rename(PartialRecord(), options_.record, error);
    if (error) {
      throw CannotGoOn(fmt::format("--record: {}: cannot be put in place: {}; it is in {}",
                                   options_.record, error.message(), PartialRecord()));
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
    if (loop_->control_side().options().estimator.current) {
      vector("estimated_current_",
             step == nullptr ? model::Vector3::Zero().eval() : step->disturbance.current_m_s,
             "m_s");
    }
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
      OnSample(step, at_end);
    }
    if (step.planned && step.plan != nullptr) OnPlan(step);
    if (announcer_ && step.time_s >= next_session_s_) Announce(step.time_s);
    CheckRecord();
    return !Interrupted();
  }

  void Announce(double time_s) {
    session_.utime = TelemetryTime(time_s);
    announcer_->Write(session_);
    next_session_s_ = time_s + kSession_s;
  }

  void OnSample(const loop::LoopStep& step, bool at_end) {
    const std::optional<loop::PlantView> plant = step.look();
    if (!plant) return;
    const model::Sample& sample = plant->sample;
    trajectory_->Write(Row(sample, step));
    if (loop_->plant().shell) volume_.Add(sample.volume_m3);
    lcm_->Write(StateMessage(loop_->plant(), sample));
    lcm_->Write(ReducedStateMessage(step.truth));
    lcm_->Write(DrivesMessage(scene_.reduction.actuators,
                              loop_->control_side().motors().winch_map(), step));
    lcm_->Write(EnergyMessage(sample, plant->energy));
    lcm_->Write(StatusMessage(controller_, step, iterations_, scene_.drives.period_s));
    lcm_->Write(ControlMessage(scene_.reduction.actuators, step, loop_->reference()));
    if (shapes_ && (at_end || samples_ % shape_every_ == 0)) {
      lcm_->Write(shapes_->Of(plant->state, sample.cable_tension_n));
      if (waters_->active()) lcm_->Write(waters_->Of(plant->state));
    }
    ++samples_;
  }

  void OnPlan(const loop::LoopStep& step) {
    const controller::MpcStatus& s = *step.solver;
    iterations_ += s.iterations;
    lcm_->Write(PlanMessage(loop_->reduced(), step, options_.real_time));
    if (!solver_) return;
    solver_->Write(fmt::format("{},{:.4f},{:.4f},{},{},\"{}\"\n", step.time_s, 1e3 * s.prepare_s,
                               1e3 * s.solve_s, s.iterations, s.cost, ToString(s.outcome)));
  }

  int Conclude(const loop::LoopResult& result, bool locked) {
    const bool whole = result.ok && result.time_s >= scene_.run.duration_s - kSameTime_s;
    const bool complete = whole && result.ended.empty();
    const std::string reason = complete     ? ""
                               : !result.ok ? result.reason
                               : whole      ? result.ended
                                            : "interrupted";
    Json summary =
        RunSummary({&scene_, &loop_->plant(), &result.plant, volume_, scene_options_.overrides,
                    result.wall_s, result.time_s, complete, reason});
    summary["reduced"] = ReductionSummary(scene_, loop_->reduced());
    summary["control"] = ControlSummary(
        {&scene_, loop_.get(), &result, controller_, bus_, options_.real_time, locked});
    trajectory_->Close();
    if (solver_) solver_->Close();
    lcm_->FinishLog();
    WriteWhole(folder_->partial(), "summary.json", Dump(summary));
    FinishRecord(complete);
    if (complete) {
      folder_->Publish();
    } else {
      Complain("{}: {} at t = {:.6g} s; partial results in {}", scene_.name, reason, result.time_s,
               folder_->partial().string());
    }
    PrintResults(summary, complete, whole);
    ReportBeside(scene_options_.report, complete ? folder_->folder() : folder_->partial(),
                 scene_options_.json || !complete);
    ComplainOfWarnings(scene_.name, result.plant.warnings);
    if (complete && lcm_->counters().publish_failures > 0) {
      Complain("--lcm: {}: {} messages were not taken by the network", options_.lcm_url,
               lcm_->counters().publish_failures);
    }
    return complete ? 0 : kExitCannotContinue;
  }

  void PrintResults(const Json& summary, bool complete, bool whole) const {
    if (scene_options_.json) {
      PrintText(Dump(summary), complete ? 0 : kExitCannotContinue);
    } else if (whole) {
      Print("{}  results in {}\n", ControlTable(summary),
            (complete ? folder_->folder() : folder_->partial()).string());
    }
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

int RunControlScene(const SceneOptions& scene, const ControlRunOptions& options, int shape_every) {
  return ControlJob(scene, options, shape_every).Execute();
}

}  // namespace mantle::tools
