#include "model/inputs.h"

#include <algorithm>
#include <limits>

#include "model/root_motion.h"

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
  if (!std::holds_alternative<FreeRoot>(robot.root)) {
    const RootKinematics root = EvaluateRootMotion(robot, t_s, from_left);
    in.root_pose = root.pose;
    in.root_twist = root.twist;
    in.root_acceleration = root.acceleration;
  }
}

double NextBreakpoint(const Robot& robot, double t_s) {
  double next = std::numeric_limits<double>::infinity();
  ForEachSchedule(robot, [&](const Schedule& s) { next = std::min(next, NextBreakpoint(s, t_s)); });
  return next;
}

}  // namespace mantle::model
