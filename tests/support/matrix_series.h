#pragma once

#include <Eigen/Core>
#include <vector>

#include "model/lie.h"

/// Reference values of exponentials and tangent operators by plain matrix power series in extended
/// precision. Shares neither formula nor series switch with model/lie: every operator of SE(3) is
/// sum_k a_k A^k of the 4x4 matrix d^ or of the 6x6 matrix ad_d, and its directional derivative is
/// the upper right block of the same series on [A B; 0 A] (Higham, Functions of Matrices,
/// eq. 3.16).

namespace mantle::tests {

using LongMatrix = Eigen::Matrix<long double, Eigen::Dynamic, Eigen::Dynamic>;

/// sum_k coefficients[k] A^k, by Horner.
inline LongMatrix PowerSeries(const LongMatrix& a, const std::vector<long double>& coefficients) {
  const LongMatrix identity = LongMatrix::Identity(a.rows(), a.cols());
  LongMatrix sum = LongMatrix::Zero(a.rows(), a.cols());
  for (std::size_t k = coefficients.size(); k-- > 0;) sum = sum * a + coefficients[k] * identity;
  return sum;
}

/// 1/k!, and (-1)^k/(k+1)! of Jr. 90 terms: 2 pi to the 90th over 90! is below 1e-66.
inline std::vector<long double> ExponentialCoefficients() {
  std::vector<long double> c = {1.0L};
  for (int k = 1; k < 90; ++k) c.push_back(c.back() / k);
  return c;
}
inline std::vector<long double> TangentCoefficients() {
  std::vector<long double> c = {1.0L};
  for (int k = 1; k < 90; ++k) c.push_back(-c.back() / (k + 1));
  return c;
}
/// Even part of x/(1 - exp(-x)): B_2k/(2k)! = -2 (-1)^k zeta(2k)/(2 pi)^2k, zeta by direct sum.
inline std::vector<long double> EvenInverseCoefficients() {
  constexpr int kTerms = 80;  // converges as (pi/2 pi)^k: 1e-24
  std::vector<long double> c(kTerms, 0.0L);
  c[0] = 1.0L;
  const long double two_pi = 6.283185307179586476925286766559L;
  const long double zeta2 = two_pi * two_pi / 24.0L;
  const long double zeta4 = two_pi * two_pi * two_pi * two_pi / 1440.0L;
  long double power = 1.0L;
  for (int k = 1; 2 * k < kTerms; ++k) {
    power *= -1.0L / (two_pi * two_pi);
    long double zeta = 0.0L;
    if (k == 1) {
      zeta = zeta2;
    } else if (k == 2) {
      zeta = zeta4;
    } else {
      const int last = k < 10 ? 4000 : 50;  // the rest of the sum is below 1e-19
      for (int n = last; n >= 1; --n) {
        long double term = 1.0L;
        for (int i = 0; i < 2 * k; ++i) term /= n;
        zeta += term;
      }
    }
    c[2 * k] = -2.0L * power * zeta;
  }
  return c;
}

inline LongMatrix LongHat(const model::Vector3& w) {
  LongMatrix m(3, 3);
  m << 0, -w.z(), w.y(), w.z(), 0, -w.x(), -w.y(), w.x(), 0;
  return m;
}
inline LongMatrix LongTwistMatrix(const model::Vector6& d) {  // d^ (4x4)
  LongMatrix m = LongMatrix::Zero(4, 4);
  m.topLeftCorner(3, 3) = LongHat(d.head<3>());
  m.topRightCorner(3, 1) = d.tail<3>().cast<long double>();
  return m;
}
inline LongMatrix LongSmallAdjoint(const model::Vector6& d) {
  LongMatrix m = LongMatrix::Zero(6, 6);
  m.topLeftCorner(3, 3) = m.bottomRightCorner(3, 3) = LongHat(d.head<3>());
  m.bottomLeftCorner(3, 3) = LongHat(d.tail<3>());
  return m;
}
/// Derivative of the series of ad_d in the direction `along` of d.
inline LongMatrix SeriesDerivative(const model::Vector6& d, const model::Vector6& along,
                                   const std::vector<long double>& coefficients) {
  LongMatrix nested = LongMatrix::Zero(12, 12);
  nested.topLeftCorner(6, 6) = nested.bottomRightCorner(6, 6) = LongSmallAdjoint(d);
  nested.topRightCorner(6, 6) = LongSmallAdjoint(along);
  return PowerSeries(nested, coefficients).topRightCorner(6, 6);
}

/// Rotation matrix to quaternion in extended precision, w >= 0 (Shepperd's choice of the pivot).
inline Eigen::Quaterniond QuaternionOf(const LongMatrix& r) {
  const long double trace = r(0, 0) + r(1, 1) + r(2, 2);
  const long double squares[4] = {1 + trace, 1 + 2 * r(0, 0) - trace, 1 + 2 * r(1, 1) - trace,
                                  1 + 2 * r(2, 2) - trace};
  long double q[4];
  int p = 0;
  for (int i = 1; i < 4; ++i) p = squares[i] > squares[p] ? i : p;
  const long double root = std::sqrt(squares[p]);
  const long double f = 0.5L / root;
  const long double skew[3] = {r(2, 1) - r(1, 2), r(0, 2) - r(2, 0), r(1, 0) - r(0, 1)};
  q[p] = 0.5L * root;
  if (p == 0) {
    for (int i = 0; i < 3; ++i) q[i + 1] = f * skew[i];
  } else {
    q[0] = f * skew[p - 1];
    for (int i = 0; i < 3; ++i) {
      if (i != p - 1) q[i + 1] = f * (r(i, p - 1) + r(p - 1, i));
    }
  }
  const long double sign = q[0] < 0 ? -1.0L : 1.0L;
  return {static_cast<double>(sign * q[0]), static_cast<double>(sign * q[1]),
          static_cast<double>(sign * q[2]), static_cast<double>(sign * q[3])};
}

/// Largest error of the 3x3 blocks of `value`, each relative to the norm of that block of
/// `reference` (absolute where that block is zero).
template <typename Matrix>
double BlockError(const Matrix& value, const LongMatrix& reference) {
  long double worst = 0.0L;
  for (int i = 0; i + 3 <= value.rows(); i += 3) {
    const int width = value.cols() >= 3 ? 3 : 1;
    for (int j = 0; j + width <= value.cols(); j += width) {
      const LongMatrix ref = reference.block(i, j, 3, width);
      const LongMatrix error = value.block(i, j, 3, width).template cast<long double>() - ref;
      const long double scale = ref.norm();
      worst = std::max(worst, scale > 0 ? error.norm() / scale : error.norm());
    }
  }
  return static_cast<double>(worst);
}

}  // namespace mantle::tests
