#pragma once

#include <vector>

#include "model/robot.h"

/// @file
/// The reference meridian of a mantle: r*(X), z*(X), theta*(X), built from lines and arcs, and the
/// nodes on it.   r*' = cos(theta*),  z*' = sin(theta*),  theta*' = curvature of the piece.

namespace mantle::model {

/// A point of the reference meridian: r*, z* in the root frame, and theta*, the slope from e_r
/// towards e3.
struct MeridianPoint {
  double r_m, z_m, theta_rad;
};

double MeridianLength(const Mantle& mantle);

/// Point at arc length x in [0, length].
MeridianPoint MeridianAt(const Mantle& mantle, double x_m);

/// Arc lengths of the elements + 1 nodes: piece ends, strip and spoke edges and stations are nodes;
/// element lengths grow linearly in X from the first to `grading` times as much at the far end.
/// Throws BadRobot if there are fewer elements than stretches between such points.
std::vector<double> MeridianNodes(const Mantle& mantle);

}  // namespace mantle::model
