#pragma once

#include "model/robot.h"

/// Where the root is and how it moves, for every body and both models from this one place: at the
/// start of a run, and at any time where it is clamped or prescribed. With x_0, R_0 the robot's
/// pose, s_i and alpha the schedules of a prescribed root, n its axis and c(t) the uniform current,
///
///   x = x_0 + sum_i e_i s_i(t) - int_0^t c dt,   R = exp(alpha(t) n^) R_0,
///   twist (w, v) = (R^T alpha' n, R^T x'),   its rate (R^T alpha'' n, R^T x'' - w x v)
///
/// in the frame that drifts with the current (model/plant.h). Schedules are continuous (a jump of a
/// place is no motion) but may have kinks; there the twist jumps, and the support exerts an impulse
/// (CrossRootKink in model/plant.h).

namespace mantle::model {

struct RootKinematics {
  Pose pose;
  Vector6 twist{Vector6::Zero()};         ///< body frame [rad/s, m/s]
  Vector6 acceleration{Vector6::Zero()};  ///< rate of the twist's components [rad/s^2, m/s^2]
};

/// At time t of a root that is clamped or prescribed; limits from the left with `from_left`. A free
/// root gives its start (t = 0), at rest in its own acceleration.
RootKinematics EvaluateRootMotion(const Robot& robot, double t_s, bool from_left = false);

/// Throws BadRobot where a schedule of the root jumps: names the schedule, the time and the jump.
void CheckRootMotion(const Robot& robot);

}  // namespace mantle::model
