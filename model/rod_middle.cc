#include "model/rod_middle.h"

#include <cmath>

namespace mantle::model {
namespace {

// Twists' operators over the dual numbers: [a 0; b a].
struct DualMatrix {
  Matrix3 a, b;
};

// x~ y~ = y x^T - (x . y) 1
Matrix3 HatHat(const Vector3& x, const Vector3& y) {
  Matrix3 m = y * x.transpose();
  m.diagonal().array() -= x.dot(y);
  return m;
}
Matrix3 HatTimes(const Vector3& x, const Matrix3& m) {
  Matrix3 y;
  for (int i = 0; i < 3; ++i) y.col(i) = x.cross(m.col(i));
  return y;
}
// ad_x ad_y
DualMatrix TwistTwist(const Vector6& x, const Vector6& y) {
  const Vector3 xw = x.head<3>(), yw = y.head<3>();
  return {HatHat(xw, yw), HatHat(x.tail<3>(), yw) + HatHat(xw, y.tail<3>())};
}
// ad_x m
DualMatrix TwistTimes(const Vector6& x, const DualMatrix& m) {
  const Vector3 w = x.head<3>();
  return {HatTimes(w, m.a), HatTimes(x.tail<3>(), m.a) + HatTimes(w, m.b)};
}
// m ad_x
Matrix6 TimesTwist(const Matrix6& m, const Vector6& x) {
  Matrix6 y;
  for (int i = 0; i < 3; ++i) {
    const int j = (i + 1) % 3, k = (i + 2) % 3;
    y.col(i) =
        x(k) * m.col(j) - x(j) * m.col(k) + x(3 + k) * m.col(3 + j) - x(3 + j) * m.col(3 + k);
    y.col(3 + i) = x(k) * m.col(3 + j) - x(j) * m.col(3 + k);
  }
  return y;
}
// ad_x^T m
Matrix6 TwistTransposeTimes(const Vector6& x, const Matrix6& m) {
  Matrix6 y;
  for (int c = 0; c < 6; ++c) y.col(c) = CoadjointTimes(x, m.col(c));
  return y;
}
// N(p) m, N(p) x = ad_x^T p
void AddCoadjointTimes(double scale, const Vector6& p, const DualMatrix& m, Matrix6* out) {
  const Vector3 force = scale * p.tail<3>();
  const Matrix3 turned = HatTimes(force, m.a);
  out->topLeftCorner<3, 3>() += HatTimes(scale * p.head<3>(), m.a) + HatTimes(force, m.b);
  out->topRightCorner<3, 3>() += turned;
  out->bottomLeftCorner<3, 3>() += turned;
}

// E
DualMatrix TauRateByDifference(const Vector6& tau) {
  const Vector3 t = tau.head<3>(), dual = tau.tail<3>();
  const Matrix3 mixed = t * dual.transpose();
  DualMatrix e{0.5 * t * t.transpose(), 0.5 * (mixed + mixed.transpose())};
  e.a.diagonal().array() += 0.25 * (1.0 - t.squaredNorm());
  e.b.diagonal().array() -= 0.5 * t.dot(dual);
  return e;
}

// From (mean, difference) to the nodes: x1 = x~ - x'/2, forces f~ = f1 + f2, f' = (f2 - f1) / 2.
MiddleBlocks OnNodes(const Matrix6& mean_mean, const Matrix6& mean_change,
                     const Matrix6& change_mean, const Matrix6& change_change) {
  const Matrix6 even = 0.25 * mean_mean + change_change, odd = 0.25 * mean_mean - change_change;
  const Matrix6 sum = 0.5 * (mean_change + change_mean);
  const Matrix6 difference = 0.5 * (mean_change - change_mean);
  return {even - sum, odd + difference, odd - difference, even + sum};
}

}  // namespace

RodMiddle MiddleOf(const Pose& h) {
  const double sign = h.rotation.w() < 0.0 ? -1.0 : 1.0;
  const double c = sign * h.rotation.w();
  const Vector3 s = sign * h.rotation.vec();
  const Vector3& p = h.position;
  // Dual parts of the unit quaternion (q + eps p q / 2).
  const double dual_c = -0.5 * p.dot(s);
  const Vector3 dual_s = 0.5 * (c * p + p.cross(s));
  const double scale = 1.0 / (1.0 + c);
  RodMiddle m;
  m.tau.head<3>() = scale * s;
  m.tau.tail<3>() = scale * (dual_s - (scale * dual_c) * s);
  const double unit = std::sqrt(0.5 * scale);
  m.half.rotation.w() = unit * (1.0 + c);
  m.half.rotation.vec() = unit * s;
  m.half.position = 0.5 * (p - m.tau.head<3>().cross(p));  // (1 + R)^-1 p, R of k
  return m;
}

Vector6 MiddleTauRate(const RodMiddle& m, const Vector6& eta1, const Vector6& eta2) {
  const Vector3 t = m.tau.head<3>(), dual = m.tau.tail<3>();
  const Vector6 change = eta2 - eta1;
  const Vector3 w = change.head<3>(), v = change.tail<3>();
  const double along = t.dot(w), along_dual = t.dot(v) + dual.dot(w);
  const double rest = 1.0 - t.squaredNorm(), rest_dual = -2.0 * t.dot(dual);
  Vector6 rate = 0.5 * SmallAdjointTimes(m.tau, eta1 + eta2);
  rate.head<3>() += 0.25 * rest * w + (0.5 * along) * t;
  rate.tail<3>() +=
      0.25 * (rest * v + rest_dual * w) + (0.5 * along) * dual + (0.5 * along_dual) * t;
  return rate;
}

MiddleBlocks MiddleForm(const RodMiddle& m, const Matrix6& form) {
  const Matrix6 change = 0.5 * TimesTwist(form, m.tau);
  const Vector6 half = 0.5 * m.tau;
  return OnNodes(form, change, TwistTransposeTimes(half, form), TwistTransposeTimes(half, change));
}

MiddleBlocks MiddleTangent(const RodMiddle& m, const Matrix6& form, const MiddleMotion& motion,
                           double s, double chart) {
  const DualMatrix e = TauRateByDifference(m.tau);
  const DualMatrix x{Hat(m.tau.head<3>()), Hat(m.tau.tail<3>())};
  const Vector6 half_u =
      0.5 * (motion.acceleration_change + ((1.0 - chart) * s) * motion.twist_change);
  const Vector6 turn = (0.5 * (1.0 + chart) * s) * motion.tau_rate;
  // What the shape adds to the frame's acceleration, by mean and difference.
  const DualMatrix by_mean = TwistTwist(half_u, m.tau);
  DualMatrix by_change = TwistTimes(half_u, e);
  by_change.a -= Hat(turn.head<3>());
  by_change.b -= Hat(turn.tail<3>());
  // I of the frame, [moments products; products masses], times that
  const auto subtract = [&](DualMatrix y, Matrix6* out) {
    const Vector3 rotary = motion.inertia.head<3>(), mass = motion.inertia.tail<3>();
    const double ahead = motion.ahead_m;
    y.b.row(1) += ahead * y.a.row(2);
    y.b.row(2) -= ahead * y.a.row(1);
    const Matrix3 linear = mass.asDiagonal() * y.b;
    Matrix3 right = mass.asDiagonal() * y.a;
    Matrix3 angular = rotary.asDiagonal() * y.a;
    angular.row(1) -= ahead * linear.row(2);
    angular.row(2) += ahead * linear.row(1);
    out->topLeftCorner<3, 3>() -= angular;
    out->bottomLeftCorner<3, 3>() -= linear;
    out->bottomRightCorner<3, 3>() -= right;
    out->block<1, 3>(1, 3) += ahead * right.row(2);
    out->block<1, 3>(2, 3) -= ahead * right.row(1);
  };
  Matrix6 mean_change = 0.5 * TimesTwist(form, m.tau), mean_mean = form;
  subtract(by_mean, &mean_mean);
  subtract(by_change, &mean_change);
  const Vector6 half = 0.5 * m.tau;
  Matrix6 change_mean = TwistTransposeTimes(half, mean_mean);
  Matrix6 change_change = TwistTransposeTimes(half, mean_change);
  AddCoadjointTimes(0.5, motion.residual, x, &change_mean);
  AddCoadjointTimes(0.5, motion.residual, e, &change_change);
  return OnNodes(mean_mean, mean_change, change_mean, change_change);
}

void FormFromAhead(double ahead_m, Matrix6* form) {
  if (ahead_m == 0.0) return;
  Matrix6& f = *form;
  f.col(2) += ahead_m * f.col(4);
  f.col(1) -= ahead_m * f.col(5);
  f.row(2) += ahead_m * f.row(4);
  f.row(1) -= ahead_m * f.row(5);
}

}  // namespace mantle::model
