#include "model/rod_element.h"

namespace mantle::model {
namespace {

// The 6x6 matrix [a 0; b a].
struct TangentBlocks {
  Matrix3 a, b;
};

Matrix6 TransposeTimes(const TangentBlocks& j, const Matrix6& c) {
  Matrix6 y;
  y.topRows<3>().noalias() = j.a.transpose() * c.topRows<3>();
  y.topRows<3>().noalias() += j.b.transpose() * c.bottomRows<3>();
  y.bottomRows<3>().noalias() = j.a.transpose() * c.bottomRows<3>();
  return y;
}

void Times(const Matrix6& c, const TangentBlocks& j, Matrix6* y) {
  y->leftCols<3>().noalias() = c.leftCols<3>() * j.a;
  y->leftCols<3>().noalias() += c.rightCols<3>() * j.b;
  y->rightCols<3>().noalias() = c.rightCols<3>() * j.a;
}

}  // namespace

void AddResidualBending(RodElement* e) {
  for (int k : {0, 1}) {
    const int shear = 4 + k, bending = 2 - k;  // y with the turn about z, z with that about y
    const double section = e->stiffness(shear),
                 residual = 12.0 * e->stiffness(bending) / (e->length * e->length);
    if (!(section > 0.0) || !(residual > 0.0)) continue;
    const double both = 1.0 / (1.0 / section + 1.0 / residual);
    const double share = both / section, rest = both / residual;
    e->viscosity(shear) = share * share * e->viscosity(shear) +
                          rest * rest * 12.0 * e->viscosity(bending) / (e->length * e->length);
    e->stiffness(shear) = both;
    e->shear_share(k) = share;
  }
}

bool EvaluateRodElement(const Pose& g1, const Pose& g2, const Vector6& eta1, const Vector6& eta2,
                        RodElementState* state) {
  const Eigen::Quaterniond inverse = g1.rotation.conjugate();
  Pose h;
  h.rotation = inverse * g2.rotation;
  h.position = inverse * (g2.position - g1.position);
  state->even = EvenTangentInverse(h, &state->d);
  if (!(state->d.head<3>().squaredNorm() < kMaxElementRotation * kMaxElementRotation)) return false;
  state->middle = MiddleOf(h);
  state->d_dot = state->even.Times(eta2 - eta1) + 0.5 * SmallAdjointTimes(state->d, eta1 + eta2);
  return state->d_dot.allFinite();
}

void RodElementTangents(const RodElement& e, const RodElementState& s, const Vector6& eta1,
                        const Vector6& eta2, const Vector6& sigma, const Matrix6* cable_tangent,
                        double damping_scale, RodElementTangent* out) {
  // Jr^-1 = [a 0; b a], Jl^-1 = [a' 0; b' a'] in 3x3 blocks, with +- ad/2.
  const Matrix6 even = s.even.Matrix();
  const Matrix3 half_w = 0.5 * Hat(s.d.head<3>());
  const Matrix3 half_v = 0.5 * Hat(s.d.tail<3>());
  const TangentBlocks right{even.topLeftCorner<3, 3>() + half_w,
                            even.bottomLeftCorner<3, 3>() + half_v};
  const TangentBlocks left{even.topLeftCorner<3, 3>() - half_w,
                           even.bottomLeftCorner<3, 3>() - half_v};

  // d sigma = c dd (with d_dot's dependence on d and on the twists)
  Matrix6 c = Matrix6::Zero();
  if (!e.viscosity.isZero(0.0)) {
    const Matrix6 x = s.even.Derivative(eta2 - eta1) - 0.5 * SmallAdjoint(eta1 + eta2);
    c = (e.viscosity / e.length).asDiagonal() * x;
  }
  c.diagonal() += (e.stiffness + damping_scale * e.viscosity) / e.length;
  if (cable_tangent != nullptr) c += *cable_tangent;

  // f1 = (E - ad/2)^T sigma, f2 = -(E + ad/2)^T sigma
  const Matrix6 even_t = s.even.TransposeDerivative(sigma);
  const Matrix6 half_n = 0.5 * CoadjointMatrix(sigma);
  const Matrix6 d1 = TransposeTimes(left, c) + (even_t - half_n);
  const Matrix6 d2 = TransposeTimes(right, c) + (even_t + half_n);
  Times(d1, left, &out->a11);
  Times(d1, right, &out->a12);
  Times(d2, left, &out->a21);
  Times(d2, right, &out->a22);
  out->a12 = -out->a12;
  out->a21 = -out->a21;
}

}  // namespace mantle::model
