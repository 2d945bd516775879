#include "controller/reference.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace mantle::controller {
namespace {

constexpr int kSamplesPerSpan = 200;

// Second derivatives' ends are zero, the first tangent is given: the vehicle starts along e3.
std::vector<Vector3> SplineTangents(const std::vector<Vector3>& p, const Vector3& first) {
  const int n = static_cast<int>(p.size());
  Eigen::MatrixXd a = Eigen::MatrixXd::Zero(n, n);
  Eigen::MatrixXd b(n, 3);
  std::vector<double> h;
  for (int i = 0; i + 1 < n; ++i) h.push_back((p[i + 1] - p[i]).norm());
  a(0, 0) = 1;
  b.row(0) = first.transpose();
  for (int i = 1; i + 1 < n; ++i) {
    a(i, i - 1) = h[i];
    a(i, i) = 2 * (h[i - 1] + h[i]);
    a(i, i + 1) = h[i - 1];
    b.row(i) = 3 * (h[i] / h[i - 1] * (p[i] - p[i - 1]) + h[i - 1] / h[i] * (p[i + 1] - p[i]));
  }
  a(n - 1, n - 2) = 1;
  a(n - 1, n - 1) = 2;
  b.row(n - 1) = 3 / h[n - 2] * (p[n - 1] - p[n - 2]);
  const Eigen::MatrixXd m = a.partialPivLu().solve(b);
  std::vector<Vector3> tangents;
  for (int i = 0; i < n; ++i) tangents.push_back(m.row(i).transpose());
  return tangents;
}

}  // namespace

Reference::Reference(const ControlGoal& goal, const model::Robot& robot) : goal_(goal) {
  const model::Pose start = robot.root_pose;
  circle_ = std::get_if<CircleTask>(&goal_);
  if (circle_ != nullptr) arm_base_ = start * robot.arms[circle_->arm].mount;
  task_ = std::get_if<PathTask>(&goal_);
  if (task_ == nullptr) return;
  std::vector<Vector3> points{start.position};
  points.insert(points.end(), task_->waypoints.begin(), task_->waypoints.end());
  const auto tangents = SplineTangents(points, start.rotation * Vector3::UnitZ());
  double distance = 0;
  for (std::size_t i = 0; i + 1 < points.size(); ++i) {
    const double h = (points[i + 1] - points[i]).norm();
    for (int j = i == 0 ? 0 : 1; j <= kSamplesPerSpan; ++j) {
      const double s = static_cast<double>(j) / kSamplesPerSpan;
      const double s2 = s * s, s3 = s2 * s;
      const Vector3 at = (2 * s3 - 3 * s2 + 1) * points[i] + (s3 - 2 * s2 + s) * h * tangents[i] +
                         (3 * s2 - 2 * s3) * points[i + 1] + (s3 - s2) * h * tangents[i + 1];
      const Vector3 slope =
          (6 * s2 - 6 * s) * (points[i] - points[i + 1]) +
          h * ((3 * s2 - 4 * s + 1) * tangents[i] + (3 * s2 - 2 * s) * tangents[i + 1]);
      if (!path_.empty()) distance += (at - path_.back().position).norm();
      path_.push_back({distance, at, slope.normalized()});
    }
    waypoint_m_.push_back(distance);
  }
}

double Reference::Distance(double t_s) const {
  const double ramp = task_->ramp_s, t = std::max(t_s, 0.0);
  if (t < ramp) return 0.5 * task_->speed_m_s * t * t / ramp;
  return task_->speed_m_s * (t - 0.5 * ramp);
}

double Reference::TimeOf(double distance_m) const {
  const double ramp = task_->ramp_s, v = task_->speed_m_s;
  if (distance_m < 0.5 * v * ramp) return std::sqrt(2 * distance_m * ramp / v);
  return distance_m / v + 0.5 * ramp;
}

ReferencePoint Reference::At(double t_s) const {
  ReferencePoint r;
  if (const auto* cruise = std::get_if<CruiseTask>(&goal_)) {
    r.direction = cruise->direction;
    r.velocity = cruise->speed_m_s * cruise->direction;
    return r;
  }
  if (circle_ != nullptr) {
    const double share =
        circle_->approach_s > 0 ? std::clamp(t_s / circle_->approach_s, 0.0, 1.0) : 1.0;
    // smooth from the axis to the circle: value and slope vanish at the start, slope at the end
    const double radius = circle_->radius_m * share * share * (3 - 2 * share);
    const double angle = 2 * std::numbers::pi * t_s / circle_->period_s;
    r.tip = arm_base_.position + arm_base_.rotation * Vector3(circle_->height_m,
                                                              radius * std::cos(angle),
                                                              radius * std::sin(angle));
    return r;
  }
  const double distance = Distance(t_s);
  const double speed = task_->ramp_s > 0 && t_s < task_->ramp_s
                           ? task_->speed_m_s * std::max(t_s, 0.0) / task_->ramp_s
                           : task_->speed_m_s;
  if (distance >= path_.back().distance_m) {
    const Sample& end = path_.back();
    r.direction = end.tangent;
    r.position = end.position + (distance - end.distance_m) * end.tangent;
  } else {
    const auto after =
        std::upper_bound(path_.begin(), path_.end(), distance,
                         [](double d, const Sample& sample) { return d < sample.distance_m; });
    const Sample &a = *(after - 1), &b = *after;
    const double s = (distance - a.distance_m) / (b.distance_m - a.distance_m);
    r.position = a.position + s * (b.position - a.position);
    r.direction = (a.tangent + s * (b.tangent - a.tangent)).normalized();
  }
  r.velocity = speed * r.direction;
  return r;
}

Reference::Bend Reference::Tightest() const {
  Bend out{std::numeric_limits<double>::infinity()};
  for (std::size_t i = 0; i + 1 < path_.size(); ++i) {
    const Sample &a = path_[i], &b = path_[i + 1];
    const double angle = std::atan2(a.tangent.cross(b.tangent).norm(), a.tangent.dot(b.tangent));
    const double length = b.distance_m - a.distance_m;
    if (!(angle > 0) || length > out.radius_m * angle) continue;
    out = {length / angle, angle, length, TimeOf(b.distance_m), b.position};
  }
  return out;
}

double Reference::WaypointTime(int i) const {
  if (i < 0 || i >= static_cast<int>(waypoint_m_.size())) {
    return std::numeric_limits<double>::infinity();
  }
  return TimeOf(waypoint_m_[i]);
}

double Reference::EndTime() const {
  return waypoint_m_.empty() ? std::numeric_limits<double>::infinity()
                             : WaypointTime(static_cast<int>(waypoint_m_.size()) - 1);
}

double Reference::SettledTime() const { return circle_ != nullptr ? circle_->approach_s : 0.0; }

}  // namespace mantle::controller
