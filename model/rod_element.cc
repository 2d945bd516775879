#include "model/rod_element.h"

namespace mantle::model {

bool EvaluateRodElement(const Pose& g1, const Pose& g2, const Vector6& eta1, const Vector6& eta2,
                        RodElementState* state) {
  const Eigen::Quaterniond inverse = g1.rotation.conjugate();
  Pose h;
  h.rotation = inverse * g2.rotation;
  h.position = inverse * (g2.position - g1.position);
  state->even = EvenTangentInverse(h, &state->d);
  if (!(state->d.head<3>().squaredNorm() < kMaxElementRotation * kMaxElementRotation)) return false;
  state->d_dot = state->even.Times(eta2 - eta1) + 0.5 * SmallAdjointTimes(state->d, eta1 + eta2);
  return state->d_dot.allFinite();
}

void RodElementTangents(const RodElement& e, const RodElementState& s, const Vector6& eta1,
                        const Vector6& eta2, const Vector6& sigma, const Matrix6* cable_tangent,
                        double damping_scale, RodElementTangent* out) {
  const Matrix6 even = s.even.Matrix();
  const Matrix6 half_ad = 0.5 * SmallAdjoint(s.d);
  const Matrix6 br = even + half_ad;
  const Matrix6 bl = even - half_ad;

  // d sigma = c dd (with d_dot's dependence on d and on the twists)
  Matrix6 c = Matrix6::Zero();
  const bool viscous = !e.viscosity.isZero(0.0);
  if (viscous) {
    const Matrix6 x = s.even.Derivative(eta2 - eta1) - 0.5 * SmallAdjoint(eta1 + eta2);
    c = (e.viscosity / e.length).asDiagonal() * x;
  }
  c.diagonal() += (e.stiffness + damping_scale * e.viscosity) / e.length;
  if (cable_tangent != nullptr) c += *cable_tangent;

  const Matrix6 even_t = s.even.TransposeDerivative(sigma);
  const Matrix6 half_n = 0.5 * CoadjointMatrix(sigma);
  // f1 = (E - ad/2)^T sigma, f2 = -(E + ad/2)^T sigma
  const Matrix6 d1 = bl.transpose() * c + even_t - half_n;
  const Matrix6 d2 = br.transpose() * c + even_t + half_n;
  out->a11.noalias() = d1 * bl;
  out->a12.noalias() = -(d1 * br);
  out->a21.noalias() = -(d2 * bl);
  out->a22.noalias() = d2 * br;
}

}  // namespace mantle::model
