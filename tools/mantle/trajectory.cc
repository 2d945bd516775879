#include "tools/mantle/trajectory.h"

#include <fmt/format.h>

#include <iterator>

namespace mantle::tools {
namespace {

using model::Plant;
using model::Sample;

// One walk for titles and values, so that they cannot disagree.
template <typename Emit>
void Walk(const Plant& plant, const Sample& s, Emit emit) {
  const auto vector = [&](const std::string& name, const model::Vector3& v, const char* unit) {
    const char* axes[] = {"x", "y", "z"};
    for (int k = 0; k < 3; ++k) emit(fmt::format("{}{}_{}", name, axes[k], unit), v(k));
  };
  const auto pose = [&](const std::string& name, const model::Pose& g) {
    vector(name + "_", g.position, "m");
    emit(name + "_qw", g.rotation.w());
    emit(name + "_qx", g.rotation.x());
    emit(name + "_qy", g.rotation.y());
    emit(name + "_qz", g.rotation.z());
  };
  const auto twist = [&](const std::string& name, const model::Vector6& eta) {
    vector(name + "_w", eta.head<3>(), "rad_s");
    vector(name + "_v", eta.tail<3>(), "m_s");
  };
  emit("time_s", s.time_s);
  pose("root", s.root);
  twist("root", s.root_twist);
  for (std::size_t a = 0; a < plant.rods.size(); ++a) {
    const std::string name = plant.rods[a].name + "_tip";
    pose(name, a < s.tips.size() ? s.tips[a] : model::Pose{});
    twist(name, a < s.tip_twists.size() ? s.tip_twists[a] : model::Vector6::Zero());
  }
  vector("centre_of_mass_", s.centre_of_mass_m, "m");
  vector("angular_momentum_", s.momentum.head<3>(), "n_m_s");
  vector("momentum_", s.momentum.tail<3>(), "n_s");
  if (plant.shell) {
    emit("volume_m3", s.volume_m3);
    emit("volume_rate_m3_s", s.volume_rate_m3_s);
  }
  if (plant.robot.effects.jet_thrust) emit("thrust_n", s.thrust_n);
  emit("kinetic_solid_j", s.energies.kinetic_solid_j);
  emit("kinetic_water_j", s.energies.kinetic_water_j);
  if (!plant.rods.empty()) emit("elastic_arms_j", s.energies.elastic_arms_j);
  if (plant.shell) emit("elastic_mantle_j", s.energies.elastic_mantle_j);
  const std::vector<std::string> cables = CableNames(plant);
  for (std::size_t c = 0; c < cables.size(); ++c) {
    const bool given = c < s.cable_length_m.size();
    emit(cables[c] + "_length_m", given ? s.cable_length_m[c] : 0.0);
    emit(cables[c] + "_rate_m_s", given ? s.cable_rate_m_s[c] : 0.0);
    emit(cables[c] + "_tension_n", given ? s.cable_tension_n[c] : 0.0);
  }
  emit("index_output_w", s.index_output_w);
  emit("index_input_w", s.index_input_w);
  if (plant.exact()) emit("power_balance_residual", s.power_balance_residual);
}

}  // namespace

std::vector<std::string> CableNames(const Plant& plant) {
  std::vector<std::string> names;
  for (const model::Rod& rod : plant.rods) {
    for (const model::RodCable& c : rod.cables) names.push_back(rod.name + "_" + c.name);
  }
  if (plant.shell) {
    for (const model::ShellSpokes& s : plant.shell->spokes) {
      names.push_back(plant.shell->name + "_" + s.strip.name);
    }
  }
  return names;
}

std::string TrajectoryTitles(const Plant& plant) {
  std::string line;
  Walk(plant, Sample{}, [&](const std::string& name, double) {
    if (!line.empty()) line += ',';
    line += name;
  });
  return line + "\n";
}

std::string TrajectoryRow(const Plant& plant, const Sample& sample) {
  std::string line;
  Walk(plant, sample, [&](const std::string&, double value) {
    if (!line.empty()) line += ',';
    fmt::format_to(std::back_inserter(line), "{}", value);
  });
  return line + "\n";
}

}  // namespace mantle::tools
