#include "model/strain_chain.h"

#include "model/block_tridiagonal.h"

namespace mantle::model {

StrainElement LinearStrainElement(const RodElement& e, const RodElementState& s,
                                  const Vector6& sigma, const Matrix6* cable_tangent,
                                  double damping_scale) {
  StrainElement out;
  out.material.setZero();
  out.material.diagonal() = (e.stiffness + damping_scale * e.viscosity) / e.length;
  if (cable_tangent != nullptr) out.material += *cable_tangent;
  const Matrix6 even = s.even.TransposeDerivative(sigma);
  const Matrix6 odd = 0.5 * CoadjointMatrix(sigma);
  out.turn1 = even - odd;
  out.turn2 = even + odd;
  out.right = TangentOperator(s.d);
  out.left_inverse = s.even.Matrix() - 0.5 * SmallAdjoint(s.d);
  out.a12.setZero();
  out.a21.setZero();
  return out;
}

StrainChain::StrainChain(int n)
    : elements(n), nodes(n + 1), pivot_(n), inverse_(n), gain_(n), inward_(n) {}

bool StrainChain::Factor() {
  const int n = static_cast<int>(elements.size());
  Matrix6 outboard = nodes[n];
  for (int i = n - 1; i >= 0; --i) {
    const StrainElement& e = elements[i];
    const Matrix6 q = e.right.transpose() * outboard * e.right;
    pivot_[i] = e.material + e.right.transpose() * e.turn2 + q;
    inverse_[i] = pivot_[i].inverse();
    if (!inverse_[i].allFinite()) return false;
    gain_[i].noalias() = inverse_[i] * (q * e.left_inverse + e.right.transpose() * e.a21);
    const Matrix6 inner = e.a12 * e.right;
    inward_[i].noalias() = e.left_inverse.transpose() * e.material;
    inward_[i] += e.turn1 - inner;
    outboard = nodes[i] + inner * e.left_inverse + inward_[i] * gain_[i];
  }
  return true;
}

void StrainChain::Solve(const Eigen::Ref<const Eigen::VectorXd>& f,
                        Eigen::Ref<Eigen::VectorXd> zeta, Eigen::Ref<Eigen::VectorXd> delta) {
  const int n = static_cast<int>(elements.size());
  Vector6 p = Vector6::Zero();
  for (int i = n - 1; i >= 0; --i) {
    p += f.segment<6>(6 * i);
    const Vector6 y = inverse_[i] * (elements[i].right.transpose() * p);
    delta.segment<6>(6 * i) = y;
    p.noalias() = inward_[i] * y;
  }
  Vector6 z = Vector6::Zero();
  for (int i = 0; i < n; ++i) {
    const Vector6 d = delta.segment<6>(6 * i) - gain_[i] * z;
    delta.segment<6>(6 * i) = d;
    z = elements[i].right * (d + elements[i].left_inverse * z);
    zeta.segment<6>(6 * i) = z;
  }
}

int StrainChain::NegativePivots() const {
  int negative = 0;
  for (const Matrix6& pivot : pivot_) negative += NegativeEigenvaluesOf<6>(pivot);
  return negative;
}

}  // namespace mantle::model
