#pragma once

#include <type_traits>

#include "tools/mantle/telemetry.h"

/// The fields of each message, once: VisitFields(f, plain, others...) calls f("name", plain.name,
/// others.name...) for every field, in the order of the .lcm file. The others may be of any type
/// with the same names, the generated ones included; lists bring their length along, so that no
/// count is visited.

namespace mantle::tools {

template <typename T, typename Plain>
concept Message = std::is_same_v<std::remove_const_t<T>, Plain>;

template <typename F, Message<StateTelemetry> M, typename... Others>
void VisitFields(F&& f, M& m, Others&... o) {
  f("utime", m.utime, o.utime...);
  f("root_position", m.root_position, o.root_position...);
  f("root_quaternion", m.root_quaternion, o.root_quaternion...);
  f("root_twist", m.root_twist, o.root_twist...);
  f("arm_name", m.arm_name, o.arm_name...);
  f("tip_position", m.tip_position, o.tip_position...);
  f("tip_quaternion", m.tip_quaternion, o.tip_quaternion...);
  f("tip_twist", m.tip_twist, o.tip_twist...);
  f("centre_of_mass", m.centre_of_mass, o.centre_of_mass...);
  f("heading", m.heading, o.heading...);
  f("volume", m.volume, o.volume...);
  f("volume_rate", m.volume_rate, o.volume_rate...);
  f("thrust", m.thrust, o.thrust...);
  f("cable_name", m.cable_name, o.cable_name...);
  f("cable_length", m.cable_length, o.cable_length...);
  f("cable_rate", m.cable_rate, o.cable_rate...);
  f("cable_tension", m.cable_tension, o.cable_tension...);
}

template <typename F, Message<ReducedStateTelemetry> M, typename... Others>
void VisitFields(F&& f, M& m, Others&... o) {
  f("utime", m.utime, o.utime...);
  f("root_position", m.root_position, o.root_position...);
  f("root_quaternion", m.root_quaternion, o.root_quaternion...);
  f("q", m.q, o.q...);
  f("v", m.v, o.v...);
}

template <typename F, Message<PlanTelemetry> M, typename... Others>
void VisitFields(F&& f, M& m, Others&... o) {
  f("utime", m.utime, o.utime...);
  f("time", m.time, o.time...);
  f("tension", m.tension, o.tension...);
  f("root_position", m.root_position, o.root_position...);
  f("tip_position", m.tip_position, o.tip_position...);
  f("cost", m.cost, o.cost...);
  f("status", m.status, o.status...);
  f("solve_time_us", m.solve_time_us, o.solve_time_us...);
}

template <typename F, Message<DrivesTelemetry> M, typename... Others>
void VisitFields(F&& f, M& m, Others&... o) {
  f("utime", m.utime, o.utime...);
  f("motor_name", m.motor_name, o.motor_name...);
  f("node", m.node, o.node...);
  f("statusword", m.statusword, o.statusword...);
  f("torque_permille", m.torque_permille, o.torque_permille...);
  f("position_counts", m.position_counts, o.position_counts...);
  f("velocity_counts_s", m.velocity_counts_s, o.velocity_counts_s...);
  f("current_permille", m.current_permille, o.current_permille...);
  f("temperature_celsius", m.temperature_celsius, o.temperature_celsius...);
  f("target_torque_permille", m.target_torque_permille, o.target_torque_permille...);
  f("tension_estimate", m.tension_estimate, o.tension_estimate...);
  f("reeled_length", m.reeled_length, o.reeled_length...);
}

template <typename F, Message<EnergyTelemetry> M, typename... Others>
void VisitFields(F&& f, M& m, Others&... o) {
  f("utime", m.utime, o.utime...);
  f("kinetic_solid", m.kinetic_solid, o.kinetic_solid...);
  f("kinetic_water", m.kinetic_water, o.kinetic_water...);
  f("elastic_arms", m.elastic_arms, o.elastic_arms...);
  f("elastic_mantle", m.elastic_mantle, o.elastic_mantle...);
  f("gravity", m.gravity, o.gravity...);
  f("work_name", m.work_name, o.work_name...);
  f("work", m.work, o.work...);
  f("dissipated", m.dissipated, o.dissipated...);
  f("input_power", m.input_power, o.input_power...);
  f("output_power", m.output_power, o.output_power...);
}

template <typename F, Message<StatusTelemetry> M, typename... Others>
void VisitFields(F&& f, M& m, Others&... o) {
  f("utime", m.utime, o.utime...);
  f("control_mode", m.control_mode, o.control_mode...);
  f("solver_status", m.solver_status, o.solver_status...);
  f("solves", m.solves, o.solves...);
  f("iterations", m.iterations, o.iterations...);
  f("misses", m.misses, o.misses...);
  f("fallbacks", m.fallbacks, o.fallbacks...);
  f("safe_decays", m.safe_decays, o.safe_decays...);
  f("text", m.text, o.text...);
  f("rate", m.rate, o.rate...);
  f("cycles", m.cycles, o.cycles...);
  f("late_cycles", m.late_cycles, o.late_cycles...);
  f("missed_cycles", m.missed_cycles, o.missed_cycles...);
  f("late_plans", m.late_plans, o.late_plans...);
  f("bin_begin", m.bin_begin, o.bin_begin...);
  f("sync_lateness", m.sync_lateness, o.sync_lateness...);
  f("command_time", m.command_time, o.command_time...);
}

template <typename F, Message<ShapeTelemetry> M, typename... Others>
void VisitFields(F&& f, M& m, Others&... o) {
  f("utime", m.utime, o.utime...);
  f("root_position", m.root_position, o.root_position...);
  f("root_quaternion", m.root_quaternion, o.root_quaternion...);
  f("arm_name", m.arm_name, o.arm_name...);
  f("arm_nodes", m.arm_nodes, o.arm_nodes...);
  f("arc_length", m.arc_length, o.arc_length...);
  f("position", m.position, o.position...);
  f("quaternion", m.quaternion, o.quaternion...);
  f("radius", m.radius, o.radius...);
  f("strain", m.strain, o.strain...);
  f("stress", m.stress, o.stress...);
  f("mantle_name", m.mantle_name, o.mantle_name...);
  f("mantle_half_thickness", m.mantle_half_thickness, o.mantle_half_thickness...);
  f("mantle_arc_length", m.mantle_arc_length, o.mantle_arc_length...);
  f("mantle_profile", m.mantle_profile, o.mantle_profile...);
  f("mantle_strain", m.mantle_strain, o.mantle_strain...);
  f("mantle_stress", m.mantle_stress, o.mantle_stress...);
  f("rigid_profile", m.rigid_profile, o.rigid_profile...);
  f("cable_name", m.cable_name, o.cable_name...);
  f("cable_points", m.cable_points, o.cable_points...);
  f("cable_tension", m.cable_tension, o.cable_tension...);
  f("cable_position", m.cable_position, o.cable_position...);
}

template <typename F, Message<ControlTelemetry> M, typename... Others>
void VisitFields(F&& f, M& m, Others&... o) {
  f("utime", m.utime, o.utime...);
  f("motor_name", m.motor_name, o.motor_name...);
  f("commanded_tension", m.commanded_tension, o.commanded_tension...);
  f("actual_tension", m.actual_tension, o.actual_tension...);
  f("reference_kind", m.reference_kind, o.reference_kind...);
  f("reference", m.reference, o.reference...);
  f("error", m.error, o.error...);
  f("root_position", m.root_position, o.root_position...);
  f("root_quaternion", m.root_quaternion, o.root_quaternion...);
  f("estimate_error", m.estimate_error, o.estimate_error...);
  f("deviation", m.deviation, o.deviation...);
}

template <typename F, Message<WaterTelemetry> M, typename... Others>
void VisitFields(F&& f, M& m, Others&... o) {
  f("utime", m.utime, o.utime...);
  f("current", m.current, o.current...);
  f("drag", m.drag, o.drag...);
  f("body_drag", m.body_drag, o.body_drag...);
}

template <typename F, Message<SessionTelemetry> M, typename... Others>
void VisitFields(F&& f, M& m, Others&... o) {
  f("utime", m.utime, o.utime...);
  f("scene", m.scene, o.scene...);
  f("version", m.version, o.version...);
  f("controller", m.controller, o.controller...);
  f("bus", m.bus, o.bus...);
  f("real_time", m.real_time, o.real_time...);
  f("duration", m.duration, o.duration...);
  f("body_length", m.body_length, o.body_length...);
  f("goal", m.goal, o.goal...);
  f("waypoint", m.waypoint, o.waypoint...);
  f("tolerance", m.tolerance, o.tolerance...);
  f("host", m.host, o.host...);
  f("process", m.process, o.process...);
  f("results", m.results, o.results...);
}

template <typename F, Message<SensorsTelemetry> M, typename... Others>
void VisitFields(F&& f, M& m, Others&... o) {
  f("utime", m.utime, o.utime...);
  f("time", m.time, o.time...);
  f("held", m.held, o.held...);
  f("has_state", m.has_state, o.has_state...);
  f("state_time", m.state_time, o.state_time...);
  f("root_position", m.root_position, o.root_position...);
  f("root_quaternion", m.root_quaternion, o.root_quaternion...);
  f("q", m.q, o.q...);
  f("v", m.v, o.v...);
  f("cable_length", m.cable_length, o.cable_length...);
  f("cable_rate", m.cable_rate, o.cable_rate...);
  f("instrument", m.instrument, o.instrument...);
  f("measured_time", m.measured_time, o.measured_time...);
  f("measured_size", m.measured_size, o.measured_size...);
  f("measured", m.measured, o.measured...);
}

template <typename F, Message<CommandTelemetry> M, typename... Others>
void VisitFields(F&& f, M& m, Others&... o) {
  f("utime", m.utime, o.utime...);
  f("time_out", m.time_out, o.time_out...);
  f("tension", m.tension, o.tension...);
}

template <typename F, Message<CycleTelemetry> M, typename... Others>
void VisitFields(F&& f, M& m, Others&... o) {
  f("utime", m.utime, o.utime...);
  f("phase", m.phase, o.phase...);
  f("go_time", m.go_time, o.go_time...);
  f("host", m.host, o.host...);
  f("process", m.process, o.process...);
}

template <typename F, Message<StepTelemetry> M, typename... Others>
void VisitFields(F&& f, M& m, Others&... o) {
  f("utime", m.utime, o.utime...);
  f("number", m.number, o.number...);
  f("run", m.run, o.run...);
  f("action", m.action, o.action...);
  f("now", m.now, o.now...);
  f("frames_sent", m.frames_sent, o.frames_sent...);
}

template <typename F, Message<SteppedTelemetry> M, typename... Others>
void VisitFields(F&& f, M& m, Others&... o) {
  f("utime", m.utime, o.utime...);
  f("number", m.number, o.number...);
  f("run", m.run, o.run...);
  f("ok", m.ok, o.ok...);
  f("reason", m.reason, o.reason...);
  f("braked", m.braked, o.braked...);
  f("frames_sent", m.frames_sent, o.frames_sent...);
}

}  // namespace mantle::tools
