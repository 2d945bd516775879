#pragma once

#include <vector>

#include "model/plant.h"
#include "reduced/reduction.h"

/// Shapes of the reduced mantle ([physics.md] 8): profile = reference + Phi s, with Phi the lowest
/// vibration modes of the clamped mantle and static shapes of its actuated strip minus the
/// reference, from the plant's own tangent and equilibria, orthonormal in the plant's mass:
/// Phi^T M Phi = I, so that s has the unit kg^(1/2) m.

namespace mantle::reduced {

/// More coordinates than that belong in the plant.
inline constexpr int kMaxMantleCoordinates = 8;


struct MantleShapes {
  Eigen::MatrixXd shapes;                   ///< 3 nodes x k: (r, z, theta) per node
  std::vector<Eigen::VectorXd> equilibria;  ///< s along the static path, for training
  Eigen::VectorXd scale;                    ///< size of each coordinate on that path
  std::vector<double> mode_frequencies_rad_s;
};

/// Throws model::BadRobot (more coordinates than the mesh has, no strip, dependent shapes, no
/// equilibrium at a pressure).
MantleShapes MakeMantleShapes(const model::Plant& plant, const MantleReduction& reduction);

}  // namespace mantle::reduced
