#pragma once

#include <memory>

#include "controller/controller.h"
#include "controller/steering.h"

/// @file
/// The controllers that the receding-horizon one is compared with: each a gait of the scene,
/// scaled, and pulls of the lateral plane (steering.h) on top. Parameters are
/// ControlOptions::baselines; `mantle tune` finds them.
///
///   tensions = low + s (gait(t + gait_lead) - low) + max(0, n_i . c)
///   s = gait_scale a + speed_gain e,  within what the limits allow; e is the way along the track
///       [m] by which the reference is ahead (path), or the error of the speed averaged over a
///       period of the gait [m/s] (cruise); a is the reference's speed over the path's (thrust goes
///       with s^2, drag with the speed squared), or its radius over the circle's
///
///   gait      c = 0, s = gait_scale: open loop
///   pursuit   c = P e + D e_dot, e towards the reference ahead (path: its place seen from the
///             mantle's centre, [physics.md] 9; cruise: its direction; circle: the tip's)
///   pid       c = P e + I int e dt + D e_dot, the integral held where the pull is cut
///   lqr       lqr.h
///
/// On a circle the gait is a feed-forward whose pulses go round. The rate of a heading's error is
/// filtered.

namespace mantle::controller {

/// PID of a lateral error. The pull is cut at `most_n`; while it is, the integral moves only where
/// that brings the pull back (anti-windup by conditional integration).
struct LateralPid {
  double proportional{0}, integral{0}, derivative{0}, most_n{0};
  Vector2 sum{Vector2::Zero()};  ///< of the error over time

  Vector2 Update(const SteeringError& e, double dt_s);
};

/// `kind` is not kMpc. Tensions are within the motors' bounds, whatever the estimate; where there
/// is none, or one that is not finite, the gait goes on by itself. No allocation in Command. Throws
/// model::BadRobot where the model cannot be linearised (lqr).
std::unique_ptr<Controller> MakeBaseline(const ControllerParts& parts, ControllerKind kind);

}  // namespace mantle::controller
