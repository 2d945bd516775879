#pragma once

#include <optional>
#include <vector>

#include "model/plant.h"

/// Shapes of the reduced mantle ([physics.md] 8): profile = reference + Phi s, with Phi the lowest
/// vibration modes of the clamped mantle and static shapes of its actuated strip minus the
/// reference, from the plant's own tangent and equilibria, orthonormal in the plant's mass:
/// Phi^T M Phi = I, so that s has the unit kg^(1/2) m.

namespace mantle::reduced {

/// More coordinates than that belong in the plant.
inline constexpr int kMaxMantleCoordinates = 8;

struct MantleReduction {
  int modes{1};
  /// Pressures [Pa] on the actuated strip whose equilibria are shapes; several strips (or sets of
  /// spokes) give one shape each. Not given: 160 and 325 Pa, or two more modes where the mantle has
  /// no strip.
  std::optional<std::vector<double>> static_pressures_pa;
  /// Elements whose stresses are evaluated are chosen, with weights, so that forces, stiffness and
  /// damping agree with the whole mesh within this share; 0 evaluates every element.
  double cubature_tolerance{1e-3};
  int lateral_slices{16};  ///< of the profile for lateral drag; 0: one per element
};

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
