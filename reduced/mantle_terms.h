#pragma once

#include <cmath>

#include "reduced/mantle.h"

/// @file
/// Parts that the mantle's residual and its derivatives share.

namespace mantle::reduced {

/// Rows of one element, or of one slice, in K coordinates (Eigen::Dynamic: any number up to the
/// most), without heap.
template <int K, int Rows>
using MantleRows =
    Eigen::Matrix<double, Rows, K, 0, Rows, K == Eigen::Dynamic ? kMaxMantleCoordinates : K>;
template <int K>
using MantleVector =
    Eigen::Matrix<double, K, 1, 0, K == Eigen::Dynamic ? kMaxMantleCoordinates : K, 1>;
template <int K>
using MantleSquare = Eigen::Matrix<double, K, K, 0, K == Eigen::Dynamic ? kMaxMantleCoordinates : K,
                                   K == Eigen::Dynamic ? kMaxMantleCoordinates : K>;

template <int K>
Eigen::Map<const MantleVector<K>> Fixed(const VectorX& x) {
  return Eigen::Map<const MantleVector<K>>(x.data(), x.size());
}
template <int K>
Eigen::Map<const MantleRows<K, 5>> Fixed(const Eigen::Matrix<double, 5, Eigen::Dynamic>& x) {
  return Eigen::Map<const MantleRows<K, 5>>(x.data(), 5, x.cols());
}

/// eta-dependent factors of the contained water's push ([physics.md] 4): cross and pitch^2 of
/// model/mantle_inertia.h.
struct Turn {
  double cross, pitch2;
  Vector6 cross_by_twist, pitch2_by_twist;  ///< derivatives in eta
};
inline Turn TurnOf(const Vector6& eta) {
  Turn t;
  t.cross = eta(3) * eta(1) - eta(4) * eta(0);
  t.pitch2 = eta(0) * eta(0) + eta(1) * eta(1);
  t.cross_by_twist << -eta(4), eta(3), 0, eta(1), -eta(0), 0;
  t.pitch2_by_twist << 2 * eta(0), 2 * eta(1), 0, 0, 0, 0;
  return t;
}

/// Coefficients m z^i of the contained water in L_i, as (d/dm, d/dz).
struct WaterShare {
  double value, by_m, by_z;
};
inline WaterShare ShareOf(const MantleWork& work, int i) {
  const double m = work.water_kg, z = work.centroid_m;
  if (i == 0) return {m, 1.0, 0.0};
  if (i == 1) return {m * z, z, m};
  return {m * z * z, z * z, 2.0 * m * z};
}

}  // namespace mantle::reduced
