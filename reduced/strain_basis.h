#pragma once

#include <vector>

#include "model/robot.h"
#include "reduced/reduction.h"

namespace mantle::reduced {

using Matrix6X = Eigen::Matrix<double, 6, Eigen::Dynamic>;

/// A stretch of the arm with its own coordinates: a segment, or the whole arm.
struct StrainGroup {
  double from_m, to_m;  ///< arc lengths
  int first, columns;   ///< of its coordinates: place of the first, and how many
};

/// Strain of an arm from generalised coordinates ([physics.md] 8):
///
///   xi(X) = xi*(X) + B(X) q
///
/// with B piecewise constant on segments, or Legendre polynomials over the whole arm, in the chosen
/// strain components (torsion, bending y, z, stretch, shear y, z). Coordinates are strains [rad/m]
/// and [1].
class StrainBasis {
 public:
  /// Throws model::BadRobot with "segments", "degree" or "strains", the value and the bound.
  StrainBasis(const ArmReduction& reduction, double length_m);

  const std::vector<StrainGroup>& groups() const { return groups_; }
  int size() const { return size_; }
  /// B(X) of one group (6 x its columns) at arc length x within it.
  void Evaluate(int group, double x_m, Matrix6X* basis) const;
  /// Ends of the pieces on which sections are placed: the segments, or degree + 1 equal pieces.
  std::vector<double> PieceEnds() const;
  int GroupOf(double x_m) const;

 private:
  BasisKind kind_;
  int degree_;
  double length_;
  std::vector<int> components_;
  std::vector<StrainGroup> groups_;
  int size_{0};
};

}  // namespace mantle::reduced
