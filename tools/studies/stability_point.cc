#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <optional>
#include <stdexcept>
#include <system_error>

#include "loop/scene/scene.h"
#include "loop/scene/toml_document.h"
#include "model/observation.h"
#include "tools/studies/accuracy_point.h"
#include "tools/studies/stability_study.h"

// One case with one integrator: a run per step, judged by what physics allows.

namespace mantle::tools {
namespace {

constexpr double kNegligibleEnergy_j = 1e-18;
constexpr double kLook_s = 1e-3;  // of CVODE, which has no steps of a given length
constexpr const char* kUnresolved = "the steps do not resolve the motion";

// Whether nothing acts on the whole from outside: a free root, no named effect but those whose
// momentum is the body's own, no load that the world exerts.
bool IsIsolated(const scene::Scene& scene) {
  if (!std::holds_alternative<model::FreeRoot>(scene.robot.root)) return false;
  const scene::TomlValue document = scene::ParseToml(scene.text, scene.name);
  if (const scene::TomlValue* effects = document.Find("effects")) {
    for (std::size_t i = 0; i < effects->keys.size(); ++i) {
      const std::string& key = effects->keys[i];
      const scene::TomlValue& value = effects->items[i];
      const bool off = value.kind == scene::TomlValue::Kind::kBoolean && !value.boolean;
      if (!off && key != "added_mass" && key != "viscosity" && key != "gravity") return false;
    }
  }
  for (const auto& arm : scene.robot.arms) {
    if (!arm.points.empty() || !arm.distributed.empty() || !arm.payloads.empty()) return false;
  }
  return true;
}

struct Judged {
  std::string verdict, reason;
  double error{NAN}, created{0}, momentum{NAN}, cpu_s{0};
};

// What a run's samples say against what physics allows.
class Judge {
 public:
  Judge(bool isolated, const StudyPath* reference) : isolated_(isolated), reference_(reference) {}

  void Add(model::Simulation& simulation, const model::Sample& s) {
    AddFrame(s, &path_);
    const double energy = s.energies.total();
    if (path_.frames.size() == 1) {
      first_j_ = energy;
      momentum_ = s.momentum.tail<3>();
      mass_kg_ =
          model::EvaluateSolidMotion(simulation.plant(), simulation.state(), simulation.EndWork())
              .mass_kg;
    }
    double work = 0, turned = simulation.energy().dissipated_j();
    for (double w : simulation.energy().work_j()) {
      work += w;
      turned += std::abs(w);
    }
    peak_j_ = std::max({peak_j_, s.energies.magnitude(), turned});
    const double created = energy - first_j_ - work + simulation.energy().dissipated_j();
    created_j_ = std::max(created_j_, created);
    change_ = std::max(change_, (s.momentum.tail<3>() - momentum_).norm());
    largest_momentum_ = std::sqrt(2 * mass_kg_ * peak_j_);
    finite_ = finite_ && std::isfinite(energy) && std::isfinite(s.root.position.norm()) &&
              std::isfinite(s.centre_of_mass_m.norm());
  }

  Judged Of(const model::RunResult& result, double duration_s) {
    Judged out;
    // Of the whole run's: before anything acts all energies are round-off.
    const double created_share = peak_j_ > kNegligibleEnergy_j ? created_j_ / peak_j_ : 0.0;
    out.created = created_share;
    if (isolated_ && largest_momentum_ > 0) out.momentum = change_ / largest_momentum_;
    if (!result.ok) {
      out.verdict = result.reason.empty() ? "violates" : "refused";
      out.reason = result.reason.empty() ? "stopped without a reason" : result.reason;
      return out;
    }
    std::string beyond;
    if (!finite_) {
      beyond = "figures that are not finite";
    } else if (result.sim_time_s < duration_s - 1e-9) {
      beyond = fmt::format("ended at t = {:g} s of {:g} s", result.sim_time_s, duration_s);
    }
    if (finite_ && reference_ != nullptr) {
      try {
        out.error = Headline(ComparePaths(path_, *reference_), *reference_);
      } catch (const std::invalid_argument& error) {
        beyond = error.what();
      }
    }
    if (beyond.empty() && result.balance_defined && created_share > kEnergyWithoutWork) {
      beyond = fmt::format("energy without work, {:.2g} of the run's, bound {:g}", created_share,
                           kEnergyWithoutWork);
    }
    if (beyond.empty() && out.momentum > kMomentumChange) {
      beyond = fmt::format("momentum changes by {:.2g} of the largest, bound {:g}", out.momentum,
                           kMomentumChange);
    }
    if (beyond.empty() && out.error > kFurthest) {
      beyond =
          fmt::format("{:.3g} body lengths from the reference, bound {:g}", out.error, kFurthest);
    }
    if (beyond.empty()) {
      out.verdict = "holds";
      return out;
    }
    const bool told =
        finite_ && std::any_of(result.warnings.begin(), result.warnings.end(), [](const auto& w) {
          return w.find(kUnresolved) != std::string::npos;
        });
    out.verdict = told ? "told" : "violates";
    out.reason = beyond;
    return out;
  }

