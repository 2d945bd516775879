#pragma once

#include "model/lie.h"
#include "model/shell.h"

/// @file
/// Inertia of the mantle and its water under the root's motion ([physics.md] 4). The mantle
/// exchanges axial motion fully and moves with the root otherwise; with omega, v the root's body
/// twist, z from the root along e3 and m_j the nodal masses,
///
///   T = 1/2 sum_j m_j {(1+B) [r_dot^2 + (v3 + z_dot)^2 + 1/2 r^2 (omega1^2 + omega2^2) +
///                             r^2 omega3^2] + J theta_dot^2} + T_lateral,
///   T_lateral = 1/2 L0 (v1^2 + v2^2) + L1 (v1 omega2 - v2 omega1) + 1/2 L2 (omega1^2 + omega2^2),
///   L_k = sum_j f m_j z_j^k + A_k + W_k,
///   A_k = rho_w integral of pi r^2 z^k (-z') dX   [effect lateral_added_mass],
///   W_k = m_w z_c^k                               [effect contained_water]
/// with f = 1 + B, or 1 where lateral_added_mass replaces B_s laterally; m_w = rho_w (U - U_cone)
/// at the centroid z_c of the cavity U.

namespace mantle::model {

/// Which of the water's terms the lateral coefficients L_k have (mantle_inertia.h), and what those
/// need to know.
struct MantleWaterOptions {
  double water_density_kg_m3{0};
  bool lateral_added_mass{false};  ///< A_k
  bool contained_water{false};     ///< W_k
  double solid_volume_m3{0};       ///< of the rigid body inside the cavity
};

/// Moments of the cavity V_k = integral of pi r^2 z^k (-z') dX, k = 0, 1, 2, and their rates.
struct CavityMoments {
  double v[3]{0, 0, 0};     ///< V_k [m^3, m^4, m^5]
  double rate[3]{0, 0, 0};  ///< [m^3/s, m^4/s, m^5/s]
};

/// Coefficients of T at one profile, about the root's origin, and their rates where the profile
/// moves: from EvaluateMantleInertia.
struct MantleInertia {
  double axial{0};                  ///< sum m (1 + B) [kg]
  double lateral[3]{0, 0, 0};       ///< L0, L1, L2 [kg, kg m, kg m^2]
  double lateral_rate[3]{0, 0, 0};  ///< [kg/s, kg m/s, kg m^2/s]
  double pitch{0}, pitch_rate{0};   ///< sum m (1+B) r^2 / 2 [kg m^2], and rate
  double roll{0}, roll_rate{0};     ///< sum m (1+B) r^2 [kg m^2], and rate
  double axial_momentum{0};         ///< sum m (1+B) z_dot [kg m/s]
  double contained_kg{0}, contained_rate_kg_s{0}, centroid_m{0};  ///< m_w, its rate, z_c
};

CavityMoments EvaluateCavity(const std::vector<Vector3>& q, const Vector3* v);

MantleInertia EvaluateMantleInertia(const Shell& shell, const MantleWaterOptions& options,
                                    const std::vector<Vector3>& q, const Vector3* v);

/// Adds the mantle's 6x6 inertia about the root origin; with `rates` its time derivative instead.
void AddMantleInertia(const MantleInertia& m, bool rates, Matrix6* inertia);

/// Adds dT/dq for the root twist (centrifugal forces on the shape) to f (3 per node).
/// The contained water pushes the shape through its centroid only: a uniformly moving column exerts
/// no force by shrinking.
void AddCentrifugalForces(const Shell& shell, const MantleWaterOptions& options,
                          const MantleInertia& m, const CavityMoments& cavity,
                          const std::vector<Vector3>& q, const Vector6& root_twist, Vector3* f);

/// Wrench on the root (about its origin) by contained water that leaves with the lip's lateral
/// velocity; zero on inflow, which enters at rest ([physics.md] 3).
Vector6 OutflowWrench(const MantleInertia& m, double lip_z_m, const Vector6& root_twist);

}  // namespace mantle::model
