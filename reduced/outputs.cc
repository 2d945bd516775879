#include "reduced/outputs.h"

#include <cmath>

namespace mantle::reduced {
namespace {

using model::SmallAdjointTimes;

// Omega of one interval at the coordinates q of its group.
Vector6 OmegaOf(const Interval& v, const Eigen::Map<const VectorX>& q) {
  const Vector6 linear = v.basis.lazyProduct(q);
  if (!v.magnus) return v.reference + linear;
  const Vector6 a = v.rest1 + v.basis1.lazyProduct(q), b = v.rest2 + v.basis2.lazyProduct(q);
  return linear + 0.5 * v.length_m * (v.rest1 + v.rest2) + v.kappa * SmallAdjointTimes(a, b);
}

// dOmega/dq_i.
Vector6 OmegaColumn(const Interval& v, const Eigen::Map<const VectorX>& q, int i) {
  Vector6 e = v.basis.col(i);
  if (v.magnus) {
    const Vector6 a = v.rest1 + v.basis1.lazyProduct(q), b = v.rest2 + v.basis2.lazyProduct(q);
    e += v.kappa * (SmallAdjointTimes(a, v.basis2.col(i)) - SmallAdjointTimes(b, v.basis1.col(i)));
  }
  return e;
}

}  // namespace

void StateDifference(const ReducedState& from, const ReducedState& to, Eigen::Ref<VectorX> out) {
  const auto n = from.v.size();
  out.head<6>() = model::LogSE3(model::Inverse(from.root) * to.root);
  out.segment(6, n - 6) = to.q - from.q;
  out.tail(n) = to.v - from.v;
}

void MoveState(const ReducedState& from, const Eigen::Ref<const VectorX>& by, ReducedState* to) {
  const auto n = from.v.size();
  to->time_s = from.time_s;
  to->root = from.root * model::ExpSE3(by.head<6>());
  to->q = from.q + by.segment(6, n - 6);
  to->v = from.v + by.tail(n);
}

bool IsFinite(const ReducedState& s) {
  return s.q.allFinite() && s.v.allFinite() && s.root.position.allFinite() &&
         s.root.rotation.coeffs().allFinite() && std::isfinite(s.time_s);
}

std::vector<bool> BendingCoordinates(const ReducedArm& arm) {
  std::vector<bool> bends(static_cast<std::size_t>(arm.size()));
  for (std::size_t g = 0; g < arm.basis.groups().size(); ++g) {
    const StrainGroup& group = arm.basis.groups()[g];
    Matrix6X middle, end;  // a column may vanish at one of them
    arm.basis.Evaluate(static_cast<int>(g), 0.5 * (group.from_m + group.to_m), &middle);
    arm.basis.Evaluate(static_cast<int>(g), group.to_m, &end);
    for (int c = 0; c < group.columns; ++c) {
      bends[static_cast<std::size_t>(group.first + c)] =
          middle.col(c).head<3>().norm() + end.col(c).head<3>().norm() > 0;
    }
  }
  return bends;
}

Pose EvaluateTip(const ReducedArm& arm, const double* q, Eigen::Ref<Eigen::Matrix3Xd>* jacobian) {
  Pose tip = arm.mount;
  TangentJet jet;
  for (const Interval& v : arm.intervals) {
    const StrainGroup& group = arm.basis.groups()[v.group];
    const Vector6 omega = OmegaOf(v, Eigen::Map<const VectorX>(q + group.first, group.columns));
    tip = tip * model::ExpSE3(omega);
  }
  if (jacobian == nullptr) return tip;
  jacobian->setZero();
  Pose at = arm.mount;
  for (const Interval& v : arm.intervals) {
    const StrainGroup& group = arm.basis.groups()[v.group];
    const Eigen::Map<const VectorX> local(q + group.first, group.columns);
    const Vector6 omega = OmegaOf(v, local);
    EvaluateTangentJet(omega, Vector6::Zero(), &jet);
    at = at * model::ExpSE3(omega);
    const Vector3 lever = at.rotation.conjugate() * (tip.position - at.position);
    for (int i = 0; i < group.columns; ++i) {
      const Vector6 twist = jet.value.Times(OmegaColumn(v, local, i));
      const Vector3 velocity = twist.tail<3>() + twist.head<3>().cross(lever);
      jacobian->col(group.first + i) += at.rotation * velocity;
    }
  }
  return tip;
}

VolumeFunction::VolumeFunction(const ReducedMantle& mantle)
    : polynomials_(mantle.polynomials), output_(mantle.volume) {
  polynomials_.Size(&values_);
}

double VolumeFunction::Evaluate(const double* s) {
  polynomials_.Evaluate(s, false, &values_);
  return values_.value(output_);
}

}  // namespace mantle::reduced
