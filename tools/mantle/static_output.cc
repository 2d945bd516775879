#include "tools/mantle/static_output.h"

#include <fmt/format.h>

#include <iterator>

#include "mantle/version.h"
#include "model/schedule.h"
#include "model/static_problem.h"
#include "tools/mantle/trajectory.h"

namespace mantle::tools {
namespace {

using model::Plant;
using model::StaticsResult;

void AddLoad(const std::string& name, const char* unit, double value, const StaticsResult& r,
             Json* loads) {
  if (value == 0.0) return;
  Json j = {{"unit", unit}, {"at_load_factor_1", value}, {"at_end", value * r.load_factor}};
  j["at_limit"] = r.limit_load_factor ? Json(value * *r.limit_load_factor) : Json();
  (*loads)[name] = j;
}

void AddWrench(const std::string& name, const model::Vector6& wrench, double scale,
               const char* moment, const char* force, const StaticsResult& r, Json* loads) {
  AddLoad(name + ".moment", moment, scale * wrench.head<3>().norm(), r, loads);
  AddLoad(name + ".force", force, scale * wrench.tail<3>().norm(), r, loads);
}

Json LoadsJson(const Plant& plant, const StaticsResult& r, double t) {
  Json loads = Json::object();
  for (const model::Rod& rod : plant.rods) {
    for (const auto& d : rod.distributed) {
      AddWrench(rod.name + "." + d.name, d.load.direction, model::Value(d.schedule, t), "N m/m",
                "N/m", r, &loads);
    }
    for (const auto& p : rod.points) {
      AddWrench(rod.name + "." + p.load.name, p.load.wrench, model::Value(p.load.schedule, t),
                "N m", "N", r, &loads);
    }
  }
  if (plant.shell) {
    for (const auto& s : plant.shell->strips) {
      AddLoad(plant.shell->name + "." + s.strip.name, "Pa", model::Value(s.pressure_pa, t), r,
              &loads);
    }
  }
  if (const auto& p = plant.robot.effects.normal_pressure) {
    AddLoad("normal_pressure", "Pa", model::Value(p->pressure_pa, t), r, &loads);
  }
  if (plant.has_gravity()) {
    AddLoad("gravity", "m/s^2", plant.robot.effects.gravity_m_s2.norm(), r, &loads);
  }
  return loads;
}

// What a reader must know about an equilibrium before believing it.
std::vector<std::string> StabilityWarnings(const StaticsResult& r) {
  std::vector<std::string> warnings;
  const model::Stability& s = r.stability;
  if (s.unstable_directions > 0 && s.test == model::StabilityTest::kInertia) {
    warnings.push_back(fmt::format(
        "unstable in {} direction{}: the robot does not stay in this shape; statics.branch = "
        "\"stable\", or a small load to the side, leads to one in which it does",
        s.unstable_directions, s.unstable_directions == 1 ? "" : "s"));
  } else if (s.unstable_directions > 0) {
    warnings.push_back(fmt::format(
        "unstable: a motion {} at {:.3g} 1/s; `mantle run` shows where it leads",
        s.frequency_hz > 0 ? fmt::format("of {:.3g} Hz grows", s.frequency_hz) : "grows",
        s.growth_rate_1_s));
  } else if (s.unstable_directions < 0) {
    warnings.push_back("stability could not be told: the linearised motion did not converge");
  }
  for (const double load : r.bifurcation_load_factors) {
    warnings.push_back(fmt::format(
        "the number of unstable directions changes at load factor {:.6g} (bifurcation{})", load,
        s.test == model::StabilityTest::kInertia ? "" : ", or onset of flutter"));
  }
  return warnings;
}

template <typename... Values>
void AppendRow(std::string* text, const Values&... values) {
  const char* separator = "";
  ((fmt::format_to(std::back_inserter(*text), "{}{}", separator, values), separator = ","), ...);
  *text += '\n';
}

}  // namespace

Json StaticSummary(const scene::Scene& scene, const Plant& plant, const StaticsResult& r,
                   double wall_time_s, const std::vector<std::string>& overrides) {
  Json j;
  j["scene"] = scene.name;
  j["mantle_version"] = kVersion;
  j["complete"] = r.ok;
  if (!r.ok) j["reason"] = r.reason;
  j["wall_time_s"] = wall_time_s;
  j["load_factor"] = r.load_factor;
  j["limit_load_factor"] = r.limit_load_factor ? Json(*r.limit_load_factor) : Json();
  j["loads"] = LoadsJson(plant, r, scene.statics.time_s);
  j["tips"] = Json::object();
  for (std::size_t a = 0; a < plant.rods.size(); ++a) {
    const int arm = static_cast<int>(a);
    j["tips"][plant.rods[a].name] =
        PoseJson(model::AbsolutePose(plant, r.state, arm, plant.rods[a].element_count()));
  }
  j["cables"] = Json::object();
  const std::vector<std::string> cables = CableNames(plant);
  for (std::size_t c = 0; c < cables.size() && c < r.cable_length_m.size(); ++c) {
    j["cables"][cables[c]] = {{"length_m", r.cable_length_m[c]},
                              {"tension_n", r.cable_tension_n[c]}};
  }
  j["unstable_directions"] = r.stability.unstable_directions;
  j["stability_test"] = model::ToString(r.stability.test);
  j["loads_without_potential"] = r.without_potential;
  j["growth_rate_1_s"] = r.stability.test == model::StabilityTest::kInertia
                             ? Json()
                             : Json(r.stability.growth_rate_1_s);
  j["bifurcation_load_factors"] = r.bifurcation_load_factors;
  const model::StaticProblem problem(plant, scene.statics.time_s);
  model::PlantInputs inputs;
  problem.Scale(r.load_factor, &inputs);
  model::PlantWork work(plant);
  model::EvaluateForces(plant, r.state, inputs, &work);
  const model::LargestStrain strain = model::FindLargestStrain(plant, work);
  std::vector<std::string> warnings = StabilityWarnings(r);
  for (auto& w : model::StrainWarnings(strain)) warnings.push_back(w);
  j["largest_strain"] = StrainJson(strain);
  j["lobed_buckling"] = Json();
  if (plant.shell) {
    const model::LobedBuckling lobes = model::FindLobedBuckling(*plant.shell);
    const double working = model::InwardPressure(plant, inputs, r.cable_tension_n);
    j["lobed_buckling"] = LobedBucklingJson(model::LobedBucklingMargin{lobes, working, {}});
    for (auto& w : model::LobedBucklingWarnings({lobes, working, {}})) warnings.push_back(w);
  }
  j["warnings"] = warnings;
  j["volume_m3"] = plant.shell ? Json{{"initial", plant.shell->rest_volume_m3},
                                      {"final", model::ShellVolume(r.state.shape)}}
                               : Json();
  j["residual_n"] = r.residual_n;
  j["internal_force_n"] = r.internal_force_n;
  j["iterations"] = r.iterations;
  j["points"] = r.path.size();
  Json elements = Json::object();
  for (const model::Rod& rod : plant.rods) elements[rod.name] = rod.element_count();
  if (plant.shell) elements[plant.shell->name] = plant.shell->element_count();
  j["settings"] = {
      {"elements", elements},
      {"effects", EffectNames(plant.robot.effects)},
      {"arc_length", scene.statics.arc_length},
      {"branch", scene.statics.branch == model::StaticBranch::kStable ? "stable" : "primary"},
      {"load_steps", scene.statics.load_steps},
      {"tolerance", scene.statics.tolerance}};
  j["overrides"] = overrides;
  return j;
}

std::string StaticPathCsv(const Plant& plant, const StaticsResult& result) {
  std::string text = "load_factor,unstable_directions";
  if (plant.shell) text += ",volume_m3";
  for (const model::Rod& rod : plant.rods) {
    for (const char* axis : {"x", "y", "z"}) text += fmt::format(",{}_tip_{}_m", rod.name, axis);
  }
  text += '\n';
  for (const model::StaticsPoint& p : result.path) {
    text += fmt::format("{},{}", p.load_factor, p.unstable_directions);
    if (plant.shell) text += fmt::format(",{}", p.volume_m3);
    for (const model::Vector3& tip : p.tips_m) {
      text += fmt::format(",{},{},{}", tip.x(), tip.y(), tip.z());
    }
    text += '\n';
  }
  return text;
}

std::string ShapeCsv(const Plant& plant, const model::PlantState& state) {
  std::string text = "body,node,arc_length_m,x_m,y_m,z_m,qw,qx,qy,qz,r_m,theta_rad\n";
  for (std::size_t a = 0; a < plant.rods.size(); ++a) {
    for (int i = 0; i <= plant.rods[a].element_count(); ++i) {
      const model::Pose g = model::AbsolutePose(plant, state, static_cast<int>(a), i);
      AppendRow(&text, plant.rods[a].name, i, plant.rods[a].x_m[i], g.position.x(), g.position.y(),
                g.position.z(), g.rotation.w(), g.rotation.x(), g.rotation.y(), g.rotation.z(), "",
                "");
    }
  }
  for (int j = 0; j < plant.shape_count(); ++j) {
    const model::Vector3& q = state.shape[j];
    const model::Vector3 p =
        state.pose[0].position + state.pose[0].rotation * model::Vector3(q(0), 0, q(1));
    AppendRow(&text, plant.shell->name, j, plant.shell->nodes[j].x_m, p.x(), p.y(), p.z(), "", "",
              "", "", q(0), q(2));
  }
  return text;
}

}  // namespace mantle::tools
