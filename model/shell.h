#pragma once

#include <string>
#include <vector>

#include "model/robot.h"
#include "model/shell_element.h"

/// @file
/// The mantle discretised, and everything about its water that depends on the profile alone
/// ([physics.md] 3).

namespace mantle::model {

/// A node of the mantle with the mass and inertia that are lumped on it, all around.
struct ShellNode {
  double x_m{0};      ///< arc length of the meridian
  double area_m2{0};  ///< integral of the node's shape function over the reference surface
  double mass_kg{0};  ///< rho 2h times area, without water
  Vector3 inertia{Vector3::Zero()};  ///< diagonal: (1+B) m, (1+B) m, J m [kg, kg, kg m^2]
  Vector3 held{Vector3::Zero()};     ///< 1 where the coordinate is held, 0 where it is free
};

/// Radial loads on a strip: nodal areas of the strip (zero outside).
struct StripWeights {
  std::string name;
  std::vector<double> area_m2;  ///< per node
  double total_m2{0};
};

/// A set of spokes on the mantle's mesh.
struct ShellSpokes {
  StripWeights strip;
  int spokes;               ///< how many, n
  double rest_length_m{0};  ///< n times the mean r of the strip
  CableDrive drive;
  int power_place{-1};  ///< see PowerNames
};

/// A strip under pressure on the mantle's mesh.
struct ShellStrip {
  StripWeights strip;
  Schedule pressure_pa;  ///< inwards, a dead load
  int power_place{-1};   ///< see PowerNames
};

/// The mantle discretised: nodes (r, z, theta), masses lumped with linear shape functions (total
/// mass exact). z is from the root's origin along e3, theta the meridian's slope from e_r towards
/// e3.
struct Shell {
  std::string name;
  ShellMaterial material;
  std::vector<ShellElement> elements;
  std::vector<ShellNode> nodes;
  std::vector<Vector3> reference;    ///< (r, z, theta) at rest [m, m, rad]
  double area_m2{0};                 ///< of the reference surface
  double mass_kg{0};                 ///< of the wall
  double added_mass_factor{0};       ///< B_s where added mass is named, else 0
  double rest_volume_m3{0};          ///< enclosed, at rest
  std::vector<double> thrust_share;  ///< per node: share of the jet's thrust it carries
  double thrust_share_root{0};       ///< and the root's (the hole in the dome)
  std::vector<ShellStrip> strips;
  std::vector<ShellSpokes> spokes;

  int element_count() const { return static_cast<int>(elements.size()); }
  int node_count() const { return static_cast<int>(nodes.size()); }
};

/// Throws BadRobot.
Shell MakeShell(const Mantle& mantle, const Water& water, const Effects& effects);

/// Enclosed volume U = -integral of pi r^2 z' dX [m^3], exact for the piecewise linear profile.
double ShellVolume(const std::vector<Vector3>& q);
/// dU/d(r, z, theta) per node.
void ShellVolumeGradient(const std::vector<Vector3>& q, std::vector<Vector3>* gradient);
/// Volume that a unit rate of (r, z) makes the wall sweep: dU without what the end planes sweep.
/// Times a pressure it is the force of that pressure on the wall alone (no gradient of a function
/// of q where an end's radius is free).
void ShellWallVolumeGradient(const std::vector<Vector3>& q, std::vector<Vector3>* gradient);

}  // namespace mantle::model
