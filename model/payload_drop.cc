#include <cmath>

#include "model/simulation.h"

/// Payloads that leave.

namespace mantle::model {
namespace {

constexpr double kSameTime_s = 1e-12;

}  // namespace

std::string PayloadName(const Plant& plant, int payload) {
  for (const Rod& rod : plant.rods) {
    const int count = static_cast<int>(rod.payloads.size());
    if (payload < count) return rod.name + "." + rod.payloads[payload].payload.name;
    payload -= count;
  }
  return {};
}

std::vector<PayloadDrop> DropsAt(const Plant& plant, const PlantState& state) {
  std::vector<PayloadDrop> drops;
  for (int a = 0; a < static_cast<int>(plant.rods.size()); ++a) {
    for (std::size_t k = 0; k < plant.rods[a].payloads.size(); ++k) {
      const RodPayload& p = plant.rods[a].payloads[k];
      if (!p.payload.drop_s || std::abs(*p.payload.drop_s - state.time_s) > kSameTime_s) continue;
      const WaterMotion water = EvaluateWater(plant.robot.effects, state.time_s);
      const Pose g = AbsolutePose(plant, state, a, p.node);
      Vector6 eta = AbsoluteTwist(plant, state, a, p.node);
      eta.tail<3>() += g.rotation.conjugate() * water.velocity_m_s;
      const Vector3& centre = p.payload.offset_m;
      PayloadDrop drop;
      drop.payload = plant.PayloadIndex(a, static_cast<int>(k));
      drop.name = PayloadName(plant, drop.payload);
      drop.time_s = state.time_s;
      drop.centre_m = g.position + water.drift_m + g.rotation * centre;
      drop.velocity_m_s = g.rotation * (eta.tail<3>() + eta.head<3>().cross(centre));
      drop.momentum_kg_m_s = p.payload.mass_kg * drop.velocity_m_s;
      drop.kinetic_energy_j = 0.5 * eta.dot(p.inertia * eta);
      drops.push_back(drop);
    }
  }
  return drops;
}

}  // namespace mantle::model
