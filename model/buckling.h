#pragma once

#include <string>
#include <vector>

#include "model/plant.h"

/// @file
/// Linear buckling: load factors lambda at which the stiffness about the reference shape, with the
/// stresses of the loads in proportion, has a direction without stiffness,
///
///   (K(0) + lambda K_g) x = 0,   K_g = (K(e) - K(-e)) / 2e,
///
/// K(e) at the equilibrium under the small load factor e (central: what the loads do to the shape
/// enters with (e / lambda)^2). 1 / lambda are the eigenvalues of -K(0)^-1 K_g, the largest of
/// which Arnoldi's iteration finds first (Y. Saad, Numerical Methods for Large Eigenvalue Problems,
/// 2011, 6.2). Where the shape changes much before it buckles, the path of model/statics.h tells
/// more; flutter under loads that follow the body is no buckling, and not found.

namespace mantle::model {

/// A load at which the reference shape has a neighbour in equilibrium, and the way there.
struct BucklingLoad {
  double load_factor{0};  ///< negative: under the opposite loads
  VectorX shape;          ///< laid out as v; its largest entry is 1
};

/// What FindBucklingLoads found.
struct BucklingResult {
  bool ok{false};
  std::string reason;               ///< why not
  std::vector<BucklingLoad> loads;  ///< nearest to zero first; equal ones once
};

/// The `count` distinct loads nearest to zero, or as many as there are below kLargestFactor. Throws
/// BadRobot where the root is free.
BucklingResult FindBucklingLoads(const Plant& plant, double time_s, int count);

/// Load factors beyond are none: round-off of loads that do not buckle anything.
inline constexpr double kLargestFactor = 1e5;

}  // namespace mantle::model
