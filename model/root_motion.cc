#include "model/root_motion.h"

#include <fmt/format.h>

#include <utility>

#include "model/inputs.h"
#include "model/rod.h"

namespace mantle::model {

RootKinematics EvaluateRootMotion(const Robot& robot, double t_s, bool from_left) {
  const WaterMotion water = EvaluateWater(robot.effects, t_s, from_left);
  const Vector3& drift = water.velocity_m_s;
  RootKinematics out{robot.root_pose};
  Vector3 rate = Vector3::Zero(), second = Vector3::Zero(), turn_rate = Vector3::Zero(),
          turn_second = Vector3::Zero();
  if (std::holds_alternative<FreeRoot>(robot.root)) {
    out.twist = robot.root_twist;  // the earth's
    out.twist.tail<3>() -= out.pose.rotation.conjugate() * drift;
    return out;
  }
  if (const auto* root = std::get_if<PrescribedRoot>(&robot.root)) {
    int axis = 0;
    for (const auto* s : {&root->x_m, &root->y_m, &root->z_m}) {
      if (*s) {
        out.pose.position(axis) += Value(**s, t_s, from_left);
        rate(axis) = Rate(**s, t_s, from_left);
        second(axis) = SecondRate(**s, t_s, from_left);
      }
      ++axis;
    }
    if (root->angle_rad) {
      const Vector3& n = root->rotation_axis;
      out.pose.rotation =
          ExpSO3(Value(*root->angle_rad, t_s, from_left) * n) * robot.root_pose.rotation;
      turn_rate = Rate(*root->angle_rad, t_s, from_left) * n;
      turn_second = SecondRate(*root->angle_rad, t_s, from_left) * n;
    }
  }
  out.pose.position -= water.drift_m;
  second -= water.acceleration_m_s2;
  const Eigen::Quaterniond back = out.pose.rotation.conjugate();
  const Vector3 w = back * turn_rate, v = back * (rate - drift);
  out.twist << w, v;
  out.acceleration << back * turn_second, back * second - w.cross(v);
  return out;
}

void CheckRootMotion(const Robot& robot) {
  if (const auto& current = robot.effects.unsteady_current) {
    const std::pair<const char*, const Schedule*> components[] = {
        {"x", &current->x_m_s}, {"y", &current->y_m_s}, {"z", &current->z_m_s}};
    for (const auto& [name, schedule] : components) {
      const std::optional<ScheduleJump> jump = FirstJump(*schedule);
      if (!jump) continue;
      throw BadRobot(fmt::format(
          "effects.current.{}: jumps by {:.6g} m/s at t = {:.6g} s, must be continuous: water that "
          "jumps accelerates without bound; give it the time it takes, in a table or a cubic",
          name, jump->size, jump->time_s));
    }
  }
  const auto* root = std::get_if<PrescribedRoot>(&robot.root);
  if (root == nullptr) return;
  const std::pair<const char*, const std::optional<Schedule>*> schedules[] = {
      {"x", &root->x_m}, {"y", &root->y_m}, {"z", &root->z_m}, {"angle", &root->angle_rad}};
  for (const auto& [name, schedule] : schedules) {
    if (!*schedule) continue;
    const std::optional<ScheduleJump> jump = FirstJump(**schedule);
    if (!jump) continue;
    throw BadRobot(fmt::format(
        "robot.root.{}: jumps by {:.6g} {} at t = {:.6g} s, must be continuous: a root cannot be "
        "in "
        "two places at once; give it the time it takes, in a table",
        name, jump->size, name == std::string_view("angle") ? "rad" : "m", jump->time_s));
  }
}

}  // namespace mantle::model
