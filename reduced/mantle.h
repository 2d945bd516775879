#pragma once

#include <vector>

#include "model/failure.h"
#include "model/mantle_loads.h"
#include "reduced/arm_dynamics.h"
#include "reduced/polynomial.h"

/// @file
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
  Eigen::MatrixXd shapes;                      ///< 3 nodes x k: (r, z, theta) per node
  std::vector<Eigen::VectorXd> equilibria;     ///< s along the static path, for training
  Eigen::VectorXd scale;                       ///< size of each coordinate on that path
  double reach_pa{0};                          ///< largest pressure of that path
  std::vector<double> mode_frequencies_rad_s;  ///< of the vibration modes among the shapes
};

/// An element of the shell whose stresses are evaluated, weighted for those that are not. The
/// element's y (model::ShellElementState) is affine in s: y = rest + rows s.
struct CubatureElement {
  int index{0};                                   ///< of the profile's
  model::ShellElement element;                    ///< its area scaled by the cubature's weight
  model::Vector5 rest;                            ///< y at s = 0
  Eigen::Matrix<double, 5, Eigen::Dynamic> rows;  ///< dy/ds
};

/// A piece of the profile that feels lateral drag: r, z and height, affine in s.
struct LateralSlice {
  double r, z, height;               ///< at s = 0 [m]
  VectorX r_row, z_row, height_row;  ///< their derivatives in s
};

/// The mantle reduced: the constants of the equations of reduced/mantle.h, made by
/// MakeReducedMantle. There are `size` coordinates s, with the unit kg^(1/2) m; a vector or row
/// with an entry per coordinate is a derivative in s.
struct ReducedMantle {
  int size{0};  ///< number of coordinates
  MantleShapes basis;
  std::vector<Vector3> reference;  ///< (r, z, theta) per node at s = 0 [m, m, rad]
  model::ShellMaterial material;
  std::vector<CubatureElement> elements;  ///< those that are evaluated
  double cubature_residual{0};            ///< share by which they miss the whole mesh
  VectorX axial_coupling;                 ///< c_z
  VectorX mean_axial;                     ///< of the area-averaged axial speed
  VectorX thrust;                         ///< of the thrust's distribution
  VectorX axial_area;                     ///< integral of the axial shape over the area
  double axial_moment{0};                 ///< integral of z over the area, at s = 0
  std::vector<VectorX> strips;            ///< integral of the radial shapes over each strip
  /// A set of spokes: its cable's length is affine in s.
  struct Spokes {
    double length_m;   ///< at s = 0
    VectorX gradient;  ///< of the length in s
  };
  std::vector<Spokes> spokes;
  Eigen::MatrixXd radius_rows;       ///< dr/ds, nodes x k
  VectorX radius_rest;               ///< r of the nodes at s = 0 [m]
  double lip_z{0};                   ///< at s = 0 [m]
  VectorX lip_z_row;                 ///< its derivative in s
  std::vector<LateralSlice> slices;  ///< where the scene names lateral drag

  /// Polynomials: what each output is, or -1 where the scene has no use for it.
  Polynomials polynomials;
  int volume{-1}, moment1{-1}, flux{-1}, wall{-1};  ///< flux, wall: first of `size` outputs
  int inertia[4]{-1, -1, -1, -1};                   ///< L0, L1, L2, roll
  Matrix6 inertia_pattern[4];                       ///< Gamma_i
  Matrix6 axial_pattern;                            ///< times sum m (1 + B)
  double axial_mass_kg{0};                          ///< sum m (1 + B)

  std::vector<model::MantleLoad> loads;               ///< the plant's
  double area_m2{0};                                  ///< of the reference surface
  double water_density_kg_m3{0}, solid_volume_m3{0};  ///< as MantleWaterOptions
};

/// What the mantle's evaluation reads: pointers into the model's state and inputs.
struct MantleMotion {
  const double *s, *s_dot, *s_ddot;       ///< `size` each
  Vector6 root_twist, root_acceleration;  ///< body frame [rad/s, m/s; rad/s^2, m/s^2]
  Eigen::Quaterniond root_rotation;       ///< root to world
  double field_scale;                     ///< of loads of a field
  const model::CableInput* spokes;        ///< the mantle's, in order
  const double* strips_pa;                ///< in order, inward
  double normal_pressure_pa;              ///< inside minus outside
  Vector3 water_acceleration_m_s2{Vector3::Zero()};
};

/// Everything that one evaluation of the mantle computes; allocated once by the constructor.
struct MantleWork {
  explicit MantleWork(const ReducedMantle& mantle);

  std::vector<model::ShellElementState> elements;  ///< as ReducedMantle::elements
  Polynomials polynomials;                         ///< own copy: evaluation writes its monomials
  PolynomialValues values;                         ///< of `polynomials` at s
  VectorX residual;                                ///< R_s
  Vector6 root_wrench;                             ///< R_root
  std::vector<double> cable_length_m, cable_rate_m_s, cable_tension_n;  ///< of the spokes, in order
  double volume_m3{0}, volume_rate_m3_s{0}, flux_m3_s{0}, thrust_n{0};  ///< U, U_dot; Q, T
  /// dT/dQ [N s/m^3]; the axial drag's speed and force; largest radius; energy of the elements.
  double thrust_by_flux{0}, axial_speed_m_s{0}, drag_n{0}, max_radius_m{0}, elastic_j{0};
  int widest{0};   ///< node of the largest radius
  VectorX radius;  ///< r of the nodes [m]
  /// Contained water: mass, centroid, and the gradients of both.
  double water_kg{0}, water_rate_kg_s{0}, centroid_m{0}, centroid_rate_m_s{0};
  VectorX water_gradient, centroid_gradient;  ///< in s
  Eigen::MatrixXd centroid_hessian;           ///< in s
  VectorX column, row;                        ///< scratch
};

/// Why the shape cannot be evaluated, if so; the body is the caller's to name.
model::EvaluationFailure EvaluateMantle(const ReducedMantle& mantle, const MantleMotion& motion,
                                        MantleWork* work);
void LineariseMantle(const ReducedMantle& mantle, const MantleMotion& motion, int first,
                     MantleWork* work, Linearisation* out);

}  // namespace mantle::reduced
