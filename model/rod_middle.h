#pragma once

#include "model/lie.h"

/// The frame half-way along an element of constant strain, which carries the inner part of the
/// element's mass and loads (model/rod.h).
///
///   h = g1^-1 g2 = exp(d),   g_m = g1 k,   k = exp(d/2),
///   eta_m = A eta1 + B eta2,   A = (1 - ad_tau)/2,   B = (1 + ad_tau)/2,   ad_tau = tanh(ad_d /
///   4), eta_m_dot = A eta1_dot + B eta2_dot + B ad_kappa A (eta2 - eta1), kappa = (k^-1 k_dot)v =
///   eta_m - K eta1,   K = Ad_k^-1.
///
/// Derivation. Both halves turn by the same k: kappa = eta_m - K eta1 = eta2 - K eta_m, hence
/// (1 + K) eta_m = K eta1 + eta2; with K = exp(-ad_d / 2) this is the second line, and B = (1 +
/// K)^-1. Over the dual numbers (model/lie.h) a hat matrix has tanh(omega~ / 4) = (tan(|omega| / 4)
/// omega / |omega|)~, so that tau is a twist; with h = (c, s) as a unit dual quaternion tau = s /
/// (1 + c). K = (1 + ad_tau)^-1 (1 - ad_tau) is the Cayley transform of tau, from which
///   ad_tau_dot = 2 B ad_kappa A,   tau_dot = 1/2 (kappa + tau x kappa + (tau . kappa) tau)
/// (dual numbers again), which gives the third line.
///
/// The map of the twists is linear and comes from one smooth function of the two poses that moves
/// with them: what the frame carries has exact rigid motions and its forces, mapped back by A^T and
/// B^T, keep momentum and the power balance.

namespace mantle::model {

struct RodMiddle {
  Vector6 tau{Vector6::Zero()};
  Pose half;  ///< k
};

/// From h, whose rotation must be below pi.
RodMiddle MiddleOf(const Pose& relative);

/// eta_m.
inline Vector6 MiddleTwist(const RodMiddle& m, const Vector6& eta1, const Vector6& eta2) {
  return 0.5 * (eta1 + eta2 + SmallAdjointTimes(m.tau, eta2 - eta1));
}

/// What of eta_m_dot the rates of the nodes' twists do not make.
Vector6 MiddleBias(const RodMiddle& m, const Vector6& eta1, const Vector6& eta2,
                   const Vector6& eta_m);

/// f1 += A^T w, f2 += B^T w for a wrench w on the middle.
inline void AddMiddleWrench(const RodMiddle& m, const Vector6& w, Vector6* f1, Vector6* f2) {
  const Vector6 turned = CoadjointTimes(m.tau, w);
  *f1 += 0.5 * (w - turned);
  *f2 += 0.5 * (w + turned);
}

/// A form x_m^T D x_m on the middle as blocks on the nodes.
struct MiddleBlocks {
  Matrix6 a11, a12, a21, a22;
};
MiddleBlocks MiddleForm(const RodMiddle& m, const Matrix6& form);

/// Subtracts the change of A^T w and B^T w with the shape at constant w.
void SubtractMiddleTurn(const RodMiddle& m, const Vector6& w, MiddleBlocks* out);

/// Twist, and its rate, of the point `ahead` on e1 of a frame; and a wrench there seen in the
/// frame.
inline Vector6 TwistAhead(double ahead_m, Vector6 twist) {
  twist(4) += ahead_m * twist(2);
  twist(5) -= ahead_m * twist(1);
  return twist;
}
inline Vector6 WrenchFromAhead(double ahead_m, Vector6 wrench) {
  wrench(1) -= ahead_m * wrench(5);
  wrench(2) += ahead_m * wrench(4);
  return wrench;
}
/// A form on the twist ahead as one on the frame's twist.
void FormFromAhead(double ahead_m, Matrix6* form);

}  // namespace mantle::model
