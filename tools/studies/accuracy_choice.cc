#include "tools/studies/accuracy_choice.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <optional>

#include "model/inputs.h"
#include "tools/mantle/bad_input.h"
#include "tools/studies/accuracy_point.h"
#include "tools/studies/accuracy_study.h"

namespace mantle::tools {
namespace {

constexpr double kSafety = 1.5;
constexpr double kPilotShare = 0.1;
constexpr double kReferenceMesh = 2;
constexpr double kReferenceCosts = 30;  // times a run with the scene's own settings, pilot included
constexpr double kMeshes[] = {0.35, 0.5, 0.75, 1.0, 1.5};
constexpr int kDivisors[] = {2, 4, 8, 16, 32, 64};
constexpr const char* kIntegrator = "sdirk2";

std::string Percent(double share) { return fmt::format("{:.2g} %", 100 * share); }

std::string SettingsText(const scene::Scene& scene) {
  std::string text;
  const auto add = [&](const std::string& more) { text += (text.empty() ? "" : ", ") + more; };
  for (const auto& arm : scene.robot.arms) {
    if (&arm == &scene.robot.arms.front()) add(fmt::format("{} arm elements", arm.elements));
  }
  if (scene.robot.mantle) add(fmt::format("{} mantle elements", scene.robot.mantle->elements));
  return text;
}

// Overrides of a row that a run of its own takes: not where it is compared.
std::vector<std::string> SettingsOf(const Json& row) {
  std::vector<std::string> sets;
  for (const Json& set : row["overrides"]) {
    const std::string text = set;
    const bool mesh = text.find(".elements=") != std::string::npos;
    if (mesh || text.starts_with("time.integrator=") || text.starts_with("time.step=") ||
        text.starts_with("time.tolerance=")) {
      sets.push_back(text);
    }
  }
  return sets;
}

std::optional<AccuracyChoice> FromStudy(const scene::Scene& scene, double target) {
  std::ifstream in(StudyFile(scene));
  if (!in) return {};
  const Json study = Json::parse(in, nullptr, false);
  if (study.is_discarded() || !study.contains("points")) return {};
  const Json* best = nullptr;
  for (const Json& row : study["points"]) {
    if (!row.value("ok", false) || row.contains("reduced") || !row.contains("error_in_all"))
      continue;
    if (row["error_in_all"].get<double>() > target) continue;
    if (best == nullptr || row["cpu_s"].get<double>() < (*best)["cpu_s"].get<double>()) best = &row;
  }
  if (best == nullptr) return {};
  AccuracyChoice choice;
  choice.overrides = SettingsOf(*best);
  choice.expected = (*best)["error_in_all"];
  choice.text =
      fmt::format("{}; expected error {} of the body length, measured by this scene's study",
                  (*best)["name"].get<std::string>(), Percent(choice.expected));
  return choice;
}

// A pilot's runs, all over the same time and samples.
class Pilot {
 public:
  Pilot(const AccuracyScene& s, double duration_s) : s_(s), duration_s_(duration_s) {}

  MeasuredRun Run(const std::vector<std::string>& settings) const {
    std::vector<std::string> sets = s_.overrides;
    sets.push_back(fmt::format("output.interval={:.9g}", s_.sample_s));
    sets.insert(sets.end(), settings.begin(), settings.end());
    scene::Scene scene = scene::LoadScene(s_.file, sets);
    scene.run.duration_s = duration_s_;
    scene.run.account_energy = false;
    return RunMeasured(scene, false);
  }

  // Error against the reference; infinite where the run does not reach the end. `half` gets that of
  // the first half.
  double Error(const MeasuredRun& run, double* half = nullptr) const {
    if (!run.ok) return INFINITY;
    if (half != nullptr) {
      StudyPath first = run.path;
      std::erase_if(first.frames,
                    [&](const StudyFrame& f) { return f.time_s > 0.5 * duration_s_; });
      *half = first.frames.size() > 1
                  ? Headline(ComparePaths(first, reference.path), reference.path)
                  : 0;
    }
    return Headline(ComparePaths(run.path, reference.path), reference.path);
  }

  MeasuredRun reference;

