#pragma once

#include "model/newton_matrix.h"

namespace mantle::model {

/// What inputs become at a load factor, but for a current.
void ScaleLoads(const Plant& plant, double factor, PlantInputs* inputs);

/// Whether loads of these effects depend on the velocity through the water: where not, a steady
/// current changes nothing at rest.
bool FeelsCurrent(const Effects& effects);

/// A state of rest with the change of d = l xi of every element from its reference, per arm: read
/// back from poses of size 1 the strains would carry the round-off of those, 1e-16 / l, and EA
/// times that is 1e-4 N where EA = 1e10 N.
struct StaticState : PlantState {
  std::vector<std::vector<Vector6>> extension;  ///< per arm and element [rad, m]
};

/// An increment: of the nodes (body increments, laid out as v) and of the elements' d (6 each, arm
/// after arm), the one to first order what the other is.
struct StaticStep {
  VectorX zeta, strain;  ///< [rad, m]; of the mantle's nodes [m, m, rad]
};

/// The equations of statics: f(q, lambda) = 0, the plant's own forces on a robot at rest in the
/// earth, with every load and actuation at one instant scaled by a load factor lambda.
///
///   loads, pressures, tensions, gravity, changes of reel length    times lambda
///   water current c                                                times sqrt(lambda): drag goes
///                                                                  with its square (a linear one,
///                                                                  whole at 1 too, with its root)
///
/// A body at rest has the twist (0, -R^T c) in the frame that drifts with the water, which is what
/// the plant's loads want ([physics.md] 2). The root is held: clamped, or where a prescribed motion
/// has brought it at the instant.
///
/// Coordinates. Tangents are in body increments zeta of the nodes (laid out as v). What a step
/// moves are the strains: with d = log(g_i^-1 g_i+1) of an element, d <- d + Jr^-1(d) zeta_i+1 -
/// Jl^-1(d) zeta_i, and the poses follow from the held root outwards. To first order this is g
/// exp(zeta^); but the stress after the step is exactly the one the linearisation foresaw. Moving
/// each node by itself instead stretches elements by the square of the rotation, which in a rod of
/// high EA L^2/EI drowns every other force and costs Newton hundreds of iterations.
class StaticProblem {
 public:
  /// Throws BadRobot where the root is free. Keeps a reference to `plant`.
  StaticProblem(const Plant& plant, double time_s);

  const Plant& plant() const { return plant_; }
  /// Inputs at load factor 1, in the earth's frame.
  const PlantInputs& full_inputs() const { return full_; }

  /// The reference shape at rest.
  StaticState Reference() const;

  /// Inputs at a load factor.
  void Scale(double factor, PlantInputs* inputs) const;

  /// f at `state` (whose velocities it sets to those of rest) in work->force, the root's rows zero.
  EvaluationFailure Evaluate(double factor, StaticState* state, PlantInputs* inputs,
                             PlantWork* work) const;

  /// to = from moved by alpha times the step.
  void Move(const StaticState& from, const StaticStep& step, double alpha, StaticState* to) const;

  /// The step A^-1 f of a matrix factored about rest.
  void Solve(const VectorX& force, NewtonMatrix* matrix, StaticStep* step) const;
  /// The step with these body increments; `work` of the last Evaluate.
  StaticStep StepOf(const PlantWork& work, const VectorX& zeta) const;

  /// Size of an increment: the largest rotation [rad], or displacement in body lengths.
  double Size(const VectorX& zeta) const;

  /// Coordinates in which the length of a path is measured: changes of strain, weighted so that
  /// their square is L times the integral of |d kappa|^2 + |d gamma|^2 / L^2 along an arm, and
  /// mean-square displacements of the mantle's nodes (body lengths, rad). Linear along Move().
  int path_size() const { return path_size_; }
  void PathIncrement(const StaticStep& step, VectorX* path) const;

 private:
  const Plant& plant_;
  double time_s_;
  PlantInputs full_;
  Vector3 current_m_s_{Vector3::Zero()};
  int path_size_{0};
};

}  // namespace mantle::model
