#pragma once

#include "model/lie.h"

/// @file
/// The frame half-way along an element of constant strain, which carries the inner part of the
/// element's mass and loads (model/rod.h).
///
///   h = g1^-1 g2 = exp(d),   g_m = g1 exp(d/2),   ad_tau = tanh(ad_d / 4)
/// and with the mean ~ and the difference ' of what the two nodes have, x~ = (x1 + x2) / 2 and
/// x' = x2 - x1,
///   eta_m = eta~ + 1/2 ad_tau eta',
///   tau_dot = E eta' + ad_tau eta~,   E x = 1/4 ((1 - tau . tau) x + 2 tau (tau . x)),
///   eta_m_dot = eta~_dot + 1/2 ad_tau eta'_dot + 1/2 ad_tau_dot eta'.
///
/// Derivation. With k = exp(d/2) and kappa = (k^-1 k_dot)v both halves turn alike: kappa = eta_m -
/// K eta1 = eta2 - K eta_m, K = Ad_k^-1, hence (1 + K) eta_m = K eta1 + eta2; K = exp(-ad_d / 2)
/// makes that the second line. Over the dual numbers (model/lie.h) a hat matrix has tanh(omega~ /
/// 4) = (tan(|omega| / 4) omega / |omega|)~, so that tau is a twist; with h = (c, s) as a unit dual
/// quaternion tau = s / (1 + c): the modified Rodrigues parameters of h. Their rate under a turn
/// from the right is 1/4 ((1 - tau . tau) + 2 tau x + 2 tau tau .) eta2 (M. D. Shuster, A survey of
/// attitude representations, J. Astronaut. Sci. 41, 1993, 439-517), under eta1 the opposite with
/// the opposite tau; both together are the third line, in products of dual numbers.
///
/// The map of the twists is linear and comes from one smooth function of the two poses that moves
/// with them: what the frame carries has exact rigid motions, and its forces, mapped back by the
/// transpose, keep momentum and the power balance.

namespace mantle::model {

/// The middle of an element as its equations need it.
struct RodMiddle {
  Vector6 tau{Vector6::Zero()};  ///< tau [1, m]
  Pose half;                     ///< k = exp(d/2)
};

/// From h, whose rotation must be below pi.
RodMiddle MiddleOf(const Pose& relative);

/// eta_m.
inline Vector6 MiddleTwist(const RodMiddle& m, const Vector6& eta1, const Vector6& eta2) {
  return 0.5 * (eta1 + eta2 + SmallAdjointTimes(m.tau, eta2 - eta1));
}

/// tau_dot; and with increments zeta of the two nodes for their twists, tau's own increment.
Vector6 MiddleTauRate(const RodMiddle& m, const Vector6& eta1, const Vector6& eta2);

/// What of eta_m_dot the rates of the nodes' twists do not make.
inline Vector6 MiddleBias(const RodMiddle& m, const Vector6& eta1, const Vector6& eta2) {
  return 0.5 * SmallAdjointTimes(MiddleTauRate(m, eta1, eta2), eta2 - eta1);
}

/// f1 and f2 += what a wrench w on the middle does to the nodes.
inline void AddMiddleWrench(const RodMiddle& m, const Vector6& w, Vector6* f1, Vector6* f2) {
  const Vector6 turned = CoadjointTimes(m.tau, w);
  *f1 += 0.5 * (w - turned);
  *f2 += 0.5 * (w + turned);
}

/// Blocks on the nodes of an element (row: the node whose force, column: the node that moves).
struct MiddleBlocks {
  Matrix6 a11, a12, a21, a22;
};

/// A form x_m^T F x_m on the middle as blocks on the nodes.
MiddleBlocks MiddleForm(const RodMiddle& m, const Matrix6& form);

/// What the frame carries, as it is linearised: a mass with the residual R = I eta_m_dot - w, about
/// a motion of the nodes.
struct MiddleMotion {
  Vector6 inertia;              ///< I, diagonal, at the place `ahead_m` on e1 of the frame
  double ahead_m;               ///< [m]
  Vector6 residual;             ///< R of the frame
  Vector6 tau_rate;             ///< tau_dot
  Vector6 twist_change;         ///< eta'
  Vector6 acceleration_change;  ///< eta'_dot
};

/// Blocks of the residual's change on the nodes for increments zeta of the nodes under which their
/// twists change by (s + chart ad_eta) zeta and the rates of these by s times that. `form` is what
/// R changes with the frame's own increment zeta_m where the frame moves like a node, that is with
/// I (s^2 + chart s ad_eta_m) zeta_m for the acceleration. What the shape adds to that, with
/// zeta~ and zeta' as above,
///   d tau = E zeta' + ad_tau zeta~,   zeta_m = zeta~ + 1/2 ad_tau zeta',
///   d eta_m_dot = (s^2 + chart s ad_eta_m) zeta_m - 1/2 ad_u d tau + (1 + chart) s / 2 ad_tau_dot
///                 zeta',   u = eta'_dot + (1 - chart) s eta',
/// is complete but for squares of rates beside s^2; and R's own transport, 1/2 ad_dtau^T R from one
/// node to the other, is complete.
MiddleBlocks MiddleTangent(const RodMiddle& m, const Matrix6& form, const MiddleMotion& motion,
                           double s, double chart);

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
