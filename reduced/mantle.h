#pragma once

#include <vector>

#include "model/failure.h"
#include "model/mantle_loads.h"
#include "reduced/arm_dynamics.h"
#include "reduced/polynomial.h"

/// The mantle and its water in the coordinates s of MantleShapes, clamped to the root: projections
/// of model/shell_element.h, mantle_inertia.h and mantle_loads.h. With c_i(s) the root's inertia
/// functions (lateral L0, L1, L2, roll) and Gamma_i their constant 6x6 patterns,
///
///   T = 1/2 eta^T (M_0 + sum c_i(s) Gamma_i) eta + eta_6 c_z . s_dot + 1/2 |s_dot|^2,
///   R_s    = s_ddot + c_z eta_dot_6 - 1/2 sum grad c_i (eta^T Gamma_i eta) + stresses - loads,
///   R_root = d/dt (dT/d eta) - ad_eta^T dT/d eta - loads,
/// where contained water pushes the shape through its centroid only ([physics.md] 4).

namespace mantle::reduced {

/// More coordinates than that belong in the plant.
inline constexpr int kMaxMantleCoordinates = 8;

/// Shapes of the profile (reduced/build/mantle_basis.h).
struct MantleShapes {
  Eigen::MatrixXd shapes;                   ///< 3 nodes x k: (r, z, theta) per node
  std::vector<Eigen::VectorXd> equilibria;  ///< s along the static path, for training
  Eigen::VectorXd scale;                    ///< size of each coordinate on that path
  double reach_pa{0};                       ///< largest pressure of that path
  std::vector<double> mode_frequencies_rad_s;
};

struct CubatureElement {
  int index{0};                 ///< of the profile's
  model::ShellElement element;  ///< its area scaled by the cubature's weight
  model::Vector5 rest;
  Eigen::Matrix<double, 5, Eigen::Dynamic> rows;  ///< dy/ds
};

/// A piece of the profile that feels lateral drag: r, z and height, affine in s.
struct LateralSlice {
  double r, z, height;
  VectorX r_row, z_row, height_row;
};

struct ReducedMantle {
  int size{0};
  MantleShapes basis;
  std::vector<Vector3> reference;
  model::ShellMaterial material;
  std::vector<CubatureElement> elements;
  double cubature_residual{0};
  VectorX axial_coupling;  ///< c_z
  VectorX mean_axial;      ///< of the area-averaged axial speed
  VectorX thrust;          ///< of the thrust's distribution
  VectorX axial_area;      ///< integral of the axial shape over the area
  double axial_moment{0};  ///< integral of z over the area, at s = 0
  std::vector<VectorX> strips;
  struct Spokes {
    double length_m;
    VectorX gradient;
  };
  std::vector<Spokes> spokes;
  Eigen::MatrixXd radius_rows;  ///< nodes x k
  VectorX radius_rest;
  double lip_z{0};
  VectorX lip_z_row;
  std::vector<LateralSlice> slices;

  /// Polynomials: what each output is, or -1 where the scene has no use for it.
  Polynomials polynomials;
  int volume{-1}, moment1{-1}, flux{-1}, wall{-1};  ///< flux, wall: first of `size` outputs
  int inertia[4]{-1, -1, -1, -1};                   ///< L0, L1, L2, roll
  Matrix6 inertia_pattern[4];
  Matrix6 axial_pattern;  ///< times sum m (1 + B)
  double axial_mass_kg{0};

  std::vector<model::MantleLoad> loads;  ///< the plant's
  double area_m2{0};                     ///< of the reference surface
  double water_density_kg_m3{0}, solid_volume_m3{0};
};

struct MantleMotion {
  const double *s, *s_dot, *s_ddot;
  Vector6 root_twist, root_acceleration;
  Eigen::Quaterniond root_rotation;
  double field_scale;  ///< of loads of a field
  const model::CableInput* spokes;
  const double* strips_pa;
  double normal_pressure_pa;
  Vector3 water_acceleration_m_s2{Vector3::Zero()};
};

struct MantleWork {
  explicit MantleWork(const ReducedMantle& mantle);

  std::vector<model::ShellElementState> elements;
  Polynomials polynomials;  ///< own copy: evaluation writes its monomials
  PolynomialValues values;
  VectorX residual;     ///< R_s
  Vector6 root_wrench;  ///< R_root
  std::vector<double> cable_length_m, cable_rate_m_s, cable_tension_n;
  double volume_m3{0}, volume_rate_m3_s{0}, flux_m3_s{0}, thrust_n{0};
  double thrust_by_flux{0}, axial_speed_m_s{0}, drag_n{0}, max_radius_m{0}, elastic_j{0};
  int widest{0};  ///< node of the largest radius
  VectorX radius;
  /// Contained water: mass, centroid, and the gradients of both.
  double water_kg{0}, water_rate_kg_s{0}, centroid_m{0}, centroid_rate_m_s{0};
  VectorX water_gradient, centroid_gradient;
  Eigen::MatrixXd centroid_hessian;
  VectorX column, row;
};

/// Why the shape cannot be evaluated, if so; the body is the caller's to name.
model::EvaluationFailure EvaluateMantle(const ReducedMantle& mantle, const MantleMotion& motion,
                                        MantleWork* work);
void LineariseMantle(const ReducedMantle& mantle, const MantleMotion& motion, int first,
                     MantleWork* work, Linearisation* out);

}  // namespace mantle::reduced
