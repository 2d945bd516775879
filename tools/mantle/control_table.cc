#include "tools/mantle/control_table.h"

#include <fmt/format.h>

#include <iterator>

#include "tools/mantle/timing_summary.h"

namespace mantle::tools {
namespace {

double Number(const Json& j) { return j.get<double>(); }

// An error is a length, or a speed; both read best in thousandths.
struct ErrorUnit {
  const char* what;
  const char* unit;
  double whole;  ///< what 100 % is
  const char* of;
};

ErrorUnit UnitOf(const Json& control) {
  const std::string name = control["error"]["name"];
  const double length = Number(control["body_length_m"]);
  if (name == "position_m") return {"position", "mm", length, "body length"};
  if (name == "tip_m") return {"tip", "mm", length, "body length"};
  return {"mean speed", "mm/s", Number(control["goal"]["speed_m_s"]), "the commanded speed"};
}

std::string Goal(const Json& goal) {
  const std::string type = goal["type"];
  if (type == "path") {
    return fmt::format("{} waypoints in turn within {:.3g} mm, at {:.3g} mm/s",
                       goal["waypoints"].get<int>(), 1e3 * Number(goal["tolerance_m"]),
                       1e3 * Number(goal["speed_m_s"]));
  }
  if (type == "circle") {
    return fmt::format("the tip of {} on a circle of {:.3g} mm radius in {:.3g} s",
                       goal["arm"].get<std::string>(), 1e3 * Number(goal["radius_m"]),
                       Number(goal["period_s"]));
  }
  return fmt::format("swim at {:.3g} mm/s", 1e3 * Number(goal["speed_m_s"]));
}

std::string Waypoint(const Json& w, double body_length_m) {
  if (w["distance_m"].is_null()) return "its turn did not come";
  const double distance = Number(w["distance_m"]);
  return fmt::format("{} at {:.2f} s, {:.1f} mm away ({:.1f} % of body length)",
                     w["passed"].get<bool>() ? "passed" : "MISSED, closest", Number(w["time_s"]),
                     1e3 * distance, 100.0 * distance / body_length_m);
}

std::string Times(const Json& ms) {
  return fmt::format("{:.1f} / {:.1f} / {:.1f} ms", Number(ms["median"]), Number(ms["p99"]),
                     Number(ms["max"]));
}

std::string Drives(const Json& drives) {
  std::string faulty;
  std::size_t stopped = 0;
  for (const Json& drive : drives) {
    const bool fine = drive["step"] == "stopped" && drive["emergencies"] == 0 && drive["sound"];
    stopped += fine ? 1U : 0U;
    if (!fine) faulty += fmt::format("\n              {}", drive["state"].get<std::string>());
  }
  return fmt::format("{} of {} stopped as they should{}{}", stopped, drives.size(),
                     faulty.empty() ? ", no emergency" : "", faulty);
}

// What a user has to know of; empty where all was taken and there is no current.
std::string Estimator(const Json& e) {
  std::string text;
  const long refused = e["refused"], useless = e["useless"], restarts = e["restarts"];
  if (refused + useless + restarts > 0) {
    text = fmt::format(
        "{} measurements taken, {} refused by the gate, {} of no use; started again {} "
        "times",
        e["taken"].get<long>(), refused, useless, restarts);
  }
  if (const Json& c = e["current"]; !c.is_null()) {
    const auto v = c["estimated_m_s"].get<std::vector<double>>();
    text += fmt::format(
        "{}current ({:.1f}, {:.1f}, {:.1f}) mm/s, {:.1f} mm/s off (rms of the second "
        "half)",
        text.empty() ? "" : "; ", 1e3 * v[0], 1e3 * v[1], 1e3 * v[2],
        1e3 * Number(c["rms_error_m_s"]));
  }
  return text;
}

}  // namespace

std::string ControlTable(const Json& summary) {
  const Json& c = summary["control"];
  std::string text;
  const auto row = [&](const std::string& name, const std::string& value) {
    fmt::format_to(std::back_inserter(text), "  {:<11} {}\n", name, value);
  };
  const std::string mode =
      c["mode"].is_null() ? "" : fmt::format(" {}", c["mode"].get<std::string>());
  fmt::format_to(std::back_inserter(text),
                 "{}: closed loop, {}{}: {:.6g} s simulated in {:.3g} s ({:.1f}x real time)\n",
                 summary["scene"].get<std::string>(), c["controller"].get<std::string>(), mode,
                 Number(summary["sim_time_s"]), Number(summary["wall_time_s"]),
                 Number(summary["realtime_factor"]));
  if (!summary["complete"]) {
    fmt::format_to(std::back_inserter(text), "  NOT SOUND   {}\n",
                   summary["reason"].get<std::string>());
  }
  row("goal", Goal(c["goal"]));
  const ErrorUnit unit = UnitOf(c);
  const Json& error = c["error"];
  const auto part = [&](const char* key) { return 100.0 * Number(error[key]) / unit.whole; };
  row("error", fmt::format("{}: mean {:.1f} {} ({:.1f} % of {}), max {:.1f} {} ({:.1f} %), at the "
                           "end {:.1f} {}",
                           unit.what, 1e3 * Number(error["mean"]), unit.unit, part("mean"), unit.of,
                           1e3 * Number(error["max"]), unit.unit, part("max"),
                           1e3 * Number(error["final"]), unit.unit));
  for (std::size_t i = 0; i < c["waypoints"].size(); ++i) {
    row(fmt::format("waypoint {}", i + 1), Waypoint(c["waypoints"][i], Number(c["body_length_m"])));
  }
  std::string terms;
  for (const auto& [name, cost] : c["cost_terms"].items()) {
    if (Number(cost) == 0) continue;
    terms += fmt::format("{}{} {:.3g}", terms.empty() ? ": " : ", ", name, Number(cost));
  }
  row("cost", fmt::format("{:.5g}{}", Number(c["cost"]), terms));
  std::string effort = fmt::format("{:.4g} N^2 s; cables took {:.3g} J", Number(c["effort_n2_s"]),
                                   Number(c["cable_work_j"]));
  if (c["goal"]["type"] != "circle") {  // it swims
    effort += fmt::format("; energetic index {:.2f} % (ratio of means); mean speed {:.1f} mm/s",
                          100.0 * Number(c["energetic_index"]), 1e3 * Number(c["mean_speed_m_s"]));
  }
  row("effort", effort);
  row("tensions", fmt::format("actual minus commanded {:.1f} mN (rms); limits cut {:.2f} % of the "
                              "commands",
                              1e3 * Number(c["tension_error_n"]),
                              100.0 * Number(c["limit_touches"]) / Number(c["motor_periods"])));
  if (const Json& s = c["solver"]; !s.is_null()) {
    row("solver", fmt::format("{} plans, {:.1f} iterations each; {} deadlines missed, {} fallbacks",
                              s["plans"].get<long>(), Number(s["iterations"]) / Number(s["plans"]),
                              s["deadline_misses"].get<long>(), s["fallbacks"].get<long>()));
    if (s["restarts"] != 0) {
      row("", fmt::format("{} plans made anew from the estimate", s["restarts"].get<long>()));
    }
    row("", fmt::format("prepare {}, solve {} (median / p99 / max)", Times(s["prepare_ms"]),
                        Times(s["solve_ms"])));
  }
  if (const std::string told = Estimator(c["estimator"]); !told.empty()) row("estimator", told);
  const Json& bus = c["bus"];
  row("bus", fmt::format("{}: {:.1f} % of 1 Mbit/s, at most {:.1f} % in a period; {} frames, {} "
                         "TPDOs late",
                         bus["spec"].get<std::string>(), 100.0 * Number(bus["load"]),
                         100.0 * Number(bus["load_peak"]), bus["frames"].get<long>(),
                         bus["tpdos_late"].get<long>()));
  if (const Json& r = c["real_time"]; !r.is_null()) {
    row("real time",
        fmt::format("{} of {} SYNCs late by more than a tenth of the period, {} left out, {} "
                    "without a sensor message in time",
                    r["late_cycles"].get<long>(), r["cycles"].get<long>(),
                    r["missed_cycles"].get<long>(), r["predicted_cycles"].get<long>()));
    row("", fmt::format("{} plans late, {} measurements overtaken; plant: {} of {} periods late",
                        r["late_plans"].get<long>(), r["overtaken_plans"].get<long>(),
                        r["plant"]["late_periods"].get<long>(), r["plant"]["periods"].get<long>()));
    row("", HistogramLine("SYNC lateness", r["sync_lateness"]));
    row("", HistogramLine("bare timer", r["bare_timer"]));
    row("", HistogramLine("command", r["command"]));
  }
  for (const Json& motor : c["motors_lost"]) {
    row("", fmt::format("motor {}: LOST, gets no tension", motor.get<std::string>()));
  }
  row("drives", Drives(c["drives"]));
  return text;
}

}  // namespace mantle::tools
