#include "model/mantle_loads.h"

#include <cmath>
#include <numbers>

#include "model/lateral_drag.h"

namespace mantle::model {
namespace {

constexpr double kPi = std::numbers::pi;

}  // namespace

void NormalPressureLoad::AddForces(const ShellMotion& m, ShellForces* f) const {
  ShellWallVolumeGradient(m.shape, f->gradient);
  for (int j = 0; j < m.shell.node_count(); ++j) {
    f->node[j] += m.normal_pressure_pa * (*f->gradient)[j];
  }
}

void SubtractVolumeTangent(const std::vector<Vector3>& q, double p, BlockTridiagonal<3>* out) {
  BlockTridiagonal<3>& chain = *out;
  const double third = kPi / 3.0;
  for (int i = 0; i + 1 < static_cast<int>(q.size()); ++i) {
    const double a = q[i](0), b = q[i + 1](0), dz = q[i + 1](1) - q[i](1);
    chain.diagonal[i](0, 0) += p * third * 2.0 * dz;
    chain.diagonal[i + 1](0, 0) += p * third * 2.0 * dz;
    chain.upper[i](0, 0) += p * third * dz;
    chain.lower[i](0, 0) += p * third * dz;
    const double by_a = p * third * (2.0 * a + b), by_b = p * third * (a + 2.0 * b);
    chain.diagonal[i](0, 1) -= by_a;
    chain.diagonal[i](1, 0) -= by_a;
    chain.upper[i](0, 1) += by_a;
    chain.lower[i](1, 0) += by_a;
    chain.lower[i](0, 1) -= by_b;
    chain.upper[i](1, 0) -= by_b;
    chain.diagonal[i + 1](0, 1) += by_b;
    chain.diagonal[i + 1](1, 0) += by_b;
  }
}

void NormalPressureLoad::AddTangent(const ShellMotion& m, ShellTangent* t) const {
  // derivative of the swept-volume gradient: of the volume's, and of the end planes' share
  SubtractVolumeTangent(m.shape, m.normal_pressure_pa, t->chain);
  const double two_pi = 2.0 * kPi * m.normal_pressure_pa;
  t->chain->diagonal[0](1, 0) += two_pi * m.shape.front()(0);
  t->chain->diagonal[m.shell.element_count()](1, 0) -= two_pi * m.shape.back()(0);
}

void NormalPressureLoad::AddPower(const ShellMotion& m, const Vector6&, double* power_w) const {
  // pressure times the rate of the wall's swept volume: U_dot plus the end planes' share
  const auto plane = [&](int j) {
    const double r = m.shape[j](0);
    return kPi * r * r * m.rate(j)(1);
  };
  const int n = m.shell.element_count();
  power_w[place] += m.normal_pressure_pa * (m.volume_rate_m3_s + plane(n) - plane(0));
}

JetLoad::Jet JetLoad::Evaluate(double q) const {
  const double nozzle = kPi * nozzle_radius_m * nozzle_radius_m;
  const double area = nozzle * (q < 0.0 ? outlets : inlets);
  const double k = water_density_kg_m3 / area;
  return {q, -k * q * std::abs(q), -2.0 * k * std::abs(q)};
}

void JetLoad::Scale(const Mismatch& m) { nozzle_radius_m /= std::sqrt(m.jet); }

void JetLoad::AddForces(const ShellMotion& m, ShellForces* f) const {
  const Jet jet = Evaluate(Flux(m));
  *f->flux_m3_s = jet.flux_m3_s;
  *f->thrust_n = jet.thrust_n;
  for (int j = 0; j < m.shell.node_count(); ++j) {
    f->node[j](1) += jet.thrust_n * m.shell.thrust_share[j];
  }
  f->root[5] += jet.thrust_n;
}

void JetLoad::AddTangent(const ShellMotion& m, ShellTangent* t) const {
  if (!(t->s > 0.0)) return;
  const double c = Evaluate(Flux(m)).thrust_by_flux;
  for (int j = 0; j < m.shell.node_count(); ++j) {
    (*t->column)(3 * j + 1, kBorder) = -m.shell.thrust_share[j];
    (*t->row)(3 * j, kBorder) = -c * t->s * t->volume_gradient[j](0);
    if (flux == FluxReading::kVolume) {
      (*t->row)(3 * j + 1, kBorder) = -c * t->s * t->volume_gradient[j](1);
    }
  }
  (*t->base_column)(0, kBorder) = -1.0;
}

void JetLoad::AddPower(const ShellMotion& m, const Vector6& working_twist, double* power_w) const {
  double speed = working_twist(5);
  for (int j = 0; j < m.shell.node_count(); ++j) {
    speed += m.shell.thrust_share[j] * m.rate(j)(1);
  }
  power_w[place] += Evaluate(Flux(m)).thrust_n * speed;
}

double AxialDragLoad::Force(double max_radius_m, double speed) const {
  return -0.5 * water_density_kg_m3 * coefficient * kPi * max_radius_m * max_radius_m * speed *
         std::abs(speed);
}

double AxialDragLoad::ForceBySpeed(double max_radius_m, double speed) const {
  return -water_density_kg_m3 * coefficient * kPi * max_radius_m * max_radius_m * std::abs(speed);
}

void AxialDragLoad::AddForces(const ShellMotion& m, ShellForces* f) const {
  const double drag = *f->drag_n = Force(m.max_radius_m, m.mean_axial_speed_m_s);
  for (int j = 0; j < m.shell.node_count(); ++j) {
    f->node[j](1) += drag * m.shell.nodes[j].area_m2 / m.shell.area_m2;
  }
  f->root[5] += drag;
}

void AxialDragLoad::AddTangent(const ShellMotion& m, ShellTangent* t) const {
  if (!(t->s > 0.0) && !t->at_rest) return;
  const double d = ForceBySpeed(m.max_radius_m, m.mean_axial_speed_m_s);
  for (int j = 0; j < m.shell.node_count(); ++j) {
    const double share = m.shell.nodes[j].area_m2 / m.shell.area_m2;
    (*t->column)(3 * j + 1, kBorder) = -share;
    (*t->row)(3 * j + 1, kBorder) = -d * t->s * share;
  }
  if (t->at_rest && m.max_radius_m > 0.0) {  // the widest section sets the area
    int widest = 0;
    for (int j = 1; j < m.shell.node_count(); ++j) {
      if (m.shape[j](0) > m.shape[widest](0)) widest = j;
    }
    (*t->row)(3 * widest, kBorder) -=
        2.0 * Force(m.max_radius_m, m.mean_axial_speed_m_s) / m.max_radius_m;
  }
  (*t->base_column)(0, kBorder) = -1.0;
  (*t->base_row)(0, kBorder) = -d * t->s;
}

void AxialDragLoad::AddPower(const ShellMotion& m, const Vector6& working_twist,
                             double* power_w) const {
  const double carried = working_twist(5) - m.root.twist(5);
  power_w[place] +=
      Force(m.max_radius_m, m.mean_axial_speed_m_s) * (m.mean_axial_speed_m_s + carried);
}

Vector6 LateralDragLoad::Wrench(const std::vector<Vector3>& q, const Vector6& root_twist) const {
  Vector6 w = Vector6::Zero();
  for (std::size_t i = 0; i + 1 < q.size(); ++i) {
    const double r = 0.5 * (q[i](0) + q[i + 1](0));
    const double z = 0.5 * (q[i](1) + q[i + 1](1));
    const double height = std::abs(q[i + 1](1) - q[i](1));
    AddLateralDragSlice(water_density_kg_m3 * coefficient * r * height, z, root_twist, &w);
  }
  return w;
}

void LateralDragLoad::AddForces(const ShellMotion& m, ShellForces* f) const {
  Eigen::Map<Vector6>(f->root) += Wrench(m.shape, m.root.twist);
}

void LateralDragLoad::AddPower(const ShellMotion& m, const Vector6& working_twist,
                               double* power_w) const {
  power_w[place] += Wrench(m.shape, m.root.twist).dot(working_twist);
}

Vector3 WallGravityLoad::SurfaceForce(const Eigen::Quaterniond& root_rotation,
                                      double field_scale) const {
  const double net = body_density_kg_m3 - water_density_kg_m3;
  return field_scale * 2.0 * half_thickness_m * net * (root_rotation.conjugate() * gravity_m_s2);
}

void WallGravityLoad::Name(const std::string&, PowerNames* names) {
  if (body_density_kg_m3 != 0.0) weight_place = names->Place(kWeightName);
  if (water_density_kg_m3 != 0.0) buoyancy_place = names->Place(kBuoyancyName);
}

void WallGravityLoad::AddForces(const ShellMotion& m, ShellForces* f) const {
  const Vector3 g = SurfaceForce(m.root.rotation, m.field_scale);
  double moment = 0;
  for (int j = 0; j < m.shell.node_count(); ++j) {
    if (m.exact) f->node[j](1) += g.z() * m.shell.nodes[j].area_m2;
    moment += m.shell.nodes[j].area_m2 * m.shape[j](1);
  }
  f->root[0] -= moment * g.y();
  f->root[1] += moment * g.x();
  Eigen::Map<Vector3>(f->root + 3) += m.shell.area_m2 * g;
}

void WallGravityLoad::AddPower(const ShellMotion& m, const Vector6& working_twist,
                               double* power_w) const {
  const Vector3 g = m.field_scale * (m.root.rotation.conjugate() * gravity_m_s2);
  const Vector6& v = working_twist;
  double moment = 0, axial = 0;
  for (int j = 0; j < m.shell.node_count(); ++j) {
    moment += m.shell.nodes[j].area_m2 * m.shape[j](1);
    if (m.exact) axial += m.shell.nodes[j].area_m2 * m.rate(j)(1);
  }
  const double fall = 2.0 * half_thickness_m *
                      (m.shell.area_m2 * g.dot(v.tail<3>()) +
                       moment * (g.x() * v(1) - g.y() * v(0)) + g.z() * axial);
  if (weight_place >= 0) power_w[weight_place] += body_density_kg_m3 * fall;
  if (buoyancy_place >= 0) power_w[buoyancy_place] += -water_density_kg_m3 * fall;
}

void OutflowLoad::AddForces(const ShellMotion& m, ShellForces* f) const {
  Eigen::Map<Vector6>(f->root) += OutflowWrench(m.inertia, m.shape.back()(1), m.root.twist);
}

void OutflowLoad::AddPower(const ShellMotion& m, const Vector6& working_twist,
                           double* power_w) const {
  const Vector6& v = m.root.twist;
  const double u1 = v(3) + v(1) * m.inertia.centroid_m;
  const double u2 = v(4) - v(0) * m.inertia.centroid_m;
  power_w[place] += OutflowWrench(m.inertia, m.shape.back()(1), v).dot(working_twist) -
                    0.5 * m.inertia.contained_rate_kg_s * (u1 * u1 + u2 * u2);
}

std::optional<NormalPressureLoad> NormalPressureLoad::From(const Mantle&, const Water&,
                                                           const Effects& effects) {
  if (!effects.normal_pressure) return std::nullopt;
  return NormalPressureLoad{};
}

std::optional<JetLoad> JetLoad::From(const Mantle& mantle, const Water& water,
                                     const Effects& effects) {
  if (!effects.jet_thrust) return std::nullopt;
  return JetLoad{water.density_kg_m3, mantle.nozzle_radius_m, mantle.outlets, mantle.inlets,
                 effects.jet_thrust->flux};
}

std::optional<AxialDragLoad> AxialDragLoad::From(const Mantle& mantle, const Water& water,
                                                 const Effects& effects) {
  if (!effects.drag) return std::nullopt;
  return AxialDragLoad{water.density_kg_m3, mantle.drag_coefficient};
}

std::optional<LateralDragLoad> LateralDragLoad::From(const Mantle&, const Water& water,
                                                     const Effects& effects) {
  if (!effects.lateral_drag) return std::nullopt;
  return LateralDragLoad{water.density_kg_m3, effects.lateral_drag->coefficient};
}

std::optional<WallGravityLoad> WallGravityLoad::From(const Mantle& mantle, const Water& water,
                                                     const Effects& effects) {
  if (!effects.weight && !effects.buoyancy) return std::nullopt;
  return WallGravityLoad{effects.gravity_m_s2, mantle.half_thickness_m,
                         effects.weight ? mantle.material.density_kg_m3 : 0.0,
                         effects.buoyancy ? water.density_kg_m3 : 0.0};
}

std::optional<WallWaterAccelerationLoad> WallWaterAccelerationLoad::From(const Mantle& mantle,
                                                                         const Water& water,
                                                                         const Effects& effects) {
  if (!effects.unsteady_current) return std::nullopt;
  return WallWaterAccelerationLoad{mantle.half_thickness_m, mantle.material.density_kg_m3,
                                   water.density_kg_m3};
}

std::optional<OutflowLoad> OutflowLoad::From(const Mantle&, const Water&, const Effects& effects) {
  if (!effects.contained_water) return std::nullopt;
  return OutflowLoad{};
}

std::vector<MantleLoad> MantleLoads(const Mantle& mantle, const Water& water,
                                    const Effects& effects) {
  std::vector<MantleLoad> loads;
  AddLoads<MantleLoad, NormalPressureLoad, JetLoad, AxialDragLoad, LateralDragLoad, WallGravityLoad,
           OutflowLoad, WallWaterAccelerationLoad>(&loads, mantle, water, effects);
  return loads;
}

}  // namespace mantle::model