 private:
  const AccuracyScene& s_;
  double duration_s_;
};

// First instants that say something: a tenth of the run, and the first interval between break
// points three times over, which is a pulse and a half.
double PilotDuration(const scene::Scene& scene) {
  const model::Plant plant(scene.robot);
  const double first = model::NextBreakpoint(plant, 0.0);
  const double duration = scene.run.duration_s;
  const double pulses = std::isfinite(first) && first < duration ? 3 * first : 0;
  return std::min(duration, std::max(kPilotShare * duration, pulses));
}

std::vector<std::string> Joined(std::vector<std::string> a, const std::vector<std::string>& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

}  // namespace

double ParseAccuracy(const std::string& text) {
  const auto refuse = [&] {
    return BadInput(
        fmt::format("--accuracy: \"{}\": must be a share of the body length in (0, 1), such as "
                    "1% or 0.01",
                    text));
  };
  std::size_t end = 0;
  double value = 0;
  try {
    value = std::stod(text, &end);
  } catch (const std::exception&) {
    throw refuse();
  }
  while (end < text.size() && text[end] == ' ') ++end;
  const std::string unit = text.substr(end);
  if (unit == "%") {
    value *= 0.01;
  } else if (!unit.empty()) {
    throw refuse();
  }
  if (!(value > 0 && value < 1)) throw refuse();
  return value;
}

AccuracyChoice ChooseAccuracy(const std::string& file, const std::vector<std::string>& overrides,
                              double target, double budget_s) {
  AccuracyScene s = PrepareAccuracy(file, overrides, StudySize::kDefault);
  if (auto choice = FromStudy(s.scene, target)) return *choice;
  const double duration = s.scene.run.duration_s;
  double pilot_s = PilotDuration(s.scene);
  const auto align = [&](double time_s) {
    // Samples at a whole part of the pilot.
    AccuracyScene part = s;
    part.sample_s = time_s / std::max(8.0, std::round(time_s / s.sample_s));
    return part;
  };
  AccuracyScene part = align(pilot_s);
  const MeasuredRun own = Pilot(part, pilot_s).Run({});
  if (!own.ok) {
    throw BadInput(fmt::format(
        "--accuracy: the scene's own settings do not get through a pilot of {:.3g} s: {}", pilot_s,
        own.reason));
  }
  if (kReferenceCosts * own.cpu_s * duration / pilot_s <= budget_s) pilot_s = duration;
  part = align(pilot_s);
  Pilot pilot(part, pilot_s);
  const double finest_step = part.sample_s / 64;
  pilot.reference = pilot.Run(Joined(MeshOverrides(s.scene, kReferenceMesh, kReferenceMesh),
                                     TimeOverrides("sdirk3", finest_step)));
  if (!pilot.reference.ok) {
    throw BadInput(fmt::format("--accuracy: a pilot's reference with twice the elements stops: {}",
                               pilot.reference.reason));
  }
  std::vector<ConvergencePoint> meshes, steps;
  double reference_error = 0;
  for (double factor : kMeshes) {
    const double error = pilot.Error(pilot.Run(
        Joined(MeshOverrides(s.scene, factor, factor), TimeOverrides("sdirk3", finest_step))));
    meshes.push_back({1 / factor, error});
    if (factor == 1) reference_error = error / 3;
  }
  const MeasuredRun exact = pilot.Run(TimeOverrides("sdirk3", finest_step));
  for (int divisor : kDivisors) {
    const double step = part.sample_s / divisor;
    const MeasuredRun run = pilot.Run(TimeOverrides(kIntegrator, step));
    steps.push_back({step, run.ok && exact.ok
                               ? Headline(ComparePaths(run.path, exact.path), exact.path)
                               : INFINITY});
  }
  double reached = INFINITY;
  for (double share = 0.6; share > 0.02; share *= 0.6) {
    const double coarseness = LargestSizeWithin(meshes, share * target);
    const double longest = LargestSizeWithin(steps, share * target);
    const double factor = coarseness > 0 ? 1 / coarseness : kMeshes[std::size(kMeshes) - 1];
    const double step =
        longest > 0 ? part.sample_s / std::ceil(part.sample_s / longest - 1e-9) : steps.back().size;
    const std::vector<std::string> settings =
        Joined(MeshOverrides(s.scene, factor, factor), TimeOverrides(kIntegrator, step));
    const MeasuredRun run = pilot.Run(settings);
    double half = 0;
    double expected = pilot.Error(run, &half) + reference_error;
    double growth = 0;
    if (pilot_s < duration && half > 0) {
      growth = std::clamp(std::log2(expected / half), 1.0, 2.0);
      expected *= std::pow(duration / pilot_s, growth);
    }
    expected *= kSafety;
    reached = std::min(reached, expected);
    if (expected <= target) {
      const scene::Scene chosen = scene::LoadScene(file, Joined(overrides, settings));
      AccuracyChoice choice;
      choice.overrides = settings;
      choice.expected = expected;
      choice.text = fmt::format(
          "{}, {} at {:.4g} ms; expected error {} of the body length, by a pilot of {:.3g} s of "
          "{:.3g} s{}",
          SettingsText(chosen), kIntegrator, 1e3 * step, Percent(expected), pilot_s, duration,
          growth > 0 ? fmt::format(", errors growing with time to the power {:.2g}", growth) : "");
      if (choice.text.starts_with(", ")) choice.text.erase(0, 2);
      return choice;
    }
    if (!(coarseness > 0) && !(longest > 0)) break;
  }
  throw BadInput(
      fmt::format("--accuracy: {} of the body length cannot be promised: the finest settings of "
                  "the pilot are expected "
                  "to err by {}; `mantle study accuracy {}` measures more",
                  Percent(target), Percent(reached), file));
}

}  // namespace mantle::tools
