#pragma once

#include "model/lie.h"
#include "model/rod_middle.h"

/// @file
/// One element of a Cosserat rod between two nodal poses, with constant strain.
///
///   d = log(g1^-1 g2),   xi = d / l,   d_dot = Jr^-1(d) eta2 - Jl^-1(d) eta1     ([Renda] eq. 3)
///   sigma = Sigma (xi - xi*) + Upsilon xi_dot + cable resultants                 ([Renda] eq. 7)
///   forces on the nodes: f2 = -Jr^-T sigma, f1 = +Jl^-T sigma
/// so that f1 . eta1 + f2 . eta2 = -sigma . d_dot: the power balance is exact for any d. Strain is
/// objective, a constant-strain (helical) field is represented exactly, and there is no shear
/// locking.
///
/// A force across the rod makes the bending moment vary along an element, which constant strain
/// leaves out: the ends then move against each other by l^3 / 12 EI per force, as they would by
/// shear. That is added to the shear's flexibility (residual bending flexibility; R. H. MacNeal, A
/// simple quadrilateral shell element, Comput. Struct. 8, 1978, 175-183),
///   1 / S_shear = 1 / GA + l^2 / 12 EI,
/// and makes a straight rod's nodes exact under forces on nodes. The shear that an element reports
/// contains it; `shear_share` of it is the section's own.

namespace mantle::model {

/// What is constant of an element: its length and the linear law of its section. Strains and their
/// diagonals are in the order torsion, bending y, z [rad/m], stretch, shear y, z [1].
struct RodElement {
  double length{0};                           ///< reference length l [m]
  Vector6 reference_strain{Vector6::Zero()};  ///< xi*
  Vector6 stiffness{Vector6::Zero()};         ///< diagonal of Sigma, mean over the element
  Vector6 viscosity{Vector6::Zero()};         ///< diagonal of Upsilon; zero without the effect
  Eigen::Vector2d shear_share{1, 1};          ///< of the section in the two shear strains
};

/// Adds the residual bending flexibility to the element's shear. Viscosity follows as that of two
/// Kelvin-Voigt bodies in series that move slowly beside their relaxation, U = S^2 sum U_i / S_i^2.
void AddResidualBending(RodElement* e);

/// Largest rotation across an element [rad]: beyond it the logarithm nears its branch cut at pi and
/// the mesh is far too coarse for the shape anyway. A state beyond is refused.
inline constexpr double kMaxElementRotation = 2.8;

/// What an element computes from its nodes' poses and twists.
struct RodElementState {
  RodElementState() : even(Vector6::Zero()) {}
  Vector6 d{Vector6::Zero()};      ///< log(g1^-1 g2) [rad, m]
  Vector6 d_dot{Vector6::Zero()};  ///< [rad/s, m/s]
  EvenTangentInverse even;         ///< E(d)
  RodMiddle middle;                ///< frame half-way

  Vector6 Strain(const RodElement& e) const { return d / e.length; }
  Vector6 StrainRate(const RodElement& e) const { return d_dot / e.length; }
};

/// Fills `state`; returns false if the element's rotation exceeds kMaxElementRotation or is not
/// finite.
bool EvaluateRodElement(const Pose& g1, const Pose& g2, const Vector6& eta1, const Vector6& eta2,
                        RodElementState* state);

/// sigma without cables.
inline Vector6 RodStress(const RodElement& e, const RodElementState& s) {
  return (e.stiffness.array() * (s.d / e.length - e.reference_strain).array() +
          e.viscosity.array() * s.d_dot.array() / e.length)
      .matrix();
}

/// Adds the nodal forces of stress `sigma` to f1 and f2.
inline void AddRodElementForces(const RodElementState& s, const Vector6& sigma, Vector6* f1,
                                Vector6* f2) {
  const Vector6 e = s.even.TransposeTimes(sigma);
  const Vector6 a = 0.5 * CoadjointTimes(s.d, sigma);
  *f1 += e - a;
  *f2 -= e + a;
}

/// Blocks of -(df/dzeta + damping_scale df/deta), for body increments g_i exp(zeta_i^) and twists.
struct RodElementTangent {
  Matrix6 a11, a12, a21, a22;  ///< row: the node whose force, column: the node that moves
};

/// `cable_tangent` (6x6) is d sigma_cable / d d; `rates` tells whether viscosity is active.
void RodElementTangents(const RodElement& e, const RodElementState& s, const Vector6& eta1,
                        const Vector6& eta2, const Vector6& sigma, const Matrix6* cable_tangent,
                        double damping_scale, RodElementTangent* out);

}  // namespace mantle::model
