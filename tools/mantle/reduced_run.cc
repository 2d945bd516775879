#include "tools/mantle/reduced_run.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <optional>

#include "reduced/build/reduced_plant.h"
#include "tools/mantle/build_run.h"
#include "tools/mantle/interrupt.h"
#include "tools/mantle/output_folder.h"
#include "tools/mantle/progress.h"
#include "tools/mantle/run_log.h"
#include "tools/mantle/standard_output.h"
#include "tools/mantle/trajectory.h"
#include "tools/report/page_file.h"

namespace mantle::tools {
namespace {

using model::Sample;

constexpr double kSameTime_s = 1e-9;
// Peaks below these are round-off of a robot at rest; an error relative to them says nothing.
constexpr double kNegligibleEnergy_j = 1e-18, kNegligibleSpeed_m_s = 1e-9;

struct Extremes {
  double max{0}, last{0};
  void Add(double x) {
    max = std::max(max, x);
    last = x;
  }
};

// Of what the command line sets, the keys by which the plant steps; a reduced run has its own.
std::vector<std::string> OverridesOfThePlant(const std::vector<std::string>& overrides) {
  constexpr std::array<std::string_view, 7> kPlants = {
      "time.integrator",         "time.step",
      "time.tolerance",          "time.newton_tolerance",
      "time.relative_tolerance", "time.absolute_tolerance",
      "time.newton_iterations"};
  std::vector<std::string> warnings;
  for (const std::string& set : overrides) {
    const std::string_view key = std::string_view(set).substr(0, set.find('='));
    if (std::find(kPlants.begin(), kPlants.end(), key) == kPlants.end()) continue;
    warnings.push_back(
        fmt::format("--set {}: acts in the plant only; a reduced run steps by reduced.integrator, "
                    "reduced.step and reduced.tolerance",
                    key));
  }
  return warnings;
}

// Angle between two directions e3.
double HeadingDifference(const model::Pose& a, const model::Pose& b) {
  const model::Vector3 e3 = model::Vector3::UnitZ();
  const model::Vector3 x = a.rotation * e3, y = b.rotation * e3;
  return std::atan2(x.cross(y).norm(), x.dot(y));
}

}  // namespace

std::unique_ptr<reduced::ReducedPlant> BuildReduced(const SceneOptions& options,
                                                    const scene::Scene& scene) {
  return InScene(options, [&] {
    return std::make_unique<reduced::ReducedPlant>(scene.robot, scene.reduction);
  });
}

reduced::ReducedSimulation BuildSimulation(const SceneOptions& options, const scene::Scene& scene,
                                           const reduced::ReducedPlant& model) {
  return InScene(options, [&] {
    return reduced::ReducedSimulation(model, reduced::RunSettingsOf(scene.run, scene.reduction));
  });
}

Json ReductionSummary(const scene::Scene& scene, const reduced::ReducedPlant& model) {
  Json j;
  j["coordinates"] = model.coordinate_count();
  j["states"] = 2 * model.velocity_count();
  j["inputs"] = Json::array();
  for (const auto& actuator : model.actuators) j["inputs"].push_back(actuator.name);
  j["arms"] = Json::object();
  for (std::size_t a = 0; a < model.arms.size(); ++a) {
    j["arms"][model.plant.rods[a].name] = {{"coordinates", model.arms[a].size()},
                                           {"groups", model.arms[a].basis.groups().size()},
                                           {"sections", model.arms[a].sections.size()}};
  }
  if (model.mantle) {
    j["mantle"] = {{"coordinates", model.mantle->size},
                   {"elements_evaluated", model.mantle->elements.size()},
                   {"cubature_residual", model.mantle->cubature_residual}};
  }
  j["step_s"] = scene.reduction.step_s;
  j["integrator"] =
      scene.reduction.scheme == reduced::StepScheme::kSdirk2 ? "sdirk2" : "backward_euler";
  return j;
}

int RunReducedScene(const SceneOptions& options, int shape_every) {
  const scene::Scene scene = options.Load();
  DemandTime(options, scene, "mantle run");
  const auto model = BuildReduced(options, scene);
  reduced::ReducedSimulation simulation = BuildSimulation(options, scene, *model);
  std::optional<RunLog> log;
  if (shape_every > 0) log.emplace(model->plant, shape_every);
  CatchInterrupts();
  ResultFolder folder(options.OutputFolder(scene), kSceneResults);
  if (log) log->Start(folder.partial());
  OutputFile trajectory(folder.partial(), "trajectory.csv", TrajectoryTitles(model->plant));
  VolumeRange volume;
  Progress progress(0.0, scene.run.duration_s, "s", true);
  const auto begin = std::chrono::steady_clock::now();
  model::RunResult result = simulation.Run([&](const Sample& sample) {
    progress.Update(sample.time_s);
    trajectory.Write(TrajectoryRow(model->plant, sample));
    if (log) {
      const bool at_end = sample.time_s >= scene.run.duration_s - kSameTime_s;
      log->Add(sample, simulation.lifted(), nullptr, at_end);
    }
    if (model->plant.shell) volume.Add(sample.volume_m3);
    return !Interrupted();
  });
  for (std::string& w : OverridesOfThePlant(options.overrides)) {
    result.warnings.push_back(std::move(w));
  }
  const double wall_s =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  progress.Finish();
  const bool complete = result.ok && result.sim_time_s >= scene.run.duration_s - kSameTime_s;
  const std::string reason = result.ok && !complete ? "interrupted" : result.reason;
  Json summary = RunSummary({&scene, &model->plant, &result, volume, options.overrides, wall_s,
                             result.sim_time_s, complete, reason});
  summary["model"] = "reduced";
  summary["reduced"] = ReductionSummary(scene, *model);
  for (const char* key :
       {"power_balance_residual", "power_balance_scale_w", "energy_drift", "energy_drift_scale_j",
        "work_j", "dissipated_j", "energetic_index", "factorisations", "evaluations"}) {
    if (summary.contains(key)) summary[key] = nullptr;
  }
  trajectory.Close();
  if (log) log->Close();
  WriteWhole(folder.partial(), "summary.json", Dump(summary));
  if (complete) {
    folder.Publish();
  } else {
    Complain("{}: {} at t = {:.6g} s; partial results in {}", scene.name, reason, result.sim_time_s,
             folder.partial().string());
  }
  if (options.json) {
    PrintText(Dump(summary), complete ? 0 : kExitCannotContinue);
  } else if (complete) {
    Print(
        "{} (reduced, {} states): {:.6g} s simulated in {:.3g} s ({:.0f}x real time), {} "
        "steps, {} rejected; results in {}\n",
        scene.name, 2 * model->velocity_count(), result.sim_time_s, wall_s,
        result.sim_time_s / wall_s, result.counters.steps, result.counters.rejected,
        folder.folder().string());
  }
  ReportBeside(options.report, complete ? folder.folder() : folder.partial(),
               options.json || !complete);
  ComplainOfWarnings(scene.name, result.warnings);
  return complete ? 0 : kExitCannotContinue;
}

Json ReducedErrors(const model::Plant& plant, const std::vector<Sample>& full,
                   const std::vector<Sample>& reduced) {
  Extremes root, heading, tip, centre, volume, energy, speed;
  double change = 0, peak = 0, fastest = 0;
  for (const Sample& s : full) {
    change = std::max(change, std::abs(s.volume_m3 - full.front().volume_m3));
    peak = std::max(peak, s.energies.total());
    fastest = std::max(fastest, s.root_twist.tail<3>().norm());
  }
  const double length = plant.body_length_m;
  for (std::size_t i = 0; i < std::min(full.size(), reduced.size()); ++i) {
    const Sample &f = full[i], &r = reduced[i];
    root.Add((f.root.position - r.root.position).norm() / length);
    centre.Add((f.centre_of_mass_m - r.centre_of_mass_m).norm() / length);
    heading.Add(HeadingDifference(f.root, r.root));
    double worst = 0;
    for (std::size_t a = 0; a < f.tips.size(); ++a) {
      worst = std::max(worst, (f.tips[a].position - r.tips[a].position).norm());
    }
    tip.Add(worst / length);
    if (change > 0) volume.Add(std::abs(f.volume_m3 - r.volume_m3) / change);
    if (peak > kNegligibleEnergy_j)
      energy.Add(std::abs(f.energies.total() - r.energies.total()) / peak);
    if (fastest > kNegligibleSpeed_m_s) {
      speed.Add(
          (f.root.rotation * f.root_twist.tail<3>() - r.root.rotation * r.root_twist.tail<3>())
              .norm() /
          fastest);
    }
  }
  Json j;
  const auto add = [&](const char* name, const Extremes& e) {
    j[std::string("reduced_error_") + name] = e.max;
    j[std::string("reduced_error_") + name + "_final"] = e.last;
  };
  add("root", root);
  add("centre_of_mass", centre);
  add("heading_rad", heading);
  add("speed", speed);
  add("energy", energy);
  j["relative_to"] = {{"length_m", length}, {"speed_m_s", fastest}, {"energy_j", peak}};
  if (plant.shell) j["relative_to"]["volume_m3"] = change;
  if (!plant.rods.empty()) add("tip", tip);
  if (plant.shell) add("volume", volume);
  return j;
}

}  // namespace mantle::tools
