#include "model/mantle_loads.h"

#include <cmath>
#include <numbers>

#include "model/rigid_body.h"

namespace mantle::model {
namespace {

constexpr double kPi = std::numbers::pi;

}  // namespace

Jet EvaluateJet(const Mantle& mantle, double water_density_kg_m3, double flux_m3_s) {
  const double nozzle = kPi * mantle.nozzle_radius_m * mantle.nozzle_radius_m;
  const double area = nozzle * (flux_m3_s < 0.0 ? mantle.outlets : mantle.inlets);
  const double k = water_density_kg_m3 / area;
  return {flux_m3_s, -k * flux_m3_s * std::abs(flux_m3_s), -2.0 * k * std::abs(flux_m3_s)};
}

double MantleDrag(const Mantle& mantle, double water_density_kg_m3, double max_radius_m,
                  double speed) {
  return -0.5 * water_density_kg_m3 * mantle.drag_coefficient * kPi * max_radius_m * max_radius_m *
         speed * std::abs(speed);
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

Vector6 MantleLateralDrag(const std::vector<Vector3>& q, double water_density_kg_m3,
                          double coefficient, const Vector6& root_twist) {
  Vector6 w = Vector6::Zero();
  for (std::size_t i = 0; i + 1 < q.size(); ++i) {
    const double r = 0.5 * (q[i](0) + q[i + 1](0));
    const double z = 0.5 * (q[i](1) + q[i + 1](1));
    const double height = std::abs(q[i + 1](1) - q[i](1));
    AddLateralDragSlice(water_density_kg_m3 * coefficient * r * height, z, root_twist, &w);
  }
  return w;
}

Vector6 RigidBodyDrag(const RigidBody& body, const RigidDrag& drag, double water_density_kg_m3,
                      const Vector6& root_twist) {
  const RigidDragGeometry g = DragGeometry(body, drag);
  Vector6 w = Vector6::Zero();
  const double k = 0.5 * water_density_kg_m3;
  AddLateralDragSlice(k * drag.lateral_coefficient * g.lateral_area_m2, g.height_m, root_twist, &w);
  w(5) -= k * drag.axial_coefficient * g.axial_area_m2 * root_twist(5) * std::abs(root_twist(5));
  return w;
}

Matrix6 RigidBodyDragTangent(const RigidBody& body, const RigidDrag& drag,
                             double water_density_kg_m3, const Vector6& root_twist) {
  const RigidDragGeometry g = DragGeometry(body, drag);
  Matrix6 t = Matrix6::Zero();
  Vector6 by_z = Vector6::Zero(), by_k = Vector6::Zero();
  const double k = 0.5 * water_density_kg_m3;
  AddLateralDragSliceTangent(k * drag.lateral_coefficient * g.lateral_area_m2, g.height_m,
                             root_twist, &t, &by_z, &by_k);
  t(5, 5) -= 2.0 * k * drag.axial_coefficient * g.axial_area_m2 * std::abs(root_twist(5));
  return t;
}

Vector6 RollDragWrench(const RollDrag& drag, const Vector6& root_twist) {
  Vector6 w = Vector6::Zero();
  w(2) = -drag.coefficient_n_m_s2 * root_twist(2) * std::abs(root_twist(2));
  return w;
}

Matrix6 RollDragTangent(const RollDrag& drag, const Vector6& root_twist) {
  Matrix6 t = Matrix6::Zero();
  t(2, 2) = -2.0 * drag.coefficient_n_m_s2 * std::abs(root_twist(2));
  return t;
}

}  // namespace mantle::model
