#include "tools/studies/stability_study.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <map>
#include <set>

#include "loop/scene/scene.h"
#include "tools/mantle/bad_input.h"

namespace mantle::tools {
namespace {

namespace fs = std::filesystem;

// Samples: every run lands on them, so that they are no closer than the longest step.
constexpr double kSample_s = 0.05;
constexpr double kReferenceStep_s = 5e-5;

std::vector<std::string> Common(const std::vector<std::string>& overrides) {
  std::vector<std::string> sets = overrides;
  sets.push_back(fmt::format("output.interval={}", kSample_s));
  sets.push_back("output.energy=true");
  sets.push_back("time.tolerance=0");
  return sets;
}

std::string StemOf(const std::string& scene) { return fs::path(scene).stem().string(); }

StudyPoint Reference(const std::string& scene, const std::vector<std::string>& overrides) {
  StudyPoint p;
  p.kind = "reference";
  p.family = "reference";
  p.name = StemOf(scene);
  p.scene = scene;
  p.overrides = Common(overrides);
  for (const std::string& set :
       {std::string("time.integrator=\"sdirk3\""), fmt::format("time.step={}", kReferenceStep_s)}) {
    p.overrides.push_back(set);
  }
  // Where short steps of the third order do not get through.
  p.options["instead"] = {"time.integrator=\"cvode\"", "time.relative_tolerance=1e-8",
                          "time.absolute_tolerance=1e-10"};
  return p;
}

double Share(int part, int whole) { return whole > 0 ? static_cast<double>(part) / whole : 0.0; }

}  // namespace

std::vector<double> StabilitySteps(bool small) {
  if (small) return {1e-3, 1e-2, 5e-2};
  return {1e-4, 5e-4, 1e-3, 2e-3, 5e-3, 1e-2, 2e-2, 5e-2};
}

std::vector<std::string> HardScenes(const std::string& scene_or_folder) {
  const fs::path path = fs::absolute(scene_or_folder).lexically_normal();
  std::vector<std::string> scenes;
  if (fs::is_directory(path)) {
    for (const auto& entry : fs::directory_iterator(path)) {
      if (entry.path().extension() == ".toml") scenes.push_back(entry.path().string());
    }
    std::sort(scenes.begin(), scenes.end());
  } else if (fs::is_regular_file(path)) {
    scenes.push_back(path.string());
  }
  if (scenes.empty()) {
    throw BadInput(
        fmt::format("{}: no scene: must be a scene file or a folder of them", scene_or_folder));
  }
  for (const std::string& scene : scenes) {
    if (!scene::LoadScene(scene).has_time) {
      throw BadInput(
          fmt::format("{}: time: table is missing: `mantle study stability` needs [time]", scene));
    }
  }
  return scenes;
}

std::vector<StudyPoint> StabilityReferences(const std::vector<std::string>& scenes,
                                            const std::vector<std::string>& overrides) {
  std::vector<StudyPoint> points;
  for (const std::string& scene : scenes) points.push_back(Reference(scene, overrides));
  return points;
}

std::vector<StudyPoint> StabilityPoints(const std::vector<std::string>& scenes,
                                        const std::vector<std::string>& overrides,
                                        const std::vector<double>& steps) {
  std::vector<StudyPoint> points;
  for (const std::string& scene : scenes) {
    for (const std::string integrator : kStabilityIntegrators) {
      StudyPoint p;
      p.kind = "stability";
      p.family = StemOf(scene);
      p.name = StemOf(scene) + ", " + integrator;
      p.scene = scene;
      p.overrides = Common(overrides);
      p.overrides.push_back("time.integrator=\"" + integrator + "\"");
      p.options = {{"steps", steps}, {"reference", ToJson(Reference(scene, overrides))}};
      p.shown = {{"case", StemOf(scene)}, {"integrator", integrator}};
      points.push_back(std::move(p));
    }
  }
  return points;
}

Json StabilityReport(const std::vector<std::string>& overrides, const std::vector<Json>& references,
                     const std::vector<Json>& rows) {
  std::set<std::string> cases, reached, default_reaches;
  std::map<std::string, std::map<std::string, int>> verdicts;
  int refusals = 0, runs = 0;
  Json violations = Json::array();
  for (const Json& row : rows) {
    const std::string name = row["case"], integrator = row["integrator"];
    cases.insert(name);
    if (row.value("reached", false)) reached.insert(name);
    if (!row["ok"].get<bool>()) {
      violations.push_back({{"case", name}, {"integrator", integrator}, {"reason", row["reason"]}});
    }
    for (const Json& run : row.value("runs", Json::array())) {
      const std::string verdict = run["verdict"];
      ++verdicts[integrator][verdict];
      ++runs;
      refusals += verdict == "refused";
      if (integrator == "sdirk2" && run["step_s"] == kDefaultStep_s && verdict == "holds" &&
          run["error"].is_number() && run["error"].get<double>() <= kAsReference) {
        default_reaches.insert(name);
      }
    }
  }
  Json unreached = Json::array(), not_by_default = Json::array();
  for (const std::string& name : cases) {
    if (!reached.contains(name)) unreached.push_back(name);
    if (!default_reaches.contains(name)) not_by_default.push_back(name);
  }
  Json integrators = Json::array();
  for (const std::string integrator : kStabilityIntegrators) {
    Json j = {{"integrator", integrator}};
    for (const char* verdict : {"holds", "told", "refused", "slow", "violates"})
      j[verdict] = verdicts[integrator][verdict];
    integrators.push_back(std::move(j));
  }
  const int count = static_cast<int>(cases.size());
  return {{"study", "stability"},
          {"set", overrides},
          {"cases", count},
          {"runs", runs},
          {"bounds",
           {{"energy_without_work", kEnergyWithoutWork},
            {"momentum_change", kMomentumChange},
            {"furthest_body_lengths", kFurthest},
            {"as_reference_body_lengths", kAsReference}}},
          {"integrators", integrators},
          {"violations", violations},
          {"not_reached", unreached},
          {"default_share", Share(static_cast<int>(default_reaches.size()), count)},
          {"not_by_default", not_by_default},
          {"refused_share", Share(refusals, runs)},
          {"versions", StudyVersions()},
          {"references", references},
          {"points", rows}};
}

std::vector<Json> StabilityRuns(const std::vector<Json>& rows) {
  std::vector<Json> flat;
  for (const Json& row : rows) {
    if (!row.contains("runs")) {
      flat.push_back(row);
      continue;
    }
    for (const Json& run : row["runs"]) {
      Json line = {{"case", row["case"]}, {"integrator", row["integrator"]}};
      line.update(run);
      line["hard"] = row["hard"];
      line["overrides"] = row["overrides"];
      flat.push_back(std::move(line));
    }
  }
  return flat;
}

}  // namespace mantle::tools
