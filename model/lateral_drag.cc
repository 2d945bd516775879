#include "model/lateral_drag.h"

#include <cmath>

namespace mantle::model {

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
