#include "model/rod_middle.h"

#include <cmath>

namespace mantle::model {

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

Vector6 MiddleBias(const RodMiddle& m, const Vector6& eta1, const Vector6& eta2,
                   const Vector6& eta_m) {
  const Vector6 delta = eta2 - eta1;
  const Vector6 kappa = eta_m - AdjointInverseTimes(m.half, eta1);
  const Vector6 y =
      SmallAdjointTimes(kappa, 0.5 * (delta - SmallAdjointTimes(m.tau, delta)).eval());
  return 0.5 * (y + SmallAdjointTimes(m.tau, y));
}

MiddleBlocks MiddleForm(const RodMiddle& m, const Matrix6& form) {
  const Matrix6 x = SmallAdjoint(m.tau);
  const Matrix6 right = form * x, left = x.transpose() * form;
  const Matrix6 both = x.transpose() * right;
  return {0.25 * (form - right - left + both), 0.25 * (form + right - left - both),
          0.25 * (form - right + left - both), 0.25 * (form + right + left + both)};
}

void SubtractMiddleTurn(const RodMiddle& m, const Vector6& w, MiddleBlocks* out) {
  // A^T w changes by -1/2 ad_dtau^T w = -1/2 N(w) dtau, B^T w by the opposite;
  // dtau = T kappa, kappa = B zeta2 - K A zeta1.
  const Vector3 t = m.tau.head<3>(), dual = m.tau.tail<3>();
  Matrix6 rate = Matrix6::Zero();
  rate.topLeftCorner<3, 3>() = 0.5 * (Matrix3::Identity() + Hat(t) + t * t.transpose());
  rate.bottomRightCorner<3, 3>() = rate.topLeftCorner<3, 3>();
  rate.bottomLeftCorner<3, 3>() = 0.5 * (Hat(dual) + t * dual.transpose() + dual * t.transpose());
  const Matrix6 x = SmallAdjoint(m.tau);
  const Matrix6 turn = 0.5 * CoadjointMatrix(w) * rate;
  const Matrix6 turned = turn * Adjoint(Inverse(m.half));
  const Matrix6 by1 = 0.5 * (turned - turned * x), by2 = 0.5 * (turn + turn * x);
  out->a11 -= by1;
  out->a21 += by1;
  out->a12 += by2;
  out->a22 -= by2;
}

void FormFromAhead(double ahead_m, Matrix6* form) {
  if (ahead_m == 0.0) return;
  Matrix6 t = Matrix6::Identity();
  t(4, 2) = ahead_m;
  t(5, 1) = -ahead_m;
  *form = t.transpose() * *form * t;
}

}  // namespace mantle::model
