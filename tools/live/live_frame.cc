#include "tools/live/live_frame.h"

#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <cstddef>

#include "tools/report/telemetry_columns.h"

namespace mantle::tools {
namespace {

double Seconds(std::int64_t utime) { return 1e-6 * static_cast<double>(utime); }

// Seven digits are finer than what a picture shows; null where there is no number.
Json Short(double value) {
  if (!std::isfinite(value)) return nullptr;
  char text[32];
  const char* end = fmt::format_to_n(text, sizeof text, "{:.7g}", value).out;
  double rounded = value;
  std::from_chars(text, end, rounded);
  return rounded;
}

template <typename List>
void AppendShort(const List& list, Json* to) {
  for (const auto& value : list) to->push_back(Short(static_cast<double>(value)));
}

template <typename Lists>
Json Flat(const Lists& lists) {
  Json j = Json::array();
  for (const auto& list : lists) AppendShort(list, &j);
  return j;
}

template <typename List>
Json Row(const List& list) {
  Json j = Json::array();
  AppendShort(list, &j);
  return j;
}

Json RowJson(double time_s, const Columns& columns) {
  Json row = {{"time_s", time_s}};
  for (const auto& [title, value] : columns) row[title] = Short(value);
  return row;
}

Json ShapeJson(const ShapeTelemetry& m) {
  Json j = {{"root_position", Row(m.root_position)}, {"root_quaternion", Row(m.root_quaternion)}};
  j["arms"] = Json::array();
  std::size_t node = 0, span = 0;
  for (std::size_t a = 0; a < m.arm_name.size(); ++a) {
    const auto nodes = static_cast<std::size_t>(m.arm_nodes[a]);
    Json arm = {{"name", m.arm_name[a]}, {"nodes", nodes}};
    Json radius = Json::array(), position = Json::array(), curvature = Json::array();
    for (std::size_t i = node; i < node + nodes; ++i) {
      radius.push_back(Short(double{m.radius[i]}));
      AppendShort(m.position[i], &position);
    }
    for (std::size_t i = span; i + 1 < span + nodes; ++i) {
      curvature.push_back(Short(std::hypot(m.strain[i][1], m.strain[i][2])));
    }
    arm["radius"] = std::move(radius);
    arm["position"] = std::move(position);
    arm["curvature"] = std::move(curvature);
    j["arms"].push_back(std::move(arm));
    node += nodes;
    span += nodes - 1;
  }
  j["mantle"] = nullptr;
  if (!m.mantle_profile.empty()) {
    Json profile = Json::array(), hoop = Json::array();
    for (const Triple& q : m.mantle_profile) {
      profile.push_back(Short(q[0]));
      profile.push_back(Short(q[1]));
    }
    for (const auto& e : m.mantle_strain) hoop.push_back(Short(double{e[1]}));
    j["mantle"] = {{"name", m.mantle_name},
                   {"nodes", m.mantle_profile.size()},
                   {"half_thickness", Short(m.mantle_half_thickness)},
                   {"profile", std::move(profile)},
                   {"hoop", std::move(hoop)}};
  }
  j["rigid"] = Json::array();
  for (const auto& point : m.rigid_profile) j["rigid"].push_back(Row(point));
  j["cables"] = Json::array();
  std::size_t point = 0;
  for (std::size_t c = 0; c < m.cable_name.size(); ++c) {
    const auto points = static_cast<std::size_t>(m.cable_points[c]);
    Json position = Json::array();
    for (std::size_t i = point; i < point + points; ++i) {
      AppendShort(m.cable_position[i], &position);
    }
    j["cables"].push_back({{"name", m.cable_name[c]},
                           {"points", points},
                           {"position", std::move(position)},
                           {"tension", Short(double{m.cable_tension[c]})}});
    point += points;
  }
  return j;
}

Json DrivesJson(const DrivesTelemetry& m) {
  return {{"motors", m.motor_name},
          {"nodes", m.node},
          {"statusword", m.statusword},
          {"torque_permille", m.torque_permille},
          {"target_torque_permille", m.target_torque_permille},
          {"temperature_celsius", Row(m.temperature_celsius)},
          {"reeled_length", Row(m.reeled_length)}};
}

Json PlanJson(const PlanTelemetry& m) {
  Json tips = Json::array();
  for (const auto& knot : m.tip_position) {
    for (const Triple& tip : knot) AppendShort(tip, &tips);
  }
  return {{"time", Seconds(m.utime)},
          {"knots", m.time.size()},
          {"arms", m.tip_position.empty() ? 0 : m.tip_position.front().size()},
          {"ahead", Row(m.time)},
          {"root", Flat(m.root_position)},
          {"tips", std::move(tips)},
          {"solve_ms", 1e-3 * static_cast<double>(m.solve_time_us)}};
}

Json SessionJson(const SessionTelemetry& m) {
  Json waypoints = Json::array();
  for (const Triple& p : m.waypoint) waypoints.push_back({{"at_m", Row(p)}});
  return {{"scene", m.scene},
          {"version", m.version},
          {"controller", m.controller},
          {"bus", m.bus},
          {"real_time", m.real_time != 0},
          {"duration", Short(m.duration)},
          {"body_length", Short(m.body_length)},
          {"goal", m.goal},
          {"waypoints", std::move(waypoints)},
          {"tolerance", Short(m.tolerance)},
          {"host", m.host},
          {"process", m.process},
          {"results", m.results}};
}

}  // namespace

Json FrameRows(const LiveFrame& frame) {
  Json rows = Json::object();
  const double time_s = Seconds(frame.utime);
  const auto of = [](const auto& message) { return message ? &*message : nullptr; };
  if (frame.state) {
    rows["trajectory"] =
        RowJson(time_s, TrajectoryColumns(of(frame.state), of(frame.control), of(frame.energy)));
  }
  if (frame.control) {
    const Columns columns = EstimateColumns(*frame.control);
    if (!columns.empty()) rows["estimate"] = RowJson(time_s, columns);
  }
  if (frame.energy) {
    Json row = {{"time_s", time_s},
                {"gravity_j", Short(frame.energy->gravity)},
                {"dissipated_j", Short(frame.energy->dissipated)}};
    for (std::size_t k = 0; k < frame.energy->work.size(); ++k) {
      row["work " + frame.energy->work_name[k]] = Short(frame.energy->work[k]);
    }
    rows["energy"] = std::move(row);
  }
  if (frame.status) {
    rows["counters"] = {{"time_s", time_s},
                        {"misses", frame.status->misses},
                        {"fallbacks", frame.status->fallbacks},
                        {"safe_decays", frame.status->safe_decays}};
  }
  return rows;
}

Json FrameJson(const LiveFrame& frame, const PlanTelemetry* plan, const SessionTelemetry* session) {
  Json j = {{"time", Seconds(frame.utime)}, {"rows", FrameRows(frame)}};
  if (frame.shape) j["shape"] = ShapeJson(*frame.shape);
  if (frame.shape && frame.water && frame.water->drag.size() == frame.shape->position.size()) {
    j["drag"] = {{"nodes", Flat(frame.water->drag)}, {"body", Row(frame.water->body_drag)}};
  }
  if (frame.drives) j["drives"] = DrivesJson(*frame.drives);
  if (frame.status) {
    j["status"] = {{"control_mode", frame.status->control_mode},
                   {"solver_status", frame.status->solver_status},
                   {"text", frame.status->text}};
  }
  if (plan != nullptr) j["plan"] = PlanJson(*plan);
  if (session != nullptr) j["session"] = SessionJson(*session);
  return j;
}

}  // namespace mantle::tools
