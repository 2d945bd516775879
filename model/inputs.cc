#include "model/inputs.h"

#include <algorithm>
#include <limits>
#include <numbers>

#include "model/root_motion.h"

namespace mantle::model {
namespace {

// A step that ends on a break point may miss it by round-off.
constexpr double kSameTime_s = 1e-12;
constexpr double kTurn = 2.0 * std::numbers::pi;

MuscleInput InputOf(const MuscleWave& wave, double t, bool from_left) {
  MuscleInput in;
  in.amplitude_n_m = Value(wave.amplitude_n_m, t, from_left);
  in.phase_rad = wave.phase_rad + kTurn * Integral(wave.frequency_hz, t);
  in.wave_number_1_m = kTurn / Value(wave.wave_length_m, t, from_left);
  return in;
}

double IsAttached(const Payload& payload, double t, bool from_left) {
  if (!payload.drop_s) return 1.0;
  const bool before = from_left ? t <= *payload.drop_s + kSameTime_s : t < *payload.drop_s - kSameTime_s;
  return before ? 1.0 : 0.0;
}

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
    for (const auto& m : arm.muscles) {
      for (const auto* s : {&m.amplitude_n_m, &m.wave_length_m, &m.frequency_hz}) visit(*s);
      for (const auto& e : m.envelope) visit(e.factor);
    }
  }
  if (robot.mantle) {
    for (const auto& s : robot.mantle->strips) visit(s.pressure_pa);
    for (const auto& s : robot.mantle->spokes) drive(s.drive);
  }
  if (robot.effects.normal_pressure) visit(robot.effects.normal_pressure->pressure_pa);
  if (const auto& current = robot.effects.unsteady_current) {
    for (const auto* s : {&current->x_m_s, &current->y_m_s, &current->z_m_s}) visit(*s);
  }
  if (const auto* root = std::get_if<PrescribedRoot>(&robot.root)) {
    for (const auto* s : {&root->x_m, &root->y_m, &root->z_m, &root->angle_rad}) {
      if (*s) visit(**s);
    }
  }
}

}  // namespace

WaterMotion EvaluateWater(const Effects& effects, double t_s, bool from_left) {
  WaterMotion out;
  if (effects.current_m_s) {
    out.velocity_m_s = *effects.current_m_s;
    out.drift_m = t_s * *effects.current_m_s;
  }
  if (const auto& current = effects.unsteady_current) {
    int axis = 0;
    for (const auto* s : {&current->x_m_s, &current->y_m_s, &current->z_m_s}) {
      out.velocity_m_s(axis) = Value(*s, t_s, from_left);
      out.drift_m(axis) = Integral(*s, t_s);
      out.acceleration_m_s2(axis) = Rate(*s, t_s, from_left);
      ++axis;
    }
  }
  return out;
}

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
  in.muscles.clear();
  in.envelopes.clear();
  in.payloads.clear();
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
    for (const auto& m : arm.muscles) {
      in.muscles.push_back(InputOf(m, t_s, from_left));
      in.muscles.back().first_envelope = static_cast<int>(in.envelopes.size());
      for (const auto& e : m.envelope) in.envelopes.push_back(Value(e.factor, t_s, from_left));
    }
    for (const auto& p : arm.payloads) in.payloads.push_back(IsAttached(p, t_s, from_left));
  }
  if (robot.effects.unsteady_current) {
    in.water_acceleration_m_s2 = EvaluateWater(robot.effects, t_s, from_left).acceleration_m_s2;
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
  for (const Arm& arm : robot.arms) {
    for (const Payload& p : arm.payloads) {
      if (p.drop_s && *p.drop_s > t_s + kSameTime_s) next = std::min(next, *p.drop_s);
    }
  }
  return next;
}

}  // namespace mantle::model
