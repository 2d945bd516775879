#pragma once

#include "model/plant.h"

/// Loads on the mantle and on the root: pure functions of profile, rates and root twist, evaluated
/// once and shared by plant, energy accounts and reduced model ([Renda] 2.6, [physics.md] 3).

namespace mantle::model {

/// Jet thrust along +e3, T = -rho_w Q |Q| / A_n; Q = U_dot, or the part of it that the wall's
/// radial velocity makes; A_n = outlets pi h_n^2 for Q < 0, inlets pi h_n^2 for Q > 0 (erratum 10).
struct Jet {
  double flux_m3_s, thrust_n;
  double thrust_by_flux;  ///< dT/dQ [N s/m^3]
};
Jet EvaluateJet(const Mantle& mantle, double water_density_kg_m3, double flux_m3_s);

/// Drag along e3, -1/2 rho_w C_d pi max(r)^2 V |V|, V the area average of the absolute axial speed.
double MantleDrag(const Mantle& mantle, double water_density_kg_m3, double max_radius_m,
                  double speed);

/// Lateral strip-theory drag of the mantle on its current profile as a wrench about the root
/// origin: force per height -1/2 rho_w C 2 r |u| u, u the lateral velocity of the axis at z.
Vector6 MantleLateralDrag(const std::vector<Vector3>& q, double water_density_kg_m3,
                          double coefficient, const Vector6& root_twist);

/// One slice of it, k |u| u at height z, and the derivatives of its wrench in the twist, in z and
/// in k. The wrench and each derivative are added to.
void AddLateralDragSlice(double k, double z_m, const Vector6& root_twist, Vector6* wrench);
void AddLateralDragSliceTangent(double k, double z_m, const Vector6& root_twist, Matrix6* by_twist,
                                Vector6* by_z, Vector6* by_k);

/// Quadratic drag of the rigid body, as a wrench about the root origin.
Vector6 RigidBodyDrag(const RigidBody& body, const RigidDrag& drag, double water_density_kg_m3,
                      const Vector6& root_twist);

Matrix6 RigidBodyDragTangent(const RigidBody& body, const RigidDrag& drag,
                             double water_density_kg_m3, const Vector6& root_twist);

/// -c omega3 |omega3| about e3.
Vector6 RollDragWrench(const RollDrag& drag, const Vector6& root_twist);
Matrix6 RollDragTangent(const RollDrag& drag, const Vector6& root_twist);

}  // namespace mantle::model
