#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "controller/registry.h"
#include "loop/scene/scene_parts.h"

namespace mantle::scene {
namespace {

constexpr Range kShare{0, 1};

ControlGoal ReadGoal(TomlReader t, const Robot& robot) {
  enum class Type { kCruise, kPath, kCircle };
  const Type type = t.Choice<Type>(
      "type", {{"cruise", Type::kCruise}, {"path", Type::kPath}, {"circle", Type::kCircle}},
      Type::kCruise);
  ControlGoal goal;
  if (type == Type::kCruise) {
    CruiseTask g;
    g.direction = t.OptionalDirection("direction").value_or(g.direction);
    g.speed_m_s = t.Number("speed", Quantity::kSpeed, kPositive, g.speed_m_s);
    goal = g;
  } else if (type == Type::kPath) {
    PathTask g;
    for (TomlReader& point : t.Tables("waypoints")) {
      if (!point.Has("at")) point.Fail("at", "is missing: a place in the world, three lengths");
      g.waypoints.push_back(point.Vector("at", Quantity::kLength, Vector3::Zero()));
      point.Finish();
    }
    if (g.waypoints.empty()) t.Fail("waypoints", "is empty: a path needs at least one waypoint");
    Vector3 before = robot.root_pose.position;
    for (const Vector3& point : g.waypoints) {
      if ((point - before).norm() < 1e-6) t.Fail("waypoints", "two places in turn are the same");
      before = point;
    }
    g.speed_m_s = t.Number("speed", Quantity::kSpeed, kPositive, g.speed_m_s);
    g.ramp_s = t.Number("ramp", Quantity::kTime, kNonNegative, g.ramp_s);
    g.tolerance_m = t.Number("tolerance", Quantity::kLength, kPositive,
                             robot.body_length_m > 0 ? 0.05 * robot.body_length_m : g.tolerance_m);
    goal = g;
  } else {
    CircleTask g;
    const std::string name = t.Text("arm", robot.arms.empty() ? "" : robot.arms[0].name);
    const auto arm = std::find_if(robot.arms.begin(), robot.arms.end(),
                                  [&](const Arm& a) { return a.name == name; });
    if (arm == robot.arms.end()) t.Fail("arm", "is no arm of this scene");
    g.arm = static_cast<int>(arm - robot.arms.begin());
    const Range reach{0, arm->length_m, true};
    g.radius_m = t.Number("radius", Quantity::kLength, reach, 0.25 * arm->length_m);
    g.height_m = t.Number("height", Quantity::kLength, reach, 0.95 * arm->length_m);
    g.period_s = t.Number("period", Quantity::kTime, kPositive, g.period_s);
    g.approach_s = t.Number("approach", Quantity::kTime, kNonNegative, g.approach_s);
    goal = g;
  }
  t.Finish();
  return goal;
}

ControlGrid ReadGrid(TomlReader t) {
  ControlGrid g;
  g.steps = t.Integer("steps", 1, 200, g.steps);
  g.step_s = t.Number("step", Quantity::kTime, kPositive, g.step_s);
  g.growth = t.Number("growth", Quantity::kNumber, Range{1, 2}, g.growth);
  if (t.Has("knots")) {
    int before = 0;
    for (const double k : t.Numbers("knots", Quantity::kNumber, Range{1, double(g.steps)})) {
      if (k != std::floor(k) || k <= before) t.Fail("knots", "must be whole numbers that ascend");
      before = static_cast<int>(k);
      g.knots.push_back(before);
    }
    if (before != g.steps) t.Fail("knots", "must end with the last node, `steps`");
  }
  t.Finish();
  return g;
}

void ReadLimits(TomlReader* t, MotorLimits* m) {
  if (t->Has("tension")) {
    const auto range = t->Numbers("tension", Quantity::kForce, kNonNegative, 2);
    if (range[1] < range[0]) t->Fail("tension", "the upper limit lies below the lower one");
    m->min_tension_n = range[0];
    m->max_tension_n = range[1];
  }
  m->max_rate_n_s = t->Number("rate", Quantity::kNumber, kPositive, m->max_rate_n_s);
  m->decides_every_node =
      t->Choice<bool>("decides", {{"knots", false}, {"nodes", true}}, m->decides_every_node);
}

int MotorIndex(TomlReader* t, const char* key, const std::vector<Actuator>& motors) {
  const std::string name = t->Text(key, "");
  std::string list;
  for (std::size_t i = 0; i < motors.size(); ++i) {
    if (motors[i].name == name) return static_cast<int>(i);
    list += (list.empty() ? "" : ", ") + motors[i].name;
  }
  t->Fail(key, "must be one of the motors " + list);
}

CostWeights ReadCost(TomlReader t) {
  CostWeights c;
  const auto weight = [&](const char* key, double* value) {
    *value = t.Number(key, Quantity::kNumber, kNonNegative, *value);
  };
  weight("position", &c.position);
  weight("heading", &c.heading);
  weight("velocity", &c.velocity);
  weight("mean_velocity", &c.mean_velocity);
  weight("turn_rate", &c.turn_rate);
  weight("tip", &c.tip);
  weight("volume", &c.volume);
  weight("effort", &c.effort);
  weight("rate", &c.rate);
  weight("terminal", &c.terminal);
  t.Finish();
  return c;
}

SoftBound ReadBound(TomlReader t) {
  using Q = SoftBound::Quantity;
  SoftBound b;
  b.quantity = t.Choice<Q>("quantity",
                           {{"volume", Q::kVolume},
                            {"speed", Q::kSpeed},
                            {"turn_rate", Q::kTurnRate},
                            {"curvature", Q::kCurvature}},
                           b.quantity);
  b.low = t.Number("low", Quantity::kNumber, kAnyValue, -std::numeric_limits<double>::infinity());
  b.high = t.Number("high", Quantity::kNumber, kAnyValue, std::numeric_limits<double>::infinity());
  if (b.high < b.low) t.Fail("high", "lies below `low`");
  b.weight = t.Number("weight", Quantity::kNumber, kPositive);
  t.Finish();
  return b;
}

Gait ReadGait(TomlReader t, const std::vector<Actuator>& motors,
              const std::vector<MotorLimits>& limits) {
  Gait gait;
  gait.period_s = t.Number("period", Quantity::kTime, kPositive, gait.period_s);
  for (const MotorLimits& m : limits) {
    GaitPulse rest;
    rest.low_n = rest.high_n = m.min_tension_n;
    gait.motors.push_back(rest);
  }
  for (TomlReader& entry : t.Tables("pulses")) {
    const int motor = MotorIndex(&entry, "motor", motors);
    GaitPulse& p = gait.motors[motor];
    const Range range{limits[motor].min_tension_n, limits[motor].max_tension_n};
    p.low_n = entry.Number("low", Quantity::kForce, range, p.low_n);
    p.high_n = entry.Number("high", Quantity::kForce, range, p.low_n);
    p.rise = entry.Number("rise", Quantity::kNumber, kShare, p.rise);
    p.hold = entry.Number("hold", Quantity::kNumber, kShare, p.hold);
    p.fall = entry.Number("fall", Quantity::kNumber, kShare, p.fall);
    p.phase = entry.Number("phase", Quantity::kNumber, kShare, p.phase);
    if (p.rise + p.hold + p.fall > 1 + 1e-12) entry.Fail("fall", "rise + hold + fall exceed 1");
    entry.Finish();
  }
  t.Finish();
  return gait;
}

BaselineGains ReadGains(TomlReader t) {
  BaselineGains g;
  const auto number = [&](const char* key, double* value) {
    *value = t.Number(key, Quantity::kNumber, kAnyValue, *value);
  };
  g.gait_scale = t.Number("gait_scale", Quantity::kNumber, kNonNegative, g.gait_scale);
  g.gait_period = t.Number("gait_period", Quantity::kNumber, kPositive, g.gait_period);
  g.gait_lead_s = t.Number("gait_lead", Quantity::kTime, kNonNegative, g.gait_lead_s);
  number("proportional", &g.proportional);
  number("integral", &g.integral);
  number("derivative", &g.derivative);
  g.lookahead_s = t.Number("lookahead", Quantity::kTime, kNonNegative, g.lookahead_s);
  g.lqr_effort = t.Number("effort", Quantity::kNumber, kPositive, g.lqr_effort);
  number("speed_gain", &g.speed_gain);
  t.Finish();
  return g;
}

// A name that the registry does not know is the key's fault.
template <typename Find>
void CheckKnown(TomlReader& t, const char* key, Find find) {
  try {
    find();
  } catch (const std::invalid_argument& error) {
    t.Fail(key, error.what());
  }
}

}  // namespace

ControlOptions ReadControl(TomlReader t, const Robot& robot, const std::vector<Actuator>& motors) {
  ControlOptions c;
  c.controller = t.Text("controller", c.controller);
  CheckKnown(t, "controller", [&] { controller::FindController(c.controller); });
  c.mode = t.Choice<MpcMode>(
      "mode", {{"rti", MpcMode::kRealTimeIteration}, {"converged", MpcMode::kConverged}}, c.mode);
  c.goal = ReadGoal(t.Table("goal"), robot);
  if (auto grid = t.OptionalTable("grid")) c.grid = ReadGrid(*grid);
  c.period_s = t.Number("period", Quantity::kTime, kPositive, c.grid.step_s);
  c.delay_s = t.Number("delay", Quantity::kTime, kNonNegative, c.delay_s);
  c.deadline_s = t.Number("deadline", Quantity::kTime, kPositive, c.deadline_s);
  c.max_iterations = t.Integer("iterations", 1, 10000, c.max_iterations);
  c.levenberg = t.Number("levenberg", Quantity::kNumber, kNonNegative, c.levenberg);
  MotorLimits all;
  if (auto limits = t.OptionalTable("limits")) {
    ReadLimits(&*limits, &all);
    limits->Finish();
  }
  c.motors.assign(motors.size(), all);
  for (TomlReader& entry : t.Tables("motors")) {
    ReadLimits(&entry, &c.motors[MotorIndex(&entry, "name", motors)]);
    entry.Finish();
  }
  if (auto cost = t.OptionalTable("cost")) c.cost = ReadCost(*cost);
  for (TomlReader& bound : t.Tables("bounds")) c.bounds.push_back(ReadBound(bound));
  for (const SoftBound& b : c.bounds) {
    if (b.quantity == SoftBound::Quantity::kVolume && !robot.mantle) {
      t.Fail("bounds", "bounds the volume of a robot without a mantle");
    }
  }
  if (auto gait = t.OptionalTable("gait")) {
    c.gait = ReadGait(*gait, motors, c.motors);
  } else {
    for (const MotorLimits& m : c.motors) {
      c.gait.motors.push_back({m.min_tension_n, m.min_tension_n, 0.5, 0, 0.5, 0});
    }
  }
  if (auto baselines = t.OptionalTable("baselines")) {
    const char* names[] = {"gait", "pursuit", "pid", "lqr"};
    for (int i = 0; i < 4; ++i) {
      if (auto gains = baselines->OptionalTable(names[i], "control.baselines")) {
        c.baselines[i] = ReadGains(*gains);
      }
    }
    baselines->Finish();
  }
  if (auto e = t.OptionalTable("estimator")) {
    c.estimator.type = e->Text("type", c.estimator.type);
    CheckKnown(*e, "type", [&] { controller::FindEstimator(c.estimator.type); });
    c.estimator.observer = e->Boolean("observer", c.estimator.observer);
    c.estimator.disturbance = e->Boolean("disturbance", c.estimator.disturbance);
    c.estimator.model_noise =
        e->Number("model_noise", Quantity::kNumber, kPositive, c.estimator.model_noise);
    c.estimator.tension_walk_n =
        e->Number("tension_walk", Quantity::kNumber, kNonNegative, c.estimator.tension_walk_n);
    c.estimator.acceleration_walk_m_s2 = e->Number(
        "acceleration_walk", Quantity::kNumber, kNonNegative, c.estimator.acceleration_walk_m_s2);
    e->Finish();
  }
  t.Finish();
  return c;
}

DriveOptions ReadDrives(TomlReader t) {
  DriveOptions d;
  d.bus = t.Text("bus", d.bus);
  d.period_s = t.Number("period", Quantity::kTime, Range{1e-3, 0.09}, d.period_s);
  d.cable_stiffness_n_m =
      t.Number("cable_stiffness", Quantity::kStiffness, kPositive, d.cable_stiffness_n_m);
  d.cable_damping_n_s_m =
      t.Number("cable_damping", Quantity::kDamping, kNonNegative, d.cable_damping_n_s_m);
  d.pretension_n = t.Number("pretension", Quantity::kForce, kNonNegative, d.pretension_n);
  t.Finish();
  return d;
}

SensorOptions ReadSensors(TomlReader t) {
  SensorOptions s;
  const auto deviation = [&](const char* key, Quantity quantity, double* value) {
    *value = t.Number(key, quantity, kNonNegative, *value);
  };
  deviation("position", Quantity::kLength, &s.position_m);
  deviation("attitude", Quantity::kAngle, &s.attitude_rad);
  deviation("velocity", Quantity::kSpeed, &s.velocity_m_s);
  deviation("angular_velocity", Quantity::kAngularSpeed, &s.angular_velocity_rad_s);
  deviation("strain", Quantity::kCurvature, &s.strain);
  deviation("strain_rate", Quantity::kNumber, &s.strain_rate);
  deviation("mantle", Quantity::kNumber, &s.mantle);
  deviation("mantle_rate", Quantity::kNumber, &s.mantle_rate);
  deviation("cable", Quantity::kLength, &s.cable_m);
  deviation("cable_rate", Quantity::kSpeed, &s.cable_rate_m_s);
  deviation("bias", Quantity::kNumber, &s.bias);
  deviation("delay", Quantity::kTime, &s.delay_s);
  s.loss = t.Number("loss", Quantity::kNumber, Range{0, 0.99}, s.loss);
  s.seed = t.Integer("seed", 0, 1000000000, s.seed);
  t.Finish();
  return s;
}

Mismatch ReadMismatch(TomlReader t) {
  Mismatch m;
  const Range factor{0.01, 100};
  m.young = t.Number("young", Quantity::kNumber, factor, m.young);
  m.viscosity = t.Number("viscosity", Quantity::kNumber, factor, m.viscosity);
  m.drag = t.Number("drag", Quantity::kNumber, factor, m.drag);
  m.added_mass = t.Number("added_mass", Quantity::kNumber, factor, m.added_mass);
  m.jet = t.Number("jet", Quantity::kNumber, factor, m.jet);
  t.Finish();
  return m;
}

}  // namespace mantle::scene
