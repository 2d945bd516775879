#include "model/root_loads.h"

#include <cmath>

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

Vector6 RollDragLoad::Wrench(const SectionMotion& root) const {
  Vector6 w = Vector6::Zero();
  w(2) = -coefficient_n_m_s2 * root.twist(2) * std::abs(root.twist(2));
  return w;
}

void RollDragLoad::AddTangent(const SectionMotion& root, double scale, RootTangent* t) const {
  t->by_twist(2, 2) += scale * (-2.0 * coefficient_n_m_s2 * std::abs(root.twist(2)));
}

void RollDragLoad::AddPower(const SectionMotion& root, const Vector6& working_twist, double scale,
                            double* power_w) const {
  power_w[place] += scale * Wrench(root).dot(working_twist);
}

Vector6 RigidDragLoad::Wrench(const SectionMotion& root) const {
  const Vector6& v = root.twist;
  Vector6 w = Vector6::Zero();
  const double k = 0.5 * water_density_kg_m3;
  AddLateralDragSlice(k * lateral_coefficient * lateral_area_m2, height_m, v, &w);
  w(5) -= k * axial_coefficient * axial_area_m2 * v(5) * std::abs(v(5));
  return w;
}

void RigidDragLoad::AddTangent(const SectionMotion& root, double scale, RootTangent* t) const {
  const Vector6& v = root.twist;
  Matrix6 by_twist = Matrix6::Zero();
  Vector6 by_z = Vector6::Zero(), by_k = Vector6::Zero();
  const double k = 0.5 * water_density_kg_m3;
  AddLateralDragSliceTangent(k * lateral_coefficient * lateral_area_m2, height_m, v, &by_twist,
                             &by_z, &by_k);
  by_twist(5, 5) -= 2.0 * k * axial_coefficient * axial_area_m2 * std::abs(v(5));
  t->by_twist += scale * by_twist;
}

void RigidDragLoad::AddPower(const SectionMotion& root, const Vector6& working_twist, double scale,
                             double* power_w) const {
  power_w[place] += scale * Wrench(root).dot(working_twist);
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
  return RigidWaterAccelerationLoad{RigidMass(body),
                                    robot.water.density_kg_m3 * RigidVolume(body),
                                    RigidCentre(body)};
}

std::optional<RollDragLoad> RollDragLoad::From(const Robot& robot) {
  if (!robot.effects.roll_drag) return std::nullopt;
  return RollDragLoad{robot.effects.roll_drag->coefficient_n_m_s2};
}

std::optional<RigidDragLoad> RigidDragLoad::From(const Robot& robot) {
  if (!robot.effects.rigid_drag || !robot.rigid_body) return std::nullopt;
  const RigidDrag& drag = *robot.effects.rigid_drag;
  const RigidDragGeometry g = DragGeometry(*robot.rigid_body, drag);
  return RigidDragLoad{robot.water.density_kg_m3, drag.lateral_coefficient, drag.axial_coefficient,
                       g.lateral_area_m2,         g.axial_area_m2,          g.height_m};
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

void AddLateralDragSlice(double k, double z, const Vector6& twist, Vector6* w) {
  const double u1 = twist(3) + twist(1) * z;
  const double u2 = twist(4) - twist(0) * z;
  const double s = -k * std::sqrt(u1 * u1 + u2 * u2);
  (*w)(0) -= z * s * u2;
  (*w)(1) += z * s * u1;
  (*w)(3) += s * u1;
  (*w)(4) += s * u2;
}

void AddLateralDragSliceTangent(double k, double z, const Vector6& twist, Matrix6* by_twist,
                                Vector6* by_z, Vector6* by_k) {
  const double u1 = twist(3) + twist(1) * z;
  const double u2 = twist(4) - twist(0) * z;
  const double speed = std::sqrt(u1 * u1 + u2 * u2);
  if (speed == 0.0) return;  // differentiable there, with derivative zero
  AddLateralDragSlice(1.0, z, twist, by_k);
  // force (f1, f2) = -k |u| u by (u1, u2); moments (-z f2, z f1)
  const double a11 = -k * (speed + u1 * u1 / speed);
  const double a22 = -k * (speed + u2 * u2 / speed);
  const double a12 = -k * u1 * u2 / speed;
  Vector6 by_u1 = Vector6::Zero(), by_u2 = Vector6::Zero();
  by_u1 << -z * a12, z * a11, 0, a11, a12, 0;
  by_u2 << -z * a22, z * a12, 0, a12, a22, 0;
  by_twist->col(3) += by_u1;
  by_twist->col(1) += z * by_u1;
  by_twist->col(4) += by_u2;
  by_twist->col(0) -= z * by_u2;
  *by_z += twist(1) * by_u1 - twist(0) * by_u2;
  (*by_z)(0) += k * speed * u2;
  (*by_z)(1) -= k * speed * u1;
}

}  // namespace mantle::model
