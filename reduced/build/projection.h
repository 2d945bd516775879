#pragma once

#include "reduced/build/reduced_plant.h"

namespace mantle::reduced {

/// Between the plant's state and the reduced coordinates.
///
/// Lifting puts the plant's nodes on the reduced strain field (poses and twists, exact kinematics)
/// and the mantle's nodes on reference + Phi s. Projection is least squares on strain, weighted
/// with the stiffness:   min over q of  sum_i l_i |d_i(q)/l_i - xi_i|^2_Sigma,   d_i(q) the
/// logarithm across element i of the lifted arm, by Gauss-Newton with dd_i/dq ~ l_i B, so that a
/// state in the reduced space comes back exactly; rates likewise. The mantle's
/// s = Phi^T M (profile - reference).
class Projection {
 public:
  /// Throws model::BadRobot where the plant's mesh is too coarse to tell the strains apart.
  explicit Projection(const ReducedPlant& model);

  /// `to` is sized as InitialState(model.plant). No allocation.
  void Lift(const ReducedState& from, model::PlantState* to);

  /// Returns false where the iteration does not converge (an element turned too far) or the state
  /// is of another plant; `to` is then not a state.
  bool Project(const model::PlantState& from, ReducedState* to);

 private:
  bool ProjectArm(int a, const model::PlantState& from, ReducedState* to);

  const ReducedPlant& model_;
  std::vector<ReducedArm> lifting_;  ///< sections at the plant's nodes
  std::vector<ArmWork> work_;
  std::vector<std::vector<Matrix6X>> element_basis_;  ///< B at the elements' middles
  std::vector<Eigen::MatrixXd> normal_inverse_;
  model::PlantState trial_;
  VectorX zero_;
};

}  // namespace mantle::reduced
