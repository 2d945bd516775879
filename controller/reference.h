#pragma once

#include <vector>

#include "controller/options.h"
#include "reduced/reduced_model.h"

namespace mantle::controller {

using model::Vector3;

/// What a Reference says of one instant.
struct ReferencePoint {
  Vector3 position{Vector3::Zero()};    ///< of the root, world [m]
  Vector3 direction{Vector3::UnitZ()};  ///< of e3, world
  Vector3 velocity{Vector3::Zero()};    ///< of the root, world [m/s]
  Vector3 tip{Vector3::Zero()};         ///< of the circle's arm, world [m]
};

/// Where a goal wants the robot to be, as a function of time.
///
/// Path: a cubic Hermite curve through the root's first place and the waypoints, with the tangents
/// of the natural cubic spline over chord length, travelled at constant speed (by arc length) after
/// a start of constant acceleration. It goes straight on beyond the last waypoint.
class Reference {
 public:
  /// The root starts at the robot's initial pose.
  Reference(const ControlGoal& goal, const model::Robot& robot);
  Reference(const Reference&) = delete;
  Reference& operator=(const Reference&) = delete;

  ReferencePoint At(double t_s) const;
  /// When the reference passes waypoint i; infinite where there is none.
  double WaypointTime(int i) const;
  /// When the goal's reference has come to its end (the last waypoint); infinite for the others.
  double EndTime() const;
  /// From here on the error counts (circle: after the approach).
  double SettledTime() const;
  /// Where a path bends most. Its tangent turns by `angle_rad` within `length_m`, of which the
  /// radius is the one over the other.
  struct Bend {
    double radius_m{0};  ///< infinite where it is straight
    double angle_rad{0}, length_m{0};
    double time_s{0};
    Vector3 position{Vector3::Zero()};
  };
  /// Of a goal with a position.
  Bend Tightest() const;
  bool has_position() const { return !path_.empty(); }
  bool has_tip() const { return circle_ != nullptr; }
  int arm() const { return circle_ == nullptr ? -1 : circle_->arm; }

 private:
  double Distance(double t_s) const;
  double TimeOf(double distance_m) const;

  ControlGoal goal_;
  const PathTask* task_{nullptr};
  const CircleTask* circle_{nullptr};
  model::Pose arm_base_;
  struct Sample {
    double distance_m;
    Vector3 position, tangent;
  };
  std::vector<Sample> path_;  ///< dense, by arc length
  std::vector<double> waypoint_m_;
};

}  // namespace mantle::controller
