#pragma once

#include <string>

#include "model/newton_matrix.h"
#include "model/static_problem.h"

namespace mantle::model {

/// Newton's iteration for one equilibrium, at a fixed load factor or on a plane across the path
/// (Keller's pseudo arc length), with affine-covariant damping: with A the tangent of the iterate,
/// a step alpha A^-1 f is taken only where the natural level falls,
///
///   |A^-1 f(after)| <= (1 - alpha / 4) |A^-1 f(before)|        (Deuflhard, Newton Methods, 3.3)
///
/// The level is a length, whatever the stiffnesses: no scaling of forces enters.
class StaticNewton {
 public:
  enum class Outcome {
    kConverged,
    kNotAState,   ///< no admissible state near: material inside out, mantle closed, mesh too coarse
    kSingular,    ///< the stiffness has a direction without stiffness
    kDiverged,    ///< no damped step lowers the level
    kIterations,  ///< still contracting after max_iterations
    kRoundOff     ///< the increments no longer shrink, above the tolerance
  };

  StaticNewton(const StaticProblem& problem, double tolerance, int max_iterations);

  /// Last converged equilibrium; the caller may set them to go on from elsewhere.
  StaticState state;
  double load_factor{0};  ///< lambda of `state`
  /// Adds shift^2 M [1/s^2] to the tangent that iterates (not to the equations): where the robot
  /// can turn about an axis of symmetry for nothing, the tangent is singular.
  double shift_1_s{0};

  /// From `state` to the equilibrium at `factor`. On success moves state and load_factor.
  Outcome AtLoad(double factor);

  /// From `state` along the unit direction `normal` (path coordinates) by `length`, first guess
  /// `tangent` (per unit of load) times `load_step`; then across it.
  Outcome AlongPath(const VectorX& normal, double length, const StaticStep& tangent,
                    double load_step);

  /// d q / d lambda along the path at `state`, as a step and in path coordinates. False where
  /// the stiffness is singular.
  bool Tangent(StaticStep* by_load, VectorX* path);

  /// Negative eigenvalues of the stiffness at `state` (NewtonMatrix::NegativeEigenvalues); -1 where
  /// it is singular.
  int NegativeEigenvalues();

  int iterations() const { return iterations_; }  ///< factorisations, in all
  int last_iterations() const { return last_; }   ///< of the last call
  /// Of the last call, in path coordinates: what its first iteration foresaw, and the whole way.
  const VectorX& foreseen() const { return foreseen_; }
  const VectorX& travelled() const { return travelled_; }
  double contraction() const { return contraction_; }  ///< of the last iteration
  double increment() const { return size_; }           ///< last, in rad or body lengths
  /// What went wrong, in words: cause and figures, without advice.
  const std::string& reason() const { return reason_; }
  /// Work at `state`, after a success.
  const PlantWork& work() const { return work_; }
  const PlantInputs& inputs() const { return inputs_; }
  NewtonMatrix& matrix() { return matrix_; }

 private:
  struct Plane {
    const VectorX* normal;
    double length;
  };
  Outcome Iterate(double factor, const Plane* plane);
  bool Factor(double shift_1_s);
  void LoadDerivative(double factor);
  double Solve(const Plane* plane, const VectorX& force, StaticStep* step);
  Outcome Fail(Outcome outcome, std::string reason);

  const StaticProblem& problem_;
  double tolerance_;
  int max_iterations_;
  NewtonMatrix matrix_;
  PlantWork work_, next_work_, probe_work_;
  PlantInputs inputs_, next_inputs_;
  StaticState trial_, next_;
  StaticStep step_, bar_, by_load_;
  VectorX load_force_, path_step_, path_by_load_, way_, foreseen_, travelled_;
  std::string reason_;
  double contraction_{0}, size_{0}, plane_left_{0};
  int iterations_{0}, last_{0};
};

}  // namespace mantle::model
