#pragma once

#include <Eigen/Core>

#include "controller/reference.h"

/// @file
/// Steering by pulling sideways: which way each motor pulls, and how far what is steered points
/// beside its aim.
///
/// The lateral plane is (e1, e2) of the root where the vehicle is steered, (y, z) of an arm's base
/// frame where its tip is. A cable at offset d(X) bends its arm towards it, and an arm that trails
/// behind turns the vehicle towards the pulled cable ([physics.md] 9). A motor therefore pulls
/// towards
///
///   n = sum over its cables of gain R int d(X) dX   (R: the arm's mount),
/// projected on the plane; motors whose sum vanishes (a mantle's, symmetric gangs) do not steer. A
/// pull c [N] in the plane is shared out as tensions max(0, n_i . c), n_i of length one.

namespace mantle::controller {

using model::VectorX;
using reduced::ReducedModel;
using reduced::ReducedState;
using Vector2 = Eigen::Vector2d;

/// n_i of every motor as columns, of length one or zero. `tip_arm` is the arm whose tip is steered;
/// negative: the vehicle is.
Eigen::Matrix2Xd PullDirections(const ReducedModel& model, int tip_arm);

/// tensions_i += max(0, n_i . pull).
void AddPull(const Eigen::Matrix2Xd& directions, const Vector2& pull_n,
             Eigen::Ref<VectorX> tensions);

/// Half the sum of n_i n_i^T: for pulls of every direction, tensions that only pull do on average
/// what u = n . c of both signs would do, times one half; the sum of their squares is c^T E c.
Eigen::Matrix2d PullMetric(const Eigen::Matrix2Xd& directions);

/// What is to be steered away, in the lateral plane, and its rate: an angle [rad, rad/s], or the
/// way of a tip [m, m/s].
struct SteeringError {
  Vector2 error{Vector2::Zero()}, rate{Vector2::Zero()};
};

/// Angle between e3 and `aim` (world, any length but zero) with the lateral direction of the aim.
/// The rate is that of a fixed aim: minus the turn rate of e3, -(omega_2, -omega_1).
SteeringError HeadingError(const ReducedState& state, const Vector3& aim);

/// Errors of a goal, `lookahead_s` ahead of the state's time.
class Aim {
 public:
  /// Both must outlive it.
  Aim(const ReducedModel& model, const Reference& reference);

  /// Path: the reference's place ahead, seen from the mantle's centre, as pursuit does. Cruise: the
  /// reference's direction. Circle: the way from the tip to its reference ahead, in the arm's base
  /// frame. No allocation.
  SteeringError At(const ReducedState& state, double lookahead_s);

  /// The tip's reference in its arm's base frame [m], lateral part, where the root is as given.
  Vector2 TipTarget(const model::Pose& root, double t_s) const;

 private:
  SteeringError TipError(const ReducedState& state, double lookahead_s);

  const ReducedModel& model_;
  const Reference& reference_;
  Vector3 centre_{Vector3::Zero()};  ///< of the mantle, in the root frame
  Eigen::Matrix3Xd jacobian_;
};

}  // namespace mantle::controller
