#pragma once

#include <Eigen/Core>
#include <vector>

/// @file
/// Empirical cubature: few columns of G with positive weights w so that G w ~ G 1, by non-negative
/// least squares on an active set (Lawson & Hanson, Solving Least Squares Problems, 1974, ch. 23),
/// stopped once |G w - G 1| <= tolerance |G 1|. With G the contributions of the shell's elements to
/// generalised forces, stiffness and damping at training shapes, the reduced mantle keeps its
/// energy: weights are positive, so stiffness and dissipation stay those of a material (Farhat,
/// Chapman & Avery, Int. J. Numer. Meth. Engng 102, 2015).

namespace mantle::reduced {

/// The columns that were chosen, with their weights w, and how well they do.
struct Cubature {
  std::vector<int> column;
  std::vector<double> weight;
  double residual{0};  ///< |G w - G 1| / |G 1|
};

Cubature ChooseCubature(const Eigen::MatrixXd& g, double tolerance);

}  // namespace mantle::reduced
