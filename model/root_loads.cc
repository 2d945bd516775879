#include "model/root_loads.h"

#include "model/rigid_body.h"

namespace mantle::model {

void RigidGravityLoad::Name(PowerNames* names) {
  if (mass_kg != 0.0) weight_place = names->Place(kWeightName);
  if (displaced_kg != 0.0) buoyancy_place = names->Place(kBuoyancyName);
}

Vector6 RigidGravityLoad::Wrench(const SectionMotion& root) const {
  const Vector3 f = (mass_kg - displaced_kg) * (root.rotation.conjugate() * gravity_m_s2);
  Vector6 w;
  w << centre_m.cross(f), f;
  return w;
}

void RigidGravityLoad::AddTangent(const SectionMotion& root, double scale, RootTangent* t) const {
  const double net = mass_kg - displaced_kg;
  if (net == 0.0) return;
  const Matrix3 turn = Hat(scale * net * (root.rotation.conjugate() * gravity_m_s2));
  t->by_rotation.topRows<3>() += Hat(centre_m) * turn;
  t->by_rotation.bottomRows<3>() += turn;
}

void RigidGravityLoad::AddPower(const SectionMotion& root, const Vector6& working_twist,
                                double scale, double* power_w) const {
  const Vector3 g = scale * (root.rotation.conjugate() * gravity_m_s2);
  const double fall = g.dot(working_twist.tail<3>() + working_twist.head<3>().cross(centre_m));
  if (weight_place >= 0) power_w[weight_place] += mass_kg * fall;
  if (buoyancy_place >= 0) power_w[buoyancy_place] -= displaced_kg * fall;
}

std::optional<RigidGravityLoad> RigidGravityLoad::From(const Robot& robot) {
  const Effects& effects = robot.effects;
  if (!robot.rigid_body || (!effects.weight && !effects.buoyancy)) return std::nullopt;
  const RigidBody& body = *robot.rigid_body;
  return RigidGravityLoad{effects.gravity_m_s2, effects.weight ? RigidMass(body) : 0.0,
                          effects.buoyancy ? robot.water.density_kg_m3 * RigidVolume(body) : 0.0,
                          RigidCentre(body)};
}

std::optional<RigidWaterAccelerationLoad> RigidWaterAccelerationLoad::From(const Robot& robot) {
  if (!robot.effects.unsteady_current || !robot.rigid_body) return std::nullopt;
  const RigidBody& body = *robot.rigid_body;
  return RigidWaterAccelerationLoad{RigidMass(body), robot.water.density_kg_m3 * RigidVolume(body),
                                    RigidCentre(body)};
}

std::vector<RootLoad> RootLoads(const Robot& robot) {
  std::vector<RootLoad> loads;
  AddLoads<RootLoad, RigidGravityLoad, RigidWaterAccelerationLoad>(&loads, robot);
  robot.effects.named.ForEach([&](const auto& effect) {
    using Effect = EffectType<decltype(effect)>;
    if constexpr (requires { typename Effect::RootLoad; }) {
      if (!effect) return;
      if (auto load = Effect::RootLoad::From(*effect, robot)) loads.push_back(*load);
    }
  });
  return loads;
}

void AddRootWrenches(const std::vector<RootLoad>& loads, const SectionMotion& root,
                     double field_scale, double sign, Vector6* sum) {
  for (const RootLoad& load : loads) {
    std::visit([&](const auto& l) { *sum += (sign * FieldScale(l, field_scale)) * l.Wrench(root); },
               load);
  }
}

RootTangent RootLoadTangent(const std::vector<RootLoad>& loads, const SectionMotion& root,
                            double field_scale) {
  RootTangent t;
  for (const RootLoad& load : loads) {
    std::visit([&](const auto& l) { l.AddTangent(root, FieldScale(l, field_scale), &t); }, load);
  }
  return t;
}

}  // namespace mantle::model
