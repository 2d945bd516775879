#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

/// @file
/// SO(3) and SE(3): hat, exponential, logarithm, adjoints, the tangent operator and its inverse.
///
/// Conventions. 6-vectors are (angular, linear), in the body frame. A pose g = (R, p) maps body to
/// world. With d = (omega, v) in R^6, d^ its 4x4 matrix and g = exp(d^):
///   ad_d  = [omega~ 0; v~ omega~],    Ad_g = [R 0; p~R R],   Ad_exp(d) = exp(ad_d)
///   g^-1 g_dot = Jr(d) d_dot,         Jr(d) = sum_k (-ad_d)^k / (k+1)!      (tangent operator)
///   Jr^-1(d) = E(d) + ad_d / 2,       Jl^-1(d) = Jr^-1(-d) = E(d) - ad_d / 2
/// E is the even part of the inverse. Because se(3) is so(3) over the dual numbers (omega + eps v),
/// every SE(3) operator is [F 0; DF[v] F] with F the SO(3) operator and DF[v] its directional
/// derivative; only scalar functions of s = |omega|^2 and their s-derivatives are needed.
/// Each of them switches to its Taylor series below kSeriesLimit, where the series still holds full
/// accuracy (relative 1e-15) and the closed form has lost at most two digits.

namespace mantle::model {

using Vector3 = Eigen::Vector3d;
using Vector6 = Eigen::Matrix<double, 6, 1>;
using VectorX = Eigen::VectorXd;
using Matrix3 = Eigen::Matrix3d;
using Matrix6 = Eigen::Matrix<double, 6, 6>;

/// A pose in SE(3): unit quaternion and position [m].
struct Pose {
  Eigen::Quaterniond rotation{Eigen::Quaterniond::Identity()};  ///< R, body to world
  Vector3 position{Vector3::Zero()};                            ///< p, of the body's origin [m]

  static Pose Identity() { return {}; }
};

Pose operator*(const Pose& a, const Pose& b);
Pose Inverse(const Pose& g);

/// a~ with a~ b = a x b.
inline Matrix3 Hat(const Vector3& a) {
  Matrix3 m;
  m << 0, -a.z(), a.y(), a.z(), 0, -a.x(), -a.y(), a.x(), 0;
  return m;
}
/// Inverse of Hat; reads the skew part.
Vector3 Vee(const Matrix3& m);

/// sin(t)/t, (1-cos t)/t^2, (t-sin t)/t^3 and the s-derivatives of the last two, s = t^2 >= 0.
struct ExpCoefficients {
  double a, b, c, b1, c1;
};
ExpCoefficients ExpSeries(double s);

/// c(s) = (1 - (t/2) cot(t/2)) / t^2 with its first two s-derivatives, s = t^2 < (2 pi)^2.
struct LogCoefficients {
  double c, c1, c2;
};
LogCoefficients LogSeries(double s);

/// exp of a rotation vector [rad] of any length; the result has unit norm to round-off.
Eigen::Quaterniond ExpSO3(const Vector3& omega);
/// Rotation vector of a unit quaternion, |omega| in [0, pi]: the principal value. Rotations beyond
/// pi come back as their complement (pi + x about a is pi - x about -a); at pi the sign of the axis
/// is that of the stored quaternion.
Vector3 LogSO3(const Eigen::Quaterniond& q);

Pose ExpSE3(const Vector6& d);
/// Inverse of ExpSE3 for |omega| < pi; beyond pi the principal value, as LogSO3.
Vector6 LogSE3(const Pose& g);

/// Ad_g (6x6): maps a twist seen in the body frame of g to the frame g is expressed in.
Matrix6 Adjoint(const Pose& g);
/// Ad_{g^-1} eta without forming the matrix.
Vector6 AdjointInverseTimes(const Pose& g, const Vector6& eta);
/// Ad_{g^-1}^T w: carries a wrench at the body frame of g to the frame g is expressed in.
Vector6 AdjointInverseTransposeTimes(const Pose& g, const Vector6& wrench);
/// ad_d (6x6).
Matrix6 SmallAdjoint(const Vector6& d);
/// ad_d x.
inline Vector6 SmallAdjointTimes(const Vector6& d, const Vector6& x) {
  Vector6 y;
  y.head<3>() = d.head<3>().cross(x.head<3>());
  y.tail<3>() = d.tail<3>().cross(x.head<3>()) + d.head<3>().cross(x.tail<3>());
  return y;
}
/// ad_d^T p = -(omega x p_w + v x p_v, omega x p_v): the coadjoint action in the body frame.
inline Vector6 CoadjointTimes(const Vector6& d, const Vector6& p) {
  Vector6 y;
  y.head<3>() = p.head<3>().cross(d.head<3>()) + p.tail<3>().cross(d.tail<3>());
  y.tail<3>() = p.tail<3>().cross(d.head<3>());
  return y;
}
/// N(p) with ad_d^T p = N(p) d.
Matrix6 CoadjointMatrix(const Vector6& p);

/// Tangent operator Jr(d) and its inverse (6x6); the inverse exists for |omega| < 2 pi.
Matrix6 TangentOperator(const Vector6& d);
Matrix6 TangentOperatorInverse(const Vector6& d);
/// Jr(d) x and Jr^-1(d) x without forming the matrices.
Vector6 TangentOperatorTimes(const Vector6& d, const Vector6& x);
Vector6 TangentOperatorInverseTimes(const Vector6& d, const Vector6& x);

/// exp(d^) and Jr(d) x in one go: the pose and body twist of a chart's coordinates and their rates.
struct PoseAndTwist {
  Pose pose;      ///< exp(d^)
  Vector6 twist;  ///< Jr(d) x
};
PoseAndTwist ExpAndTangent(const Vector6& d, const Vector6& x);

/// The even part E(d) of Jr^-1(d) at one d, prepared once and applied several times. In 3x3 blocks
/// E = [Ea 0; Eb Ea] with Ea x = x + c omega x (omega x x) and Eb = DEa[v]; Ea and Eb are
/// symmetric.
class EvenTangentInverse {
 public:
  explicit EvenTangentInverse(const Vector6& d);
  /// E(log g) and, in `d`, log g: one pass over the same coefficients.
  EvenTangentInverse(const Pose& g, Vector6* d);

  Vector6 Times(const Vector6& x) const {
    Vector6 y;
    y.head<3>() = ea_ * x.head<3>();
    y.tail<3>() = ea_ * x.tail<3>() + eb_ * x.head<3>();
    return y;
  }
  /// E^T sigma.
  Vector6 TransposeTimes(const Vector6& sigma) const {
    Vector6 y;
    y.head<3>() = ea_ * sigma.head<3>() + eb_ * sigma.tail<3>();
    y.tail<3>() = ea_ * sigma.tail<3>();
    return y;
  }
  Matrix6 Matrix() const;
  /// d(E x)/dd for constant x (6x6).
  Matrix6 Derivative(const Vector6& x) const;
  /// d(E^T sigma)/dd for constant sigma (6x6).
  Matrix6 TransposeDerivative(const Vector6& sigma) const;

 private:
  Matrix3 FirstDerivative(const Vector3& x) const;   // d(Ea x)/domega
  Matrix3 SecondDerivative(const Vector3& x) const;  // d(DEa[v] x)/domega

  void MakeBlocks();

  Vector3 omega_, v_;
  LogCoefficients k_;
  Matrix3 ea_, eb_;
};

}  // namespace mantle::model
