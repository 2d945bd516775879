#pragma once

#include <vector>

#include "model/robot.h"

/// Sections of an arm by their outline, at any arc length: geometry, mass and stiffness of round,
/// hollow and rectangular pieces. Axes: x along the arm, y and z in the section.
///
///   round:        A = pi (R^2 - r^2),  I_y = I_z = pi (R^4 - r^4) / 4,  J_t = 2 I_y
///   rectangular:  A = b h,  I_y = int z^2 = b h^3 / 12,  I_z = int y^2 = h b^3 / 12,
///                 J_t = a c^3 / 3 (1 - 192 c / (pi^5 a) sum_{n odd} tanh(n pi a / 2c) / n^5),
///                 a the longer, c the shorter side (Timoshenko & Goodier, Theory of Elasticity,
///                 art. 109)
///   Sigma = diag(G J_t, E I_y, E I_z, E A, k G A, k G A)
///   inertia rho diag(I_y + I_z, I_y, I_z, A, A, A)
///   viscosity eta diag(J_t, 3 I_y, 3 I_z, 3 A, A, A)                          ([Renda] eq. 7)
///
/// A hollow section is closed: it displaces what its outline encloses, or (flooded) its wall.

namespace mantle::model {

struct SectionArea {
  double solid_m2{0}, displaced_m2{0};
  double second_y_m4{0}, second_z_m4{0}, torsion_m4{0};
  double radius_m{0};                   ///< of the circle that drag and cables refer to
  Vector3 drag_shape{Vector3::Ones()};  ///< SectionGeometry
};
SectionArea AreaOf(const ArmPiece& piece, double share);

/// G J_t of a rectangle over G.
double RectangleTorsion(double width_m, double height_m);

/// Pieces of an arm; one of its own keys where it names none.
std::vector<ArmPiece> PiecesOf(const Arm& arm);

/// The piece at arc length x and how far along it, in [0, 1].
struct PiecePlace {
  const ArmPiece& piece;
  double share;
};
PiecePlace PieceAt(const std::vector<ArmPiece>& pieces, double x_m);

/// Arc lengths inside the arm where one piece ends and the next begins; `nodes` only those that
/// nodes stand on.
std::vector<double> PieceBorders(const Arm& arm, bool nodes);
/// Whether strains are held at zero there.
bool IsRigidAt(const Arm& arm, double x_m);

/// A rigid piece is this many times as stiff, in every strain, as the stiffest flexible section of
/// its arm; the reduced model gives it no strains at all.
inline constexpr double kRigidFactor = 1e6;

Matrix6 PieceStiffness(const ArmPiece& piece, double share);
Vector6 PieceViscosity(const ArmPiece& piece, double share);
Vector6 PieceInertia(const ArmPiece& piece, double share);

/// Throws BadRobot where a piece cannot be: names the piece, the value and the bound.
void CheckPieces(const Arm& arm);

}  // namespace mantle::model
