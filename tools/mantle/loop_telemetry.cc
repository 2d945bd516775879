#include "tools/mantle/loop_telemetry.h"

#include <fmt/format.h>
#include <unistd.h>

#include <cmath>

#include "mantle/version.h"
#include "reduced/outputs.h"
#include "tools/mantle/trajectory.h"

namespace mantle::tools {
namespace {

Triple ToTriple(const model::Vector3& v) { return {v.x(), v.y(), v.z()}; }

Quaternion ToQuaternion(const Eigen::Quaterniond& q) { return {q.w(), q.x(), q.y(), q.z()}; }

Twist ToTwist(const model::Vector6& v) { return {v(0), v(1), v(2), v(3), v(4), v(5)}; }

std::vector<double> ToList(const model::VectorX& v) { return {v.begin(), v.end()}; }

}  // namespace

std::int64_t TelemetryTime(double time_s) { return std::llround(1e6 * time_s); }

StateTelemetry StateMessage(const model::Plant& plant, const model::Sample& s) {
  StateTelemetry m;
  m.utime = TelemetryTime(s.time_s);
  m.root_position = ToTriple(s.root.position);
  m.root_quaternion = ToQuaternion(s.root.rotation);
  m.root_twist = ToTwist(s.root_twist);
  for (std::size_t a = 0; a < plant.rods.size(); ++a) {
    m.arm_name.push_back(plant.rods[a].name);
    m.tip_position.push_back(ToTriple(s.tips[a].position));
    m.tip_quaternion.push_back(ToQuaternion(s.tips[a].rotation));
    m.tip_twist.push_back(ToTwist(s.tip_twists[a]));
  }
  m.centre_of_mass = ToTriple(s.centre_of_mass_m);
  m.heading = ToTriple(s.root.rotation * model::Vector3::UnitZ());
  m.volume = s.volume_m3;
  m.volume_rate = s.volume_rate_m3_s;
  m.thrust = s.thrust_n;
  m.cable_name = CableNames(plant);
  m.cable_length = s.cable_length_m;
  m.cable_rate = s.cable_rate_m_s;
  m.cable_tension = s.cable_tension_n;
  return m;
}

ReducedStateTelemetry ReducedStateMessage(const reduced::ReducedState& state) {
  ReducedStateTelemetry m;
  m.utime = TelemetryTime(state.time_s);
  m.root_position = ToTriple(state.root.position);
  m.root_quaternion = ToQuaternion(state.root.rotation);
  m.q = ToList(state.q);
  m.v = ToList(state.v);
  return m;
}

namespace {

PlanTelemetry PlanAt(const reduced::ReducedModel& model, double time_s,
                     const controller::Plan& plan, const controller::MpcStatus& status,
                     bool real_time) {
  PlanTelemetry m;
  m.utime = TelemetryTime(time_s);
  for (std::size_t k = 0; k < plan.time_s.size(); ++k) {
    const reduced::ReducedState& state = plan.states[k];
    m.time.push_back(plan.time_s[k] - time_s);
    m.tension.push_back(ToList(plan.tensions.col(static_cast<Eigen::Index>(k))));
    m.root_position.push_back(ToTriple(state.root.position));
    std::vector<Triple>& tips = m.tip_position.emplace_back();
    for (std::size_t a = 0; a < model.arms.size(); ++a) {
      const double* q = state.q.data() + model.arm_first(static_cast<int>(a));
      const model::Pose tip = EvaluateTip(model.arms[a], q, nullptr);
      tips.push_back(ToTriple(state.root.position + state.root.rotation * tip.position));
    }
  }
  m.cost = status.cost;
  m.status = ToString(status.outcome);
  if (real_time) m.solve_time_us = TelemetryTime(status.prepare_s + status.solve_s);
  return m;
}

}  // namespace

PlanTelemetry PlanMessage(const reduced::ReducedModel& model, const loop::LoopStep& step,
                          bool real_time) {
  return PlanAt(model, step.time_s, *step.plan, *step.solver, real_time);
}

PlanTelemetry PlanMessageOf(const reduced::ReducedModel& model, const loop::PlanReport& report) {
  return PlanAt(model, report.time_s, report.plan, report.status, true);
}

void AddDrive(const std::string& motor, const firmware_sim::DriveReport& r,
              std::int16_t target_permille, const controller::WinchMap& winch, double gain_square,
              double reeled_length_m, DrivesTelemetry* m) {
  m->motor_name.push_back(motor);
  m->node.push_back(r.node);
  m->statusword.push_back(r.statusword);
  m->torque_permille.push_back(r.torque_permille);
  m->position_counts.push_back(r.position_counts);
  m->velocity_counts_s.push_back(r.velocity_counts_s);
  m->current_permille.push_back(r.current_permille);
  m->temperature_celsius.push_back(r.temperature_celsius);
  m->target_torque_permille.push_back(target_permille);
  const double sigma = r.velocity_counts_s > 0 ? 1.0 : r.velocity_counts_s < 0 ? -1.0 : 0.0;
  m->tension_estimate.push_back(TorqueToTension(winch, r.torque_permille, sigma) / gain_square);
  m->reeled_length.push_back(reeled_length_m);
}

DrivesTelemetry DrivesMessage(const std::vector<reduced::Actuator>& motors,
                              const controller::WinchMap& winch, const loop::LoopStep& step) {
  DrivesTelemetry m;
  m.utime = TelemetryTime(step.time_s);
  for (std::size_t k = 0; k < motors.size(); ++k) {
    const loop::Reel& reel = step.plant->reel(static_cast<int>(k));
    AddDrive(motors[k].name, step.reports[k], step.torques[k].torque_permille, winch,
             reel.gain_square, reel.rest_length_m - step.reeled_m[k], &m);
  }
  return m;
}

EnergyTelemetry EnergyMessage(const model::Sample& s, const model::EnergyAccount& energy) {
  EnergyTelemetry m;
  m.utime = TelemetryTime(s.time_s);
  m.kinetic_solid = s.energies.kinetic_solid_j;
  m.kinetic_water = s.energies.kinetic_water_j;
  m.elastic_arms = s.energies.elastic_arms_j;
  m.elastic_mantle = s.energies.elastic_mantle_j;
  m.work_name = energy.names();
  m.work = energy.work_j();
  for (std::size_t i = 0; i < m.work.size(); ++i) {
    const std::string& name = m.work_name[i];
    if (name.starts_with("weight") || name.starts_with("buoyancy")) m.gravity -= m.work[i];
  }
  m.dissipated = energy.dissipated_j();
  m.input_power = s.index_input_w;
  m.output_power = s.index_output_w;
  return m;
}

void AddTiming(const loop::FastLoopCounters& c, double period_s, StatusTelemetry* m) {
  m->cycles = c.cycles;
  m->late_cycles = c.late_cycles;
  m->missed_cycles = c.missed_cycles;
  m->late_plans = c.late_plans;
  const double due = static_cast<double>(c.cycles + c.missed_cycles);
  if (due > 0) m->rate = static_cast<double>(c.cycles) / (due * period_s);
  for (std::size_t i = 0; i < loop::DurationHistogram::kBins; ++i) {
    m->bin_begin.push_back(1e-6 * loop::DurationHistogram::BinBegin_us(i));
    m->sync_lateness.push_back(static_cast<std::int64_t>(c.lateness.bins()[i]));
    m->command_time.push_back(static_cast<std::int64_t>(c.command.bins()[i]));
  }
}

StatusTelemetry StatusMessage(const std::string& controller, const loop::LoopStep& step,
                              long iterations, double period_s) {
  StatusTelemetry m;
  m.utime = TelemetryTime(step.time_s);
  m.control_mode = controller;
  m.text = fmt::format("error {:.4g}, cost {:.4g}", step.error, step.cost);
  if (step.fast_loop != nullptr) AddTiming(*step.fast_loop, period_s, &m);
  if (step.solver == nullptr) return m;
  const controller::MpcStatus& status = *step.solver;
  const controller::MpcCounters& counters = *step.solver_counters;
  m.solver_status = ToString(status.solver);
  m.solves = static_cast<std::int64_t>(counters.solves);
  m.iterations = iterations;
  m.misses = static_cast<std::int64_t>(counters.deadline_misses);
  m.fallbacks = static_cast<std::int64_t>(counters.shifted + counters.safe);
  m.safe_decays = static_cast<std::int64_t>(counters.safe);
  m.text += fmt::format("; {}", ToString(status.outcome));
  if (status.cause != nullptr) m.text += fmt::format(": {}", status.cause);
  return m;
}

ControlTelemetry ControlMessage(const std::vector<reduced::Actuator>& motors,
                                const loop::LoopStep& step,
                                const controller::Reference& reference) {
  ControlTelemetry m;
  m.utime = TelemetryTime(step.time_s);
  for (const reduced::Actuator& motor : motors) m.motor_name.push_back(motor.name);
  m.commanded_tension = ToList(step.command_n);
  m.actual_tension = ToList(step.tension_n);
  const controller::ReferencePoint at = reference.At(step.time_s);
  const bool position = reference.has_position(), tip = reference.has_tip();
  m.reference_kind = position ? "position" : tip ? "tip" : "velocity";
  m.reference = ToTriple(position ? at.position : tip ? at.tip : at.velocity);
  m.error = step.error;
  m.root_position = ToTriple(step.estimate.root.position);
  m.root_quaternion = ToQuaternion(step.estimate.root.rotation);
  const Eigen::Index states = 2 * step.truth.v.size();
  model::VectorX error(states);
  StateDifference(step.estimate, step.truth, error);
  m.estimate_error = ToList(error);
  if (step.variance.size() > 0) {
    m.deviation = ToList(step.variance.head(states).cwiseMax(0.0).cwiseSqrt());
  }
  return m;
}

SessionTelemetry SessionMessage(const scene::Scene& scene, const model::Plant& plant,
                                const std::string& controller, const std::string& bus,
                                bool real_time, const std::string& results) {
  SessionTelemetry m;
  m.scene = scene.name;
  m.version = kVersion;
  m.controller = controller;
  m.bus = bus;
  m.real_time = real_time ? 1 : 0;
  m.duration = scene.run.duration_s;
  m.body_length = plant.body_length_m;
  if (const auto* path = std::get_if<controller::PathTask>(&scene.control->goal)) {
    m.goal = "path";
    for (const model::Vector3& p : path->waypoints) m.waypoint.push_back(ToTriple(p));
    m.tolerance = path->tolerance_m;
  } else {
    m.goal =
        std::holds_alternative<controller::CircleTask>(scene.control->goal) ? "circle" : "cruise";
  }
  char host[256] = {};
  if (gethostname(host, sizeof host - 1) == 0) m.host = host;
  m.process = getpid();
  m.results = results;
  return m;
}

SensorsTelemetry SensorsMessage(const loop::Sensors& s) {
  SensorsTelemetry m;
  m.utime = TelemetryTime(s.time_s);
  m.time = s.time_s;
  m.held = s.held ? 1 : 0;
  m.has_state = s.has_state ? 1 : 0;
  m.state_time = s.state.time_s;
  m.root_position = ToTriple(s.state.root.position);
  m.root_quaternion = ToQuaternion(s.state.root.rotation);
  m.q = ToList(s.state.q);
  m.v = ToList(s.state.v);
  for (const loop::CableReading& cable : s.cables) {
    m.cable_length.push_back(cable.length_m);
    m.cable_rate.push_back(cable.rate_m_s);
  }
  for (const loop::Measurement& one : s.measurements) {
    m.instrument.push_back(one.instrument);
    m.measured_time.push_back(one.time_s);
    m.measured_size.push_back(one.size);
    m.measured.push_back(one.value);
  }
  return m;
}

bool SensorsOf(const SensorsTelemetry& m, const reduced::ReducedModel& model, loop::Sensors* s) {
  const auto coordinates = static_cast<std::size_t>(model.coordinate_count());
  const auto velocities = static_cast<std::size_t>(model.velocity_count());
  if (m.cable_length.size() != static_cast<std::size_t>(model.input_count())) return false;
  if (m.has_state != 0 && (m.q.size() != coordinates || m.v.size() != velocities)) return false;
  if (!std::isfinite(m.time)) return false;
  s->time_s = m.time;
  s->held = m.held != 0;
  s->has_state = m.has_state != 0;
  if (s->has_state) {
    s->state.time_s = m.state_time;
    s->state.root.position = {m.root_position[0], m.root_position[1], m.root_position[2]};
    s->state.root.rotation = Eigen::Quaterniond(m.root_quaternion[0], m.root_quaternion[1],
                                                m.root_quaternion[2], m.root_quaternion[3]);
    s->state.q = Eigen::Map<const model::VectorX>(m.q.data(), std::ssize(m.q));
    s->state.v = Eigen::Map<const model::VectorX>(m.v.data(), std::ssize(m.v));
  }
  s->cables.clear();
  for (std::size_t i = 0; i < m.cable_length.size(); ++i) {
    s->cables.push_back({m.cable_length[i], m.cable_rate[i]});
  }
  s->measurements.clear();
  for (std::size_t i = 0; i < m.measured.size(); ++i) {
    if (m.measured_size[i] < 1 || m.measured_size[i] > 6) return false;
    s->measurements.push_back(
        {m.instrument[i], m.measured_time[i], m.measured_size[i], m.measured[i]});
  }
  return true;
}

}  // namespace mantle::tools