  StudyPath* path() { return &path_; }

 private:
  bool isolated_;
  const StudyPath* reference_;
  StudyPath path_;
  model::Vector3 momentum_{model::Vector3::Zero()};
  double mass_kg_{0}, first_j_{0}, peak_j_{0}, created_j_{0}, change_{0}, largest_momentum_{0};
  bool finite_{true};
};

// The run, sample by sample; between them the time that it takes is looked at.
Judged Follow(model::Simulation* simulation, const model::RunSettings& settings, double begin_s,
              Judge* judge) {
  judge->Add(*simulation, simulation->Observe());
  const bool adaptive = settings.stepper.integrator == model::Integrator::kCvode;
  const double stride_s =
      adaptive ? std::min(kLook_s, settings.output_interval_s) : settings.output_interval_s;
  const auto strides = std::lround(settings.duration_s / stride_s);
  const auto per_sample = std::lround(settings.output_interval_s / stride_s);
  for (long i = 1; i <= strides; ++i) {
    const double target_s =
        settings.duration_s * static_cast<double>(i) / static_cast<double>(strides);
    const model::StepStatus status = simulation->AdvanceTo(target_s);
    if (!status.ok) {
      model::RunResult result = simulation->Result();
      result.ok = false;
      result.reason = status.reason;
      return judge->Of(result, settings.duration_s);
    }
    if (i % per_sample == 0) judge->Add(*simulation, simulation->Observe());
    if (i < strides && CpuSeconds() - begin_s > kMostCpu_s) {
      Judged out;
      out.verdict = "slow";
      out.reason = fmt::format("more than {:g} s of CPU time for the first {:.3g} s of {:g} s",
                               kMostCpu_s, target_s, settings.duration_s);
      return out;
    }
  }
  return judge->Of(simulation->Result(), settings.duration_s);
}

Judged RunStep(const scene::Scene& scene, const model::Plant& plant, double step_s, bool isolated,
               const StudyPath* reference) {
  model::RunSettings settings = scene.run;
  settings.step_s = step_s;
  settings.min_step_s = std::min(settings.min_step_s, step_s);
  settings.account_energy = true;
  settings.duration_s = settings.output_interval_s *
                        std::max(1.0, std::round(settings.duration_s / settings.output_interval_s));
  Judge judge(isolated, reference);
  judge.path()->body_length_m = plant.body_length_m;
  const double begin = CpuSeconds();
  Judged out;
  try {
    model::Simulation simulation(plant, settings);
    out = Follow(&simulation, settings, begin, &judge);
  } catch (const std::runtime_error& error) {  // also BadRobot
    out.verdict = "refused";
    out.reason = error.what();
  } catch (const std::invalid_argument& error) {
    out.verdict = "refused";
    out.reason = error.what();
  }
  out.cpu_s = CpuSeconds() - begin;
  return out;
}

Json Finite(double x) { return std::isfinite(x) ? Json(x) : Json(); }

}  // namespace

Json RunStabilityPoint(const StudyPoint& point) {
  const scene::Scene scene = scene::LoadScene(point.scene, point.overrides);
  const model::Plant plant(scene.robot);
  std::optional<StudyPath> reference;
  const auto file = ReferenceFile(PointFromJson(point.options["reference"]));
  if (std::filesystem::exists(file)) reference = ReadStudyPath(file);
  const bool isolated = IsIsolated(scene);
  Json row = RowOf(point);
  row["hard"] = scene.description;
  row["momentum_kept"] = isolated;
  Json runs = Json::array();
  bool holds = true, violates = false, accurate = false;
  Json largest, next;
  for (const Json& step : point.options["steps"]) {
    const Judged j =
        RunStep(scene, plant, step.get<double>(), isolated, reference ? &*reference : nullptr);
    runs.push_back({{"step_s", step},
                    {"verdict", j.verdict},
                    {"reason", j.reason},
                    {"error", Finite(j.error)},
                    {"created", Finite(j.created)},
                    {"momentum", Finite(j.momentum)},
                    {"cpu_s", j.cpu_s}});
    violates = violates || j.verdict == "violates";
    accurate = accurate || (j.verdict == "holds" && j.error <= kAsReference);
    if (holds && j.verdict == "holds") largest = step;
    if (holds && j.verdict != "holds") {
      next = j.verdict + ": " + j.reason;
      holds = false;
    }
  }
  row["largest_step_s"] = largest;
  row["next_fails"] = next;
  row["reached"] = accurate;
  row["runs"] = runs;
  row["ok"] = !violates;
  if (violates) row["reason"] = "a run goes beyond what physics allows, and says nothing";
  return row;
}

}  // namespace mantle::tools
