#include <algorithm>
#include <cmath>
#include <numbers>

#include "model/arm_check.h"
#include "model/arm_section.h"

/// Sections and cable paths of an arm at a given arc length, as the scene describes them.

namespace mantle::model {

double ArmRadius(const Arm& arm, double x) {
  if (!arm.pieces.empty()) {
    const PiecePlace at = PieceAt(arm.pieces, x);
    return AreaOf(at.piece, at.share).radius_m;
  }
  return arm.radius_base_m + (arm.radius_tip_m - arm.radius_base_m) * x / arm.length_m;
}

Vector6 ArmRestStrain(const Arm& arm, double x) {
  Vector6 xi;
  xi << arm.curvature_base + (arm.curvature_tip - arm.curvature_base) * (x / arm.length_m), 1, 0, 0;
  return xi;
}

namespace {

// Of a rigid piece: every strain kRigidFactor times as stiff as the arm's stiffest section.
Vector6 RigidStiffness(const Arm& arm) {
  Vector6 largest = Vector6::Zero();
  for (const ArmPiece& p : arm.pieces) {
    if (p.rigid) continue;
    for (const double share : {0.0, 1.0}) {
      largest = largest.cwiseMax(Vector6(PieceStiffness(p, share).diagonal()));
    }
  }
  return kRigidFactor * largest;
}

}  // namespace

Vector6 ArmStiffness(const Arm& arm, double x) {
  if (!arm.pieces.empty()) {
    const PiecePlace at = PieceAt(arm.pieces, x);
    return at.piece.rigid ? RigidStiffness(arm)
                          : Vector6(PieceStiffness(at.piece, at.share).diagonal());
  }
  if (arm.stiffness) return *arm.stiffness;
  return SectionStiffness(arm.material, arm.shear_correction, ArmRadius(arm, x));
}

Matrix6 ArmStiffnessCoupling(const Arm& arm, double x) {
  Matrix6 coupling = Matrix6::Zero();
  if (arm.pieces.empty()) return coupling;
  const PiecePlace at = PieceAt(arm.pieces, x);
  if (at.piece.rigid || !at.piece.stiffness) return coupling;
  coupling = *at.piece.stiffness;
  coupling.diagonal().setZero();
  return coupling;
}

Vector6 ArmViscosity(const Arm& arm, const Effects& effects, double x) {
  if (!effects.viscosity) return Vector6::Zero();
  if (!arm.pieces.empty()) {
    const PiecePlace at = PieceAt(arm.pieces, x);
    return at.piece.rigid ? Vector6(Vector6::Zero()) : PieceViscosity(at.piece, at.share);
  }
  if (arm.viscosity) return *arm.viscosity;
  return SectionViscosity(arm.material, ArmRadius(arm, x));
}

RodNode ArmSection(const Arm& arm, const Water& water, const Effects& effects, double x,
                   double weight) {
  RodNode node;
  node.weight_m = weight;
  if (!arm.pieces.empty()) {
    const PiecePlace at = PieceAt(arm.pieces, x);
    const SectionArea area = AreaOf(at.piece, at.share);
    node.section = {x, area.displaced_m2, area.radius_m, 0.0, area.drag_shape};
    node.inertia = weight * PieceInertia(at.piece, at.share);
    if (effects.added_mass) {
      node.added_mass_kg =
          weight * SectionAddedMass(water.density_kg_m3, arm.added_mass_coefficient, area.radius_m);
    }
  } else {
    const double radius = ArmRadius(arm, x);
    node.section = {x, std::numbers::pi * radius * radius, radius};
    node.inertia =
        weight * (arm.inertia ? *arm.inertia : SectionInertia(arm.material.density_kg_m3, radius));
    if (effects.added_mass) {
      node.added_mass_kg =
          weight * SectionAddedMass(water.density_kg_m3, arm.added_mass_coefficient, radius);
    }
  }
  if (weight > 0) node.section.density_kg_m3 = node.inertia(5) / (weight * node.section.area_m2);
  return node;
}

CablePiece ArmCablePath(const Arm& arm, const ArmCable& cable, double x) {
  if (!cable.path.empty()) {  // piecewise linear
    const auto after = std::upper_bound(cable.path.begin(), cable.path.end(), x,
                                        [](double at, const Vector3& p) { return at < p.x(); });
    if (after == cable.path.begin()) return {{0, after->y(), after->z()}, Vector3::Zero(), 1.0};
    const Vector3& a = *(after - 1);
    if (after == cable.path.end()) return {{0, a.y(), a.z()}, Vector3::Zero(), 1.0};
    const Vector3 slope = (*after - a) / (after->x() - a.x());
    const Vector3 at = a + (x - a.x()) * slope;
    return {{0, at.y(), at.z()}, {0, slope.y(), slope.z()}, 1.0};
  }
  const double angle_rate = 2.0 * std::numbers::pi * cable.turns / arm.length_m;
  const double angle = cable.angle_rad + angle_rate * x;
  const Vector3 along(0, std::cos(angle), std::sin(angle));
  const Vector3 across(0, -std::sin(angle), std::cos(angle));
  const double taper = (arm.radius_tip_m - arm.radius_base_m) / arm.length_m;
  const double r = cable.fraction * ArmRadius(arm, x);
  return {r * along, cable.fraction * taper * along + r * angle_rate * across, 1.0};
}

double CablePieceLength(const CablePiece& piece, const RodElement& e, const Vector6& d,
                        Vector6* gradient, Matrix6* hessian) {
  // Speed of the path in the section frame: gamma + kappa x offset + offset' ([physics.md] 2).
  const Vector3 speed = (d.tail<3>() + d.head<3>().cross(piece.offset_m)) / e.length + piece.slope;
  const double norm = speed.norm();
  const Vector3 t = speed / norm;
  if (gradient != nullptr) {
    *gradient << piece.share * piece.offset_m.cross(t), piece.share * t;
  }
  if (hessian != nullptr) {
    Eigen::Matrix<double, 3, 6> b;  // d speed / d (l xi), times l
    b << -Hat(piece.offset_m), Matrix3::Identity();
    const Matrix3 p = (Matrix3::Identity() - t * t.transpose()) * (piece.share / (norm * e.length));
    *hessian = b.transpose() * p * b;
  }
  return piece.share * e.length * norm;
}

}  // namespace mantle::model
