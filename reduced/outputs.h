#pragma once

#include "reduced/reduced_model.h"

/// @file
/// What a controller looks at in a reduced state, with first derivatives: differences of states on
/// the manifold, places of tips, volume of the mantle.

namespace mantle::reduced {

/// (zeta, dq, dv) with to = from moved by it: zeta = log(g_from^-1 g_to), in the body frame of
/// `from`. 2 velocity_count entries; written into `out`, no allocation.
void StateDifference(const ReducedState& from, const ReducedState& to, Eigen::Ref<VectorX> out);

/// `from` moved by (zeta, dq, dv). `to` is sized like `from`.
void MoveState(const ReducedState& from, const Eigen::Ref<const VectorX>& by, ReducedState* to);

/// Whether every number of the state is finite, its time included.
bool IsFinite(const ReducedState& state);

/// Of each coordinate of an arm: whether it bends or twists its sections; else it shears and
/// stretches them alone. Allocates.
std::vector<bool> BendingCoordinates(const ReducedArm& arm);

/// The tip of an arm relative to the root, and d(position)/dq of the arm's coordinates in the root
/// frame (3 x arm.size(), or null where it is not needed):
///   h_k = h_{k-1} exp(Omega_k(q)),  dp/dq = sum_k R_k (v + w x R_k^T (p - p_k)),
///   (w, v) = T(Omega_k) dOmega_k/dq.
Pose EvaluateTip(const ReducedArm& arm, const double* q, Eigen::Ref<Eigen::Matrix3Xd>* jacobian);

/// Volume and its gradient in the mantle's coordinates; allocated once per mantle.
class VolumeFunction {
 public:
  explicit VolumeFunction(const ReducedMantle& mantle);
  double Evaluate(const double* s);
  auto gradient() const { return values_.gradient.col(output_); }

 private:
  Polynomials polynomials_;
  PolynomialValues values_;
  int output_;
};

}  // namespace mantle::reduced
