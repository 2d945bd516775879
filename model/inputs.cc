#include "model/inputs.h"

#include <algorithm>
#include <limits>

namespace mantle::model {
namespace {

CableInput InputOf(const CableDrive& drive, double rest_m, double t, bool from_left) {
  CableInput in;
  if (const auto* given = std::get_if<GivenTension>(&drive)) {
    in.tension_n = std::max(Value(given->tension_n, t, from_left), 0.0);
    return in;
  }
  const auto& reel = std::get<ReeledLength>(drive);
  in.reeled = true;
  in.reel_m = rest_m + Value(reel.length_change_m, t, from_left);
  in.reel_rate_m_s = Rate(reel.length_change_m, t, from_left);
  in.stiffness_n_m = reel.stiffness_n_m;
  in.damping_n_s_m = reel.damping_n_s_m;
  return in;
}

template <typename Visit>
void ForEachSchedule(const Robot& robot, Visit visit) {
  const auto drive = [&](const CableDrive& d) {
    if (const auto* given = std::get_if<GivenTension>(&d)) {
      visit(given->tension_n);
    } else {
      visit(std::get<ReeledLength>(d).length_change_m);
    }
  };
  for (const Arm& arm : robot.arms) {
    for (const auto& d : arm.distributed) visit(d.schedule);
    for (const auto& p : arm.points) visit(p.schedule);
    for (const auto& c : arm.cables) drive(c.drive);
  }
  if (robot.mantle) {
    for (const auto& s : robot.mantle->strips) visit(s.pressure_pa);
    for (const auto& s : robot.mantle->spokes) drive(s.drive);
  }
  if (robot.effects.normal_pressure) visit(robot.effects.normal_pressure->pressure_pa);
  if (const auto* root = std::get_if<PrescribedRoot>(&robot.root)) {
    for (const auto* s : {&root->x_m, &root->y_m, &root->z_m, &root->angle_rad}) {
      if (*s) visit(**s);
    }
  }
}

}  // namespace

double CableTension(const CableInput& in, double length_m, double rate_m_s) {
  if (!in.reeled) return in.tension_n;
  return std::max(0.0, in.stiffness_n_m * (length_m - in.reel_m) +
                           in.damping_n_s_m * (rate_m_s - in.reel_rate_m_s));
}

void EvaluateInputs(const Robot& robot, const std::vector<double>& cable_rest_m, double t_s,
                    bool from_left, PlantInputs* inputs) {
  PlantInputs& in = *inputs;
  in.cables.clear();
  in.distributed.clear();
  in.points.clear();
  in.strips_pa.clear();
  std::size_t cable = 0;
  for (const Arm& arm : robot.arms) {
    for (const auto& d : arm.distributed) {
      in.distributed.push_back(Value(d.schedule, t_s, from_left));
    }
    for (const auto& p : arm.points) in.points.push_back(Value(p.schedule, t_s, from_left));
    for (const auto& c : arm.cables) {
      in.cables.push_back(InputOf(c.drive, cable_rest_m[cable++], t_s, from_left));
    }
  }
  if (robot.mantle) {
    for (const auto& s : robot.mantle->strips) {
      in.strips_pa.push_back(Value(s.pressure_pa, t_s, from_left));
    }
    for (const auto& s : robot.mantle->spokes) {
      in.cables.push_back(InputOf(s.drive, cable_rest_m[cable++], t_s, from_left));
    }
  }
  if (robot.effects.normal_pressure) {
    in.normal_pressure_pa = Value(robot.effects.normal_pressure->pressure_pa, t_s, from_left);
  }
  const Vector3 drift = robot.effects.current_m_s.value_or(Vector3::Zero());
  if (const auto* root = std::get_if<PrescribedRoot>(&robot.root)) {
    Vector3 p = Vector3::Zero(), rate = Vector3::Zero(), second = Vector3::Zero();
    int axis = 0;
    for (const auto* s : {&root->x_m, &root->y_m, &root->z_m}) {
      if (*s) {
        p(axis) = Value(**s, t_s, from_left);
        rate(axis) = Rate(**s, t_s, from_left);
        second(axis) = SecondRate(**s, t_s, from_left);
      }
      ++axis;
    }
    double angle = 0, angle_rate = 0, angle_second = 0;
    if (root->angle_rad) {
      angle = Value(*root->angle_rad, t_s, from_left);
      angle_rate = Rate(*root->angle_rad, t_s, from_left);
      angle_second = SecondRate(*root->angle_rad, t_s, from_left);
    }
    in.root_pose.rotation = ExpSO3(angle * root->rotation_axis) * robot.root_pose.rotation;
    in.root_pose.position = robot.root_pose.position + p - drift * t_s;
    const Eigen::Quaterniond back = in.root_pose.rotation.conjugate();
    const Vector3 w = back * (angle_rate * root->rotation_axis);
    const Vector3 v = back * (rate - drift);
    in.root_twist << w, v;
    in.root_acceleration << back * (angle_second * root->rotation_axis), back * second - w.cross(v);
  } else if (std::holds_alternative<ClampedRoot>(robot.root)) {
    in.root_pose = robot.root_pose;
    in.root_pose.position -= drift * t_s;
    in.root_twist << Vector3::Zero(), in.root_pose.rotation.conjugate() * (-drift);
  }
}

double NextBreakpoint(const Robot& robot, double t_s) {
  double next = std::numeric_limits<double>::infinity();
  ForEachSchedule(robot, [&](const Schedule& s) { next = std::min(next, NextBreakpoint(s, t_s)); });
  return next;
}

}  // namespace mantle::model
