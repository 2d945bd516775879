#include "tools/studies/accuracy_point.h"

#include <fmt/format.h>

#include <memory>
#include <optional>
#include <variant>

#include "reduced/build/reduced_plant.h"
#include "reduced/build/simulation.h"
#include "tools/mantle/bad_input.h"
#include "tools/mantle/output_file.h"
#include "tools/studies/study_kinds.h"

namespace mantle::tools {
namespace {

namespace fs = std::filesystem;

// A run is made again while all runs of it have taken less than this, and at most so often: the
// clock of CPU time may tick in milliseconds.
constexpr double kRepeatWithin_s = 0.3;
constexpr int kMostRepeats = 20;

template <typename Simulation>
void Follow(Simulation* simulation, MeasuredRun* out) {
  const double begin = CpuSeconds();
  const model::RunResult result = simulation->Run([&](const model::Sample& sample) {
    AddFrame(sample, &out->path);
    return true;
  });
  out->cpu_s = CpuSeconds() - begin;
  out->ok = result.ok;
  out->reason = result.reason;
  out->sim_time_s = result.sim_time_s;
  out->counters = result.counters;
}

Json Pair(const ErrorPair& e) { return {{"largest", e.largest}, {"final", e.final}}; }

// A reference that a point names in its options; read from the cache.
std::optional<StudyPath> Reference(const StudyPoint& point, const char* name) {
  if (!point.options.contains(name)) return {};
  const StudyPoint reference = PointFromJson(point.options[name]);
  const fs::path file = ReferenceFile(reference);
  if (!fs::exists(file)) {
    throw BadInput(fmt::format("the reference \"{}\" came to nothing", reference.name));
  }
  return ReadStudyPath(file);
}

}  // namespace

MeasuredRun RunMeasured(const scene::Scene& scene, bool reduced) {
  MeasuredRun out;
  out.path.held = !std::holds_alternative<model::FreeRoot>(scene.robot.root);
  if (reduced) {
    const reduced::ReducedPlant model(scene.robot, scene.reduction);
    out.path.body_length_m = model.plant.body_length_m;
    out.unknowns = model.velocity_count();
    reduced::ReducedSimulation simulation(model,
                                          reduced::RunSettingsOf(scene.run, scene.reduction));
    Follow(&simulation, &out);
  } else {
    const model::Plant plant(scene.robot);
    out.path.body_length_m = plant.body_length_m;
    out.unknowns = plant.velocity_size();
    model::Simulation simulation(plant, scene.run);
    Follow(&simulation, &out);
  }
  return out;
}

fs::path ReferenceFile(const StudyPoint& reference) {
  return CacheFolder() / "references" / (reference.Key() + ".path");
}

Json ErrorsJson(const PathErrors& e, const StudyPath& reference) {
  Json j = {{"root", Pair(e.root)}};
  if (!reference.frames.front().tips_m.empty()) j["tip"] = Pair(e.tip);
  j["heading_rad"] = Pair(e.heading_rad);
  if (reference.frames.front().volume_m3 != 0) j["volume"] = Pair(e.volume);
  j["energy"] = Pair(e.energy);
  return j;
}

Json RunReferencePoint(const StudyPoint& point) {
  Json row = RowOf(point);
  const fs::path file = ReferenceFile(point);
  row["file"] = file.string();
  row["cached"] = fs::exists(file);
  if (row["cached"]) return row;
  const bool reduced = point.options.value("model", "full") == "reduced";
  MeasuredRun run = RunMeasured(scene::LoadScene(point.scene, point.overrides), reduced);
  if (!run.ok && point.options.contains("instead")) {
    row["instead_because"] = run.reason;
    std::vector<std::string> sets = point.overrides;
    for (const Json& set : point.options["instead"]) sets.push_back(set.get<std::string>());
    run = RunMeasured(scene::LoadScene(point.scene, sets), reduced);
  }
  if (!run.ok) return FailedRow(point, run.reason);
  row["cpu_s"] = run.cpu_s;
  row["steps"] = run.counters.steps;
  fs::create_directories(file.parent_path());
  WriteWhole(file.parent_path(), file.filename().string(), StudyPathText(run.path));
  return row;
}

Json RunAccuracyPoint(const StudyPoint& point) {
  const scene::Scene scene = scene::LoadScene(point.scene, point.overrides);
  const bool reduced = point.options.value("model", "full") == "reduced";
  MeasuredRun run = RunMeasured(scene, reduced);
  Json row = RowOf(point);
  row["cpu_s"] = run.cpu_s;
  row["steps"] = run.counters.steps;
  row["rejected_steps"] = run.counters.rejected;
  row["newton_iterations"] = run.counters.newton_iterations;
  row["unknowns"] = run.unknowns;
  if (!run.ok) {
    row["ok"] = false;
    row["reason"] = fmt::format("t = {:.6g} s of {:.6g} s: {}", run.sim_time_s,
                                scene.run.duration_s, run.reason);
    return row;
  }
  double spent = run.cpu_s;
  int runs = 1;
  for (; spent < kRepeatWithin_s && runs < kMostRepeats; ++runs) {
    spent += RunMeasured(scene, reduced).cpu_s;
  }
  row["cpu_s"] = spent / runs;
  row["runs"] = runs;
  row["times_real_time"] = run.sim_time_s * runs / spent;
  // Of its own kind: what this family varies alone. In all: everything that is discretised.
  for (const auto& [name, headline, all] :
       {std::tuple{"reference", "error", "errors"}, {"finest", "error_in_all", "errors_in_all"}}) {
    const auto reference = Reference(point, name);
    if (!reference) continue;
    const PathErrors errors = ComparePaths(run.path, *reference);
    row[headline] = Headline(errors, *reference);
    row[all] = ErrorsJson(errors, *reference);
    row["compared"] = errors.frames;
  }
  return row;
}

}  // namespace mantle::tools
