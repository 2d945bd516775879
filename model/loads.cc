#include "model/loads.h"

#include <cmath>
#include <numbers>

namespace mantle::model {
namespace {

constexpr double kPi = std::numbers::pi;

}  // namespace

void GravityLoad::Name(const std::string&, PowerNames* names) {
  if (body_density_kg_m3 != 0.0 || by_section) weight_place = names->Place(kWeightName);
  if (water_density_kg_m3 != 0.0) buoyancy_place = names->Place(kBuoyancyName);
}

void GravityLoad::AddPower(const SectionGeometry& s, const SectionMotion& m,
                           const Vector6& working_twist, double scale, double* power_w) const {
  const double fall =
      scale * s.area_m2 * (m.rotation.conjugate() * gravity_m_s2).dot(working_twist.tail<3>());
  if (weight_place >= 0) power_w[weight_place] += BodyDensity(s) * fall;
  if (buoyancy_place >= 0) power_w[buoyancy_place] += -water_density_kg_m3 * fall;
}

Vector6 GravityLoad::Density(const SectionGeometry& s, const SectionMotion& m) const {
  Vector6 w = Vector6::Zero();
  const double weight = (BodyDensity(s) - water_density_kg_m3) * s.area_m2;
  w.tail<3>() = weight * (m.rotation.conjugate() * gravity_m_s2);
  return w;
}

void GravityLoad::AddTangent(const SectionGeometry& s, const SectionMotion& m,
                             LoadTangent* t) const {
  // R -> R exp(zeta~): R^T F changes by (R^T F) x zeta
  t->force_by_rotation += Hat(Density(s, m).tail<3>());
}

void DragLoad::Name(const std::string& body, PowerNames* names) {
  place = names->Place("drag." + body);
}

void DragLoad::AddPower(const SectionGeometry& s, const SectionMotion& m,
                        const Vector6& working_twist, double scale, double* power_w) const {
  power_w[place] += scale * Density(s, m).dot(working_twist);
}

Vector3 DragLoad::Shape(const SectionGeometry& s) const {
  const Vector3 d(0.5 * kPi * coefficients.x(), coefficients.y(), coefficients.z());
  return d.cwiseProduct(s.drag_shape);
}

Vector6 DragLoad::Density(const SectionGeometry& s, const SectionMotion& m) const {
  const Vector3 v = m.twist.tail<3>();
  const Vector3 d = Shape(s);
  Vector6 w = Vector6::Zero();
  w.tail<3>() = (-water_density_kg_m3 * s.radius_m * v.norm()) * d.cwiseProduct(v);
  return w;
}

void DragLoad::AddTangent(const SectionGeometry& s, const SectionMotion& m, LoadTangent* t) const {
  const Vector3 v = m.twist.tail<3>();
  const double speed = v.norm();
  if (speed == 0.0) return;  // the density is differentiable there, with derivative zero
  const Vector3 d = Shape(s);
  const double k = -water_density_kg_m3 * s.radius_m;
  t->force_by_velocity += (k / speed) * d.cwiseProduct(v) * v.transpose();
  t->force_by_velocity.diagonal() += k * speed * d;
}

Vector6 DistributedLoad::Density(const SectionGeometry& s, const SectionMotion& m) const {
  const double shape = base + (tip - base) * s.x_m / length_m;
  return WrenchInSection(shape * direction, frame, m.rotation);
}

void DistributedLoad::AddTangent(const SectionGeometry& s, const SectionMotion& m,
                                 LoadTangent* t) const {
  if (frame == LoadFrame::kBody) return;
  const Vector6 w = Density(s, m);
  t->moment_by_rotation += Hat(w.head<3>());
  t->force_by_rotation += Hat(w.tail<3>());
}

std::optional<GravityLoad> GravityLoad::From(const Arm& arm, const Water& water,
                                             const Effects& effects) {
  if (!effects.weight && !effects.buoyancy) return std::nullopt;
  const double density = arm.inertia ? (*arm.inertia)(5) / (kPi * std::pow(arm.radius_base_m, 2))
                                     : arm.material.density_kg_m3;
  const bool by_section =
      !arm.pieces.empty() || (arm.inertia && arm.radius_base_m != arm.radius_tip_m);
  return GravityLoad{effects.gravity_m_s2, effects.weight ? density : 0.0,
                     effects.buoyancy ? water.density_kg_m3 : 0.0, effects.weight && by_section};
}

std::optional<DragLoad> DragLoad::From(const Arm& arm, const Water& water, const Effects& effects) {
  if (!effects.drag) return std::nullopt;
  return DragLoad{water.density_kg_m3, arm.drag_coefficients};
}

Vector6 WrenchInSection(const Vector6& wrench, LoadFrame frame,
                        const Eigen::Quaterniond& rotation) {
  if (frame == LoadFrame::kBody) return wrench;
  Vector6 w;
  w << rotation.conjugate() * wrench.head<3>(), rotation.conjugate() * wrench.tail<3>();
  return w;
}

Vector6 SectionInertia(double density_kg_m3, double radius_m) {
  const double area = kPi * radius_m * radius_m;
  const double second = 0.25 * area * radius_m * radius_m;
  Vector6 m;
  m << 2.0 * second, second, second, area, area, area;
  return density_kg_m3 * m;
}

double SectionAddedMass(double water_density_kg_m3, double coefficient, double radius_m) {
  return water_density_kg_m3 * coefficient * kPi * radius_m * radius_m;
}

Vector6 SectionStiffness(const Material& material, double shear_correction, double radius_m) {
  const double area = kPi * radius_m * radius_m;
  const double second = 0.25 * area * radius_m * radius_m;
  const double e = material.young_pa;
  const double g = material.shear_pa();
  Vector6 s;
  s << 2.0 * g * second, e * second, e * second, e * area, shear_correction * g * area,
      shear_correction * g * area;
  return s;
}

Vector6 SectionViscosity(const Material& material, double radius_m) {
  const double area = kPi * radius_m * radius_m;
  const double second = 0.25 * area * radius_m * radius_m;
  Vector6 u;
  u << 2.0 * second, 3.0 * second, 3.0 * second, 3.0 * area, area, area;
  return material.viscosity_pa_s * u;
}

std::vector<SectionLoad> SectionLoads(const Arm& arm, const Water& water, const Effects& effects) {
  std::vector<SectionLoad> loads;
  AddLoads<SectionLoad, GravityLoad, DragLoad, WaterAccelerationLoad>(&loads, arm, water, effects);
  effects.named.ForEach([&](const auto& effect) {
    using Effect = EffectType<decltype(effect)>;
    if constexpr (requires { typename Effect::SectionLoad; }) {
      if (!effect) return;
      if (auto load = Effect::SectionLoad::From(*effect, arm, water)) loads.push_back(*load);
    }
  });
  return loads;
}

}  // namespace mantle::model
