#pragma once

#include <Eigen/Core>

#include "model/lie.h"

/// @file
/// One element of the axisymmetric Reissner shell: two nodes (r, z, theta), linear between them,
/// one quadrature point in the middle ([physics.md] 3). Per unit reference area, with J = h^2/3:
///
///   W = E h/(1-nu^2) [e11^2 + 2 nu e11 e22 + e22^2 + J (d11^2 + 2 nu d11 d22 + d22^2)] +
///       h G beta^2
///   R = 3 eta h/(1-nu^2) [the same form in strain rates] + h eta beta_dot^2    (power lost: 2 R)
///   e11 = (lambda^2 + beta^2 - 1)/2 = (r'^2 + z'^2 - 1)/2,   e22 = (r^2/r*^2 - 1)/2,
///   d11 = mu* - mu lambda,   d22 = sin(theta*)/r* - r sin(theta)/r*^2,
///   lambda = r' cos(theta) + z' sin(theta),  beta = -r' sin(theta) + z' cos(theta),  mu = theta'.
///
/// Nodal forces are -dW/dq - dR/dq_dot times the element's reference area, so N_X, N_phi, M_X,
/// M_phi and H of [Renda] eq. 8 (with errata 9, 11) are the conjugates of W by construction.
///
/// X-derivatives are taken along the reference chord and theta* is the chord's direction, so that
/// the discrete reference shape is free of stress.

namespace mantle::model {

using Vector5 = Eigen::Matrix<double, 5, 1>;
using Matrix5 = Eigen::Matrix<double, 5, 5>;

/// The wall's law: half its thickness h, and E, nu, G, eta.
struct ShellMaterial {
  double half_thickness_m{0};
  double young_pa{0}, poisson{0}, shear_pa{0};
  double viscosity_pa_s{0};  ///< zero without the effect
};

/// What is constant of an element: its reference shape.
struct ShellElement {
  double chord{0};   ///< reference chord [m]
  double area{0};    ///< reference area, all around [m^2]
  double radius{0};  ///< r* at the midpoint [m]
  double theta{0};   ///< theta* at the midpoint (chord direction) [rad]
  double sine{0};    ///< sin(theta*)
  double mu{0};      ///< mu* [rad/m]
};

/// Strains in the order e11, e22, d11, d22, beta; y = (r', z', mu, r, theta) at the midpoint.
struct ShellElementState {
  Vector5 y, y_dot;             ///< [1, 1, rad/m, m, rad], and per second
  Vector5 strain, strain_rate;  ///< [1, 1, 1/m, 1/m, 1], and per second
  Vector5 elastic, viscous;     ///< dW/d strain, dR/d rate [N/m, N/m, N, N, N/m]
  double sine, cosine;          ///< of the midpoint theta
  double lambda;                ///< stretch along the meridian
};

void EvaluateShellElement(const ShellElement& e, const ShellMaterial& m, const Vector3& q1,
                          const Vector3& q2, const Vector3& v1, const Vector3& v2,
                          ShellElementState* state);

/// The same from y and y_dot, which the caller has set in `state`.
void EvaluateShellStrains(const ShellElement& e, const ShellMaterial& m, ShellElementState* state);

/// Force conjugate to y, over the element: -area g^T (elastic + viscous), g = d strain / d y.
Vector5 ShellStrainForce(const ShellElement& e, const ShellElementState& s);
/// -d(ShellStrainForce)/dy and -d(ShellStrainForce)/dy_dot.
void ShellStrainTangents(const ShellElement& e, const ShellMaterial& m, const ShellElementState& s,
                         Matrix5* stiffness, Matrix5* damping);

/// Adds the nodal forces (r: N, z: N, theta: N m; all around) to f1, f2.
void AddShellElementForces(const ShellElement& e, const ShellElementState& s, Vector3* f1,
                           Vector3* f2);

/// Blocks of -(df/dq + damping_scale df/dv).
struct ShellElementTangent {
  Matrix3 a11, a12, a21, a22;  ///< row: the node whose force, column: the node that moves
};
void ShellElementTangents(const ShellElement& e, const ShellMaterial& m, const ShellElementState& s,
                          double damping_scale, ShellElementTangent* out);

/// Stored energy [J], rate of change of it [W], and dissipated power 2 R [W] of the element.
double ShellElementEnergy(const ShellElement& e, const ShellElementState& s);
double ShellElementStressPower(const ShellElement& e, const ShellElementState& s);
double ShellElementDissipation(const ShellElement& e, const ShellElementState& s);

}  // namespace mantle::model
