#pragma once

#include <vector>

/// @file
/// Gauss quadrature on [0, 1], of any order: Legendre (n points, exact to degree 2n - 1) and Radau
/// with a point at the right end (n points, exact to degree 2n - 2). Radau costs one interval of
/// kinematics less per segment, because the last section is also where the next segment starts.

namespace mantle::reduced {

/// Points and weights of a rule on [0, 1].
struct QuadratureRule {
  std::vector<double> point, weight;  ///< ascending points; weights sum to 1
};

/// 1 <= n <= kMaxQuadraturePoints, else std::invalid_argument.
inline constexpr int kMaxQuadraturePoints = 32;
QuadratureRule GaussLegendre(int n);
QuadratureRule GaussRadau(int n);

/// Legendre polynomials P_0 ... P_degree at x in [-1, 1].
void LegendrePolynomials(int degree, double x, double* values);

}  // namespace mantle::reduced
