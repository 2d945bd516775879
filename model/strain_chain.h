#pragma once

#include <vector>

#include "model/rod_element.h"

namespace mantle::model {

/// An element about rest: what its two nodes' forces do under delta (symbols as in StrainChain).
struct StrainElement {
  Matrix6 material;      ///< C
  Matrix6 turn1, turn2;  ///< G1, G2
  Matrix6 right;         ///< Jr
  Matrix6 left_inverse;  ///< Jl^-1
  Matrix6 a12, a21;      ///< of what the element carries inside; zero as made
};

/// `cable_tangent`, where not null, is d sigma_cable / d d; `damping_scale` times the viscosity
/// adds to C.
StrainElement LinearStrainElement(const RodElement& e, const RodElementState& s,
                                  const Vector6& sigma, const Matrix6* cable_tangent,
                                  double damping_scale);

/// O(N) direct solver for the tangent of an arm whose root is held, in the strains of its elements.
///
/// With h = Jl^-1 zeta_i-1 the increment of an element's d and of its outer node are
///   delta_i = Jr^-1 zeta_i - h,   zeta_i = Jr (delta_i + h),
/// the element's forces change by -(Jr^-T C + G2) delta on the outer and +(Jl^-T C + G1) delta on
/// the inner node (C material and cables, G how the transport of the stress turns). All that lies
/// outboard of node i answers with P_i zeta_i; eliminating from the tip,
///   M = C + Jr^T G2 + Q,  Q = Jr^T P_i Jr,  delta_i = M^-1 (Jr^T p_i - Q h),
///   P_i-1 = N_i-1 + (Jl^-T C + G1) M^-1 Q Jl^-1,   p_i-1 = f_i-1 + (Jl^-T C + G1) M^-1 Jr^T p_i,
/// N the nodes' own blocks (loads, inertia). Loads and inertia inside an element act on both of its
/// nodes: with blocks a11, a12, a21, a22 on (zeta_i-1, zeta_i), of which the first and the last are
/// in N,
///   delta_i = M^-1 (Jr^T p_i - Q h - Jr^T a21 zeta_i-1),
///   P_i-1 = N_i-1 + a12 Jr Jl^-1 + E M^-1 (Q Jl^-1 + Jr^T a21),   p_i-1 = f_i-1 + E M^-1 Jr^T p_i,
///   E = Jl^-T C + G1 - a12 Jr.
/// Stiff strains make M large and drop out: nothing of
/// size EA / l is subtracted from its like, as it is where nodes are eliminated, which leaves the
/// bending of a rod with EA L^2 / EI = 1e10 in the round-off of its stretch. The M are the pivots
/// of the tangent in the coordinates delta.
class StrainChain {
 public:
  explicit StrainChain(int elements = 0);

  std::vector<StrainElement> elements;  ///< from the base
  std::vector<Matrix6> nodes;           ///< N_0 ... N_n; N_0 is not used

  /// False where a pivot is singular or not finite.
  bool Factor();
  /// f: forces on nodes 1 ... n. zeta of nodes 1 ... n and delta of the elements, 6 n each.
  void Solve(const Eigen::Ref<const Eigen::VectorXd>& f, Eigen::Ref<Eigen::VectorXd> zeta,
             Eigen::Ref<Eigen::VectorXd> delta);
  /// Negative eigenvalues of the symmetric part of the pivots (BlockTridiagonal::NegativePivots).
  int NegativePivots() const;

 private:
  std::vector<Matrix6> pivot_, inverse_, gain_, inward_;
};

}  // namespace mantle::model
