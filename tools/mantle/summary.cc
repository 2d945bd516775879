#include "tools/mantle/summary.h"

#include <algorithm>

#include "mantle/version.h"
#include "tools/mantle/standard_output.h"
#include "tools/mantle/trajectory.h"

namespace mantle::tools {
namespace {

using model::Plant;
using model::RunResult;
using model::Sample;
using scene::Scene;

Json PoseAndTwist(const model::Pose& pose, const model::Vector6& twist) {
  Json j = PoseJson(pose);
  j["angular_velocity_rad_s"] = VectorJson(twist.head<3>());
  j["velocity_m_s"] = VectorJson(twist.tail<3>());
  return j;
}

Json FinalJson(const Plant& plant, const Sample& last) {
  Json j;
  j["root"] = PoseAndTwist(last.root, last.root_twist);
  j["tips"] = Json::object();
  for (std::size_t a = 0; a < plant.rods.size(); ++a) {
    j["tips"][plant.rods[a].name] = PoseAndTwist(last.tips[a], last.tip_twists[a]);
  }
  j["centre_of_mass_m"] = VectorJson(last.centre_of_mass_m);
  j["cables"] = Json::object();
  const std::vector<std::string> cables = CableNames(plant);
  for (std::size_t c = 0; c < cables.size(); ++c) {
    j["cables"][cables[c]] = {{"length_m", last.cable_length_m[c]},
                              {"rate_m_s", last.cable_rate_m_s[c]},
                              {"tension_n", last.cable_tension_n[c]}};
  }
  return j;
}

Json EnergiesJson(const model::Energies& e) {
  return {{"kinetic_solid", e.kinetic_solid_j},
          {"kinetic_water", e.kinetic_water_j},
          {"elastic_arms", e.elastic_arms_j},
          {"elastic_mantle", e.elastic_mantle_j},
          {"total", e.total()}};
}

Json WorkJson(const RunResult& result) {
  Json j = Json::object();
  for (std::size_t i = 0; i < result.work_names.size(); ++i) {
    j[result.work_names[i]] = result.work_j[i];
  }
  return j;
}

Json IndexJson(const model::EnergeticIndex& index) {
  return {{"mean_of_ratio", index.mean_of_ratio},
          {"ratio_of_means", index.ratio_of_means},
          {"positive_mean_of_ratio", index.positive_mean_of_ratio},
          {"positive_ratio_of_means", index.positive_ratio_of_means},
          {"mean_output_w", index.mean_output_w},
          {"mean_input_w", index.mean_input_w}};
}

}  // namespace

void VolumeRange::Add(double volume_m3) {
  if (!started) initial_m3 = min_m3 = max_m3 = volume_m3;
  started = true;
  min_m3 = std::min(min_m3, volume_m3);
  max_m3 = std::max(max_m3, volume_m3);
}

Json VectorJson(const model::Vector3& v) { return Json::array({v.x(), v.y(), v.z()}); }

std::string Dump(const Json& j) {
  return j.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

Json StrainJson(const model::LargestStrain& strain) {
  if (strain.body.empty()) return {};
  Json j = {{"value", strain.value}, {"body", strain.body}, {"arc_length_m", strain.x_m}};
  if (strain.time_s) j["time_s"] = *strain.time_s;
  return j;
}

Json LobedBucklingJson(const std::optional<model::LobedBucklingMargin>& margin) {
  if (!margin) return {};
  Json j = {{"working_pa", margin->working_pa},
            {"ends_free_pa", margin->lobes.free_pa},
            {"ends_held_pa", margin->lobes.held_pa},
            {"lobes", margin->lobes.held_lobes}};
  if (margin->time_s) j["time_s"] = *margin->time_s;
  return j;
}

void ComplainOfWarnings(const std::string& scene, const std::vector<std::string>& warnings) {
  for (const std::string& warning : warnings) Complain("warning: {}: {}", scene, warning);
}

Json PoseJson(const model::Pose& pose) {
  const auto& q = pose.rotation;
  return {{"position_m", VectorJson(pose.position)},
          {"quaternion_wxyz", Json::array({q.w(), q.x(), q.y(), q.z()})}};
}

const char* IntegratorName(model::Integrator integrator) {
  switch (integrator) {
    case model::Integrator::kSdirk2:
      return "sdirk2";
    case model::Integrator::kSdirk3:
      return "sdirk3";
    case model::Integrator::kBackwardEuler:
      return "backward_euler";
    case model::Integrator::kRk4:
      return "rk4";
    case model::Integrator::kCvode:
      return "cvode";
  }
  return "";
}

std::vector<std::string> EffectNames(const model::Effects& e) {
  std::vector<std::string> names;
  const auto add = [&](bool named, const char* name) {
    if (named) names.emplace_back(name);
  };
  add(e.weight, "weight");
  add(e.buoyancy, "buoyancy");
  add(e.drag, "drag");
  add(e.added_mass, "added_mass");
  add(e.viscosity, "viscosity");
  add(e.jet_thrust.has_value(), "jet_thrust");
  add(e.normal_pressure.has_value(), "normal_pressure");
  add(e.lateral_drag.has_value(), "lateral_drag");
  add(e.contained_water, "contained_water");
  add(e.lateral_added_mass, "lateral_added_mass");
  e.named.ForEach([&](const auto& effect) {
    add(effect.has_value(), model::EffectType<decltype(effect)>::kName);
  });
  add(e.current_m_s.has_value() || e.unsteady_current.has_value(), "current");
  return names;
}

Json SettingsSummary(const Scene& scene, const Plant& plant) {
  Json elements = Json::object();
  for (const model::Rod& rod : plant.rods) elements[rod.name] = rod.element_count();
  if (plant.shell) elements[plant.shell->name] = plant.shell->element_count();
  const model::StepperSettings& s = scene.run.stepper;
  Json j = {{"coupling", plant.exact() ? "exact" : "frozen"},
            {"elements", elements},
            {"unknowns", plant.velocity_size()},
            {"effects", EffectNames(plant.robot.effects)},
            {"integrator", IntegratorName(s.integrator)},
            {"duration_s", scene.run.duration_s},
            {"step_s", scene.run.step_s},
            {"min_step_s", scene.run.min_step_s},
            {"output_interval_s", scene.run.output_interval_s}};
  if (s.integrator == model::Integrator::kCvode) {
    j["relative_tolerance"] = s.relative_tolerance;
    j["absolute_tolerance"] = s.absolute_tolerance;
  } else {
    j["tolerance"] = s.step_tolerance;
    j["newton_tolerance"] = s.newton_tolerance;
    j["newton_iterations"] = s.newton_max_iterations;
  }
  if (const auto& jet = plant.robot.effects.jet_thrust) {
    j["jet_thrust"] = {{"flux", jet->flux == model::FluxReading::kVolume ? "volume" : "radial"},
                       {"place", jet->place == model::ThrustPlace::kUniform ? "uniform" : "dome"}};
  }
  return j;
}

namespace {

Json DropsJson(const RunResult& result) {
  const auto numbers = [](const model::Vector3& v) { return Json{v(0), v(1), v(2)}; };
  Json drops = Json::array();
  for (const model::PayloadDrop& d : result.drops) {
    drops.push_back({{"payload", d.name},
                     {"time_s", d.time_s},
                     {"centre_m", numbers(d.centre_m)},
                     {"velocity_m_s", numbers(d.velocity_m_s)},
                     {"momentum_kg_m_s", numbers(d.momentum_kg_m_s)},
                     {"kinetic_energy_j", d.kinetic_energy_j}});
  }
  return drops;
}

}  // namespace

Json RunSummary(const RunReport& report) {
  const RunResult& r = *report.result;
  const Plant& plant = *report.plant;
  Json j;
  j["scene"] = report.scene->name;
  j["mantle_version"] = kVersion;
  j["complete"] = report.complete;
  if (!report.complete) j["reason"] = report.reason;
  j["sim_time_s"] = r.sim_time_s;
  j["wall_time_s"] = report.wall_time_s;
  j["realtime_factor"] =
      report.wall_time_s > 0 ? Json(report.simulated_here_s / report.wall_time_s) : Json();
  j["steps"] = r.counters.steps;
  j["rejected_steps"] = r.counters.rejected;
  j["newton_iterations"] = r.counters.newton_iterations;
  j["factorisations"] = r.counters.factorisations;
  j["evaluations"] = r.counters.evaluations;
  const bool accounted = report.scene->run.account_energy;
  j["power_balance_residual"] = r.balance_defined ? Json(r.power_balance_residual) : Json();
  j["power_balance_scale_w"] = r.balance_defined ? Json(r.power_balance_scale_w) : Json();
  j["energy_drift"] = r.balance_defined && accounted ? Json(r.energy_drift) : Json();
  j["energy_drift_scale_j"] =
      r.balance_defined && accounted ? Json(r.energy_drift_scale_j) : Json();
  j["warnings"] = r.warnings;
  j["largest_strain"] = StrainJson(r.largest_strain);
  j["lobed_buckling"] = LobedBucklingJson(r.lobed_buckling);
  j["final"] = FinalJson(plant, r.last);
  j["volume_m3"] = plant.shell ? Json{{"initial", report.volume.initial_m3},
                                      {"final", r.last.volume_m3},
                                      {"min", report.volume.min_m3},
                                      {"max", report.volume.max_m3}}
                               : Json();
  j["energies_j"] = EnergiesJson(r.last.energies);
  j["work_j"] = accounted ? WorkJson(r) : Json();
  j["dissipated_j"] = accounted ? Json(r.dissipated_j) : Json();
  j["drops"] = DropsJson(r);
  j["energetic_index"] = accounted ? IndexJson(r.index) : Json();
  j["settings"] = SettingsSummary(*report.scene, plant);
  j["overrides"] = report.overrides;
  return j;
}

}  // namespace mantle::tools
