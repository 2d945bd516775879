#include "tools/studies/accuracy_study.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <set>

#include "loop/scene/regular_file.h"
#include "tools/studies/accuracy_point.h"

namespace mantle::tools {
namespace {

constexpr double kCvodeTolerance = 1e-11;
constexpr int kFinerMesh = 4;
// Every run lands on every sample, so that the largest errors are over the same instants: steps are
// at most half their interval.
constexpr double kSamples = 60;
constexpr const char* kReferenceIntegrator = "sdirk3";

struct Mesh {
  double arms{1}, mantle{1};  ///< factors on the scene's elements
};

std::vector<std::string> MeshOverrides(const AccuracyScene& s, const Mesh& mesh) {
  return tools::MeshOverrides(s.scene, mesh.arms, mesh.mantle);
}

StudyPoint Base(const AccuracyScene& s, const std::string& kind, const std::string& family,
                const std::string& name) {
  StudyPoint p;
  p.kind = kind;
  p.family = family;
  p.name = name;
  p.scene = s.file;
  p.overrides = s.overrides;
  p.overrides.push_back(fmt::format("output.interval={:.9g}", s.sample_s));
  return p;
}

void Add(const std::vector<std::string>& sets, StudyPoint* p) {
  p->overrides.insert(p->overrides.end(), sets.begin(), sets.end());
}

// What a reader sees of the settings.
void Show(const AccuracyScene& s, const Mesh& mesh, StudyPoint* p) {
  if (!s.scene.robot.arms.empty()) {
    int elements = 0;
    for (const auto& arm : s.scene.robot.arms) {
      elements = std::max(elements, Scaled(arm.elements, mesh.arms));
    }
    p->shown["arm_elements"] = elements;
  }
  if (s.scene.robot.mantle) {
    p->shown["mantle_elements"] = Scaled(s.scene.robot.mantle->elements, mesh.mantle);
  }
}

StudyPoint CvodeReference(const AccuracyScene& s) {
  StudyPoint p = Base(s, "reference", "reference", "cvode on the scene's mesh");
  Add({"time.integrator=\"cvode\"", fmt::format("time.step={:.9g}", s.sample_s), "time.tolerance=0",
       fmt::format("time.relative_tolerance={}", kCvodeTolerance),
       fmt::format("time.absolute_tolerance={}", 0.01 * kCvodeTolerance)},
      &p);
  return p;
}

double MeshStep(const AccuracyScene& s) { return s.sample_s / 32; }

StudyPoint MeshReference(const AccuracyScene& s, const Mesh& mesh, const std::string& name) {
  StudyPoint p = Base(s, "reference", "reference", name);
  Add(MeshOverrides(s, mesh), &p);
  Add(TimeOverrides(kReferenceIntegrator, MeshStep(s)), &p);
  return p;
}

StudyPoint ArmsReference(const AccuracyScene& s) {
  return MeshReference(s, {kFinerMesh, 1}, "arms of four times the elements");
}
StudyPoint MantleReference(const AccuracyScene& s) {
  return MeshReference(s, {1, kFinerMesh}, "mantle of four times the elements");
}
StudyPoint Finest(const AccuracyScene& s) {
  StudyPoint p = Base(s, "reference", "reference", "finest plant");
  Add(MeshOverrides(s, {kFinerMesh, kFinerMesh}), &p);
  Add(TimeOverrides(kReferenceIntegrator, s.sample_s / 64), &p);
  return p;
}

StudyPoint TimePoint(const AccuracyScene& s, const std::string& integrator, double step_s) {
  StudyPoint p =
      Base(s, "accuracy", "time", fmt::format("{} at {:.4g} ms", integrator, 1e3 * step_s));
  Add(TimeOverrides(integrator, step_s), &p);
  p.options = {{"reference", ToJson(CvodeReference(s))}, {"finest", ToJson(Finest(s))}};
  p.shown = {{"integrator", integrator}, {"step_s", step_s}};
  Show(s, {}, &p);
  return p;
}

StudyPoint TolerancePoint(const AccuracyScene& s, const std::string& integrator, double tolerance) {
  StudyPoint p =
      Base(s, "accuracy", "tolerance", fmt::format("{} tolerance {:g}", integrator, tolerance));
  Add({"time.integrator=\"" + integrator + "\"", fmt::format("time.step={:.9g}", s.sample_s / 2),
       fmt::format("time.tolerance={}", tolerance)},
      &p);
  p.options = {{"reference", ToJson(CvodeReference(s))}, {"finest", ToJson(Finest(s))}};
  p.shown = {{"integrator", integrator}, {"tolerance", tolerance}};
  Show(s, {}, &p);
  return p;
}

StudyPoint MeshPoint(const AccuracyScene& s, const std::string& family, const Mesh& mesh) {
  StudyPoint p = Base(s, "accuracy", family, "");
  Show(s, mesh, &p);
  p.name = fmt::format("{} of {} elements", family,
                       p.shown[family == "arms" ? "arm_elements" : "mantle_elements"].dump());
  Add(MeshOverrides(s, mesh), &p);
  Add(TimeOverrides(kReferenceIntegrator, MeshStep(s)), &p);
  p.options = {{"reference", ToJson(family == "arms" ? ArmsReference(s) : MantleReference(s))},
               {"finest", ToJson(Finest(s))}};
  p.shown["integrator"] = kReferenceIntegrator;
  p.shown["step_s"] = MeshStep(s);
  return p;
}

void AddReduced(const AccuracyScene& s, std::vector<StudyPoint>* points) {
  const double step_s = s.scene.reduction.step_s;
  const auto add = [&](const std::string& name, const std::vector<std::string>& sets) {
    StudyPoint p = Base(s, "accuracy", "reduced", "reduced: " + name);
    Add(sets, &p);
    p.options = {
        {"model", "reduced"}, {"reference", ToJson(Finest(s))}, {"finest", ToJson(Finest(s))}};
    p.shown = {{"model", "reduced"}, {"reduced", name}};
    points->push_back(std::move(p));
  };
  const bool small = s.size == StudySize::kSmall;
  add("as the scene has it", {});
  if (!s.scene.robot.arms.empty()) {
    for (int n : small ? std::vector{1, 3} : std::vector{1, 2, 3, 4, 6, 8}) {
      add(fmt::format("{} segment{}", n, n > 1 ? "s" : ""),
          {"reduced.basis=\"constant\"", fmt::format("reduced.segments={}", n)});
    }
    for (int d : small ? std::vector{2} : std::vector{1, 2, 3}) {
      add(fmt::format("Legendre {}", d),
          {"reduced.basis=\"legendre\"", fmt::format("reduced.degree={}", d)});
    }
    if (!small) {
      add("six strains", {"reduced.strains=\"six\""});
      add("one section a segment", {"reduced.points=1"});
      add("two sections a segment", {"reduced.points=2"});
    }
  }
  if (s.scene.robot.mantle) {
    add("mantle: mode, static 325 Pa",
        {"reduced.modes=1", "reduced.static_pressures=[325]", "reduced.snapshots=0"});
    if (!small) {
      add("mantle: mode, static 160, 325 Pa",
          {"reduced.modes=1", "reduced.static_pressures=[160, 325]", "reduced.snapshots=0"});
      add("mantle: mode, static 160, 325 Pa, 3 snapshots",
          {"reduced.modes=1", "reduced.static_pressures=[160, 325]", "reduced.snapshots=3"});
      add("mantle: all elements evaluated", {"reduced.cubature=0"});
      add("mantle: cubature 0.02", {"reduced.cubature=0.02"});
    }
  }
  for (double factor : small ? std::vector{2.0} : std::vector{4.0, 2.0, 0.5, 0.2}) {
    add(fmt::format("steps of {:.4g} ms", 1e3 * factor * step_s),
        {fmt::format("reduced.step={:.9g}", factor * step_s)});
  }
  if (!small) add("backward Euler", {"reduced.integrator=\"backward_euler\""});
}

// Step that divides the samples' interval, at most `step_s`.
double EvenStep(double step_s, double sample_s) {
  return sample_s / std::ceil(sample_s / step_s - 1e-9);
}

}  // namespace

int Scaled(int elements, double factor) {
  return std::max(1, static_cast<int>(std::lround(elements * factor)));
}

std::vector<std::string> MeshOverrides(const scene::Scene& scene, double arms, double mantle) {
  std::vector<std::string> sets;
  for (std::size_t a = 0; a < scene.robot.arms.size() && arms != 1; ++a) {
    sets.push_back(
        fmt::format("arms[{}].elements={}", a, Scaled(scene.robot.arms[a].elements, arms)));
  }
  if (scene.robot.mantle && mantle != 1) {
    sets.push_back(fmt::format("mantle.elements={}", Scaled(scene.robot.mantle->elements, mantle)));
  }
  return sets;
}

std::vector<std::string> TimeOverrides(const std::string& integrator, double step_s) {
  return {"time.integrator=\"" + integrator + "\"", fmt::format("time.step={:.9g}", step_s),
          "time.tolerance=0"};
}

std::filesystem::path StudyFile(const scene::Scene& scene) {
  const std::uint64_t hash = scene::Hash(ProgramHash(), scene.fingerprint);
  return CacheFolder() / "studies" / fmt::format("{:016x}.json", hash);
}

AccuracyScene PrepareAccuracy(const std::string& file, const std::vector<std::string>& overrides,
                              StudySize size) {
  AccuracyScene s;
  s.file = std::filesystem::absolute(file).lexically_normal().string();
  s.overrides = overrides;
  s.scene = scene::LoadScene(file, overrides);
  s.size = size;
  if (!s.scene.has_time) {
    throw scene::BadScene(fmt::format(
        "{}: time: table is missing: `mantle study accuracy` needs [time] with `duration` > 0 s",
        file));
  }
  // Of the output's interval a power of two, for steps that halve it again and again.
  const double duration = s.scene.run.duration_s, interval = s.scene.run.output_interval_s;
  s.sample_s = interval * std::exp2(std::round(std::log2(duration / (kSamples * interval))));
  return s;
}

std::vector<StudyPoint> AccuracyReferences(const AccuracyScene& s) {
  std::vector<StudyPoint> points{Finest(s), CvodeReference(s)};
  if (!s.scene.robot.arms.empty()) points.push_back(ArmsReference(s));
  if (s.scene.robot.mantle) points.push_back(MantleReference(s));
  return points;
}

std::vector<StudyPoint> AccuracyPoints(const AccuracyScene& s) {
  const bool small = s.size == StudySize::kSmall;
  std::vector<StudyPoint> points;
  // Halved steps; of the first order more of them, of the third those between, as its errors leave
  // few steps between what is too coarse and what the reference resolves.
  const auto divisors = [&](const std::string& integrator) -> std::vector<int> {
    if (small) return {2, 4, 8, 16, 32};
    if (integrator == "backward_euler") return {2, 4, 8, 16, 32, 64, 128, 256, 512};
    if (integrator == "sdirk3") return {2, 3, 4, 6, 8, 12, 16, 24, 32, 48, 64, 128};
    return {2, 4, 8, 16, 32, 64, 128};
  };
  for (const char* integrator : {"backward_euler", "sdirk2", "sdirk3"}) {
    for (int divisor : divisors(integrator)) {
      points.push_back(TimePoint(s, integrator, s.sample_s / divisor));
    }
  }
  for (double tolerance :
       small ? std::vector{0.1} : std::vector{1.0, 0.3, 0.1, 0.03, 0.01, 0.003}) {
    points.push_back(TolerancePoint(s, "sdirk2", tolerance));
    if (!small) points.push_back(TolerancePoint(s, "sdirk3", tolerance));
  }
  const auto meshes = [&](const char* family, int elements, auto mesh) {
    std::set<int> counts;
    for (double factor : small ? std::vector{0.25, 0.5, 1.0}
                               : std::vector{0.15, 0.2, 0.25, 0.35, 0.5, 0.7, 1.0, 1.4, 2.0}) {
      if (const int n = Scaled(elements, factor); n >= 2 && counts.insert(n).second) {
        points.push_back(MeshPoint(s, family, mesh(static_cast<double>(n) / elements)));
      }
    }
  };
  if (!s.scene.robot.arms.empty()) {
    meshes("arms", s.scene.robot.arms[0].elements, [](double f) { return Mesh{f, 1}; });
  }
  if (s.scene.robot.mantle) {
    meshes("mantle", s.scene.robot.mantle->elements, [](double f) { return Mesh{1, f}; });
  }
  AddReduced(s, &points);
  return points;
}

std::vector<StudyPoint> ComposedPoints(const AccuracyScene& s, const std::vector<Json>& rows) {
  const auto family = [&](const std::string& name, const std::string& integrator, const char* size,
                          bool inverse) {
    std::vector<ConvergencePoint> points;
    for (const Json& row : rows) {
      if (row["family"] != name || !row["ok"].get<bool>() || !row.contains("error")) continue;
      if (!integrator.empty() && row["integrator"] != integrator) continue;
      const double x = row[size].get<double>();
      points.push_back({inverse ? 1 / x : x, row["error"].get<double>()});
    }
    return points;
  };
  const auto arms = family("arms", "", "arm_elements", true);
  const auto mantle = family("mantle", "", "mantle_elements", true);
  std::vector<StudyPoint> points;
  std::set<std::string> names;
  const std::vector<double> targets = s.size == StudySize::kSmall
                                          ? std::vector{0.03, 0.01}
                                          : std::vector{0.1, 0.03, 0.01, 0.003, 0.001, 0.0003};
  for (double target : targets) {
    for (const double share : {0.5, 0.25}) {
      for (const char* integrator : {"sdirk2", "sdirk3"}) {
        const double step =
            LargestSizeWithin(family("time", integrator, "step_s", false), share * target);
        Mesh mesh;
        bool reached = step > 0;
        const auto choose = [&](const std::vector<ConvergencePoint>& errors, int elements,
                                double* factor) {
          const double size = LargestSizeWithin(errors, share * target);
          reached = reached && size > 0;
          if (size > 0) *factor = std::ceil(1 / size - 1e-9) / elements;
        };
        if (!arms.empty()) choose(arms, s.scene.robot.arms[0].elements, &mesh.arms);
        if (!mantle.empty()) choose(mantle, s.scene.robot.mantle->elements, &mesh.mantle);
        if (!reached) continue;
        const double even = EvenStep(step, s.sample_s);
        StudyPoint p = TimePoint(s, integrator, even);
        p.family = "composed";
        Add(MeshOverrides(s, mesh), &p);
        Show(s, mesh, &p);
        p.options.erase("reference");
        p.name = "composed: " + p.name;
        if (p.shown.contains("arm_elements"))
          p.name += fmt::format(", arms {}", p.shown["arm_elements"].dump());
        if (p.shown.contains("mantle_elements"))
          p.name += fmt::format(", mantle {}", p.shown["mantle_elements"].dump());
        if (names.insert(p.name).second) points.push_back(std::move(p));
      }
    }
  }
  return points;
}

}  // namespace mantle::tools
