#pragma once

#include "model/lie.h"

/// @file
/// The tangent operator T = Jr(Omega(t)) = [F 0; G F] of model/lie.h along a curve Omega(t) in
/// se(3), with its first two time derivatives, and the relative pose exp(Omega). With
/// Omega = (w, v), W = w~, s = |w|^2 and Stumpff's functions c_m(s) = sum_k (-s)^k / (2k + m)!,
///
///   F = c_1 I - c_2 W + c_3 w w^T,   G = dF[v],   exp: R = I + c_1 W + c_2 W^2,  p = F^T v,
///   c_m' = (m c_{m+2} - c_{m+1}) / 2,   c_m = 1/m! - s c_{m+2},
/// so that no rotation is singular: the recurrence runs downwards from series, upwards from the
/// trigonometric functions beyond kSeriesLimit.

namespace mantle::reduced {

using model::Matrix3;
using model::Matrix6;
using model::Vector3;
using model::Vector6;

/// c_1 ... c_9 at s >= 0.
struct Stumpff {
  double c[10];  ///< c_m at index m
};
Stumpff StumpffFunctions(double s);

/// Values and s-derivatives of c_1, c_2, c_3.
struct TangentCoefficients {
  double p[4], b[4], c[4];  ///< of c_1, c_2, c_3: value and three derivatives each
};
TangentCoefficients CoefficientsOf(const Stumpff& stumpff);

/// One 6x6 operator [F 0; G F].
struct TangentBlocks {
  Matrix3 f, g;

  Vector6 Times(const Vector6& x) const {
    Vector6 y;
    y.head<3>().noalias() = f * x.head<3>();
    y.tail<3>().noalias() = f * x.tail<3>();
    y.tail<3>().noalias() += g * x.head<3>();
    return y;
  }
  Vector6 TransposeTimes(const Vector6& x) const {
    Vector6 y;
    y.head<3>().noalias() = f.transpose() * x.head<3>();
    y.head<3>().noalias() += g.transpose() * x.tail<3>();
    y.tail<3>().noalias() = f.transpose() * x.tail<3>();
    return y;
  }
};

/// exp(Omega) and T with its rates at one instant of the curve.
struct TangentJet {
  Matrix3 rotation;                   ///< of exp(Omega)
  Vector3 position;                   ///< [m]
  TangentBlocks value, rate, second;  ///< T, T_dot, T_ddot (second only on demand)
};

/// Fills rotation, position, T and T_dot; returns the coefficients for the calls below.
TangentCoefficients EvaluateTangentJet(const Vector6& omega, const Vector6& omega_dot,
                                       TangentJet* jet);
/// T_ddot for the same curve.
void EvaluateSecondTangent(const TangentCoefficients& k, const Vector6& omega,
                           const Vector6& omega_dot, const Vector6& omega_ddot, TangentJet* jet);

/// d(T(Omega)^T sigma)/dOmega at constant sigma (6x6).
Matrix6 TangentTransposeDerivative(const TangentCoefficients& k, const Vector6& omega,
                                   const Vector6& sigma);

}  // namespace mantle::reduced
