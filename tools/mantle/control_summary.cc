#include "tools/mantle/control_summary.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <stdexcept>

#include "tools/mantle/timing_summary.h"
#include "tools/mantle/trajectory.h"

namespace mantle::tools {
namespace {

using firmware_sim::DriveReport;

/// First bin of MpcCounters::time_histogram.
constexpr double kFirstBin_ms = 0.125;

// Median, 99th percentile (nearest rank) and maximum, in ms.
Json Quantiles(std::vector<double> seconds) {
  if (seconds.empty()) return nullptr;
  std::sort(seconds.begin(), seconds.end());
  const auto rank = [&](double share) {
    const auto n = static_cast<double>(seconds.size());
    return 1e3 * seconds[static_cast<std::size_t>(std::max(std::ceil(share * n) - 1.0, 0.0))];
  };
  return {{"median", rank(0.5)}, {"p99", rank(0.99)}, {"max", rank(1.0)}};
}

// Without the empty bins at the end.
template <typename Counts>
Json Trimmed(const Counts& counts) {
  auto end = counts.end();
  while (end != counts.begin() && *std::prev(end) == 0) --end;
  return Json(std::vector<std::uint64_t>(counts.begin(), end));
}

Json GoalJson(const controller::ControlGoal& goal, const model::Plant& plant) {
  if (const auto* path = std::get_if<controller::PathTask>(&goal)) {
    return {{"type", "path"},
            {"waypoints", path->waypoints.size()},
            {"speed_m_s", path->speed_m_s},
            {"tolerance_m", path->tolerance_m}};
  }
  if (const auto* circle = std::get_if<controller::CircleTask>(&goal)) {
    return {{"type", "circle"},
            {"arm", plant.rods[circle->arm].name},
            {"radius_m", circle->radius_m},
            {"period_s", circle->period_s}};
  }
  return {{"type", "cruise"}, {"speed_m_s", std::get<controller::CruiseTask>(goal).speed_m_s}};
}

Json WaypointsJson(const controller::ControlGoal& goal, const loop::LoopResult& r) {
  const auto* path = std::get_if<controller::PathTask>(&goal);
  if (path == nullptr) return nullptr;
  Json list = Json::array();
  for (std::size_t i = 0; i < r.waypoints.size(); ++i) {
    const loop::WaypointResult& w = r.waypoints[i];
    const bool reached = std::isfinite(w.distance_m);
    list.push_back({{"at_m", VectorJson(path->waypoints[i])},
                    {"distance_m", reached ? Json(w.distance_m) : Json()},
                    {"time_s", reached ? Json(w.time_s) : Json()},
                    {"passed", w.passed}});
  }
  return list;
}

Json SolverJson(const loop::LoopResult& r) {
  if (r.solve_s.empty()) return nullptr;
  const controller::MpcCounters& c = r.counters;
  std::vector<double> step_s(r.solve_s.size());
  std::transform(r.solve_s.begin(), r.solve_s.end(), r.prepare_s.begin(), step_s.begin(),
                 std::plus<>());
  using controller::Outcome;
  Json j;
  j["plans"] = c.solves;
  j["outcomes"] = {{ToString(Outcome::kSolved), c.solved},
                   {ToString(Outcome::kStoppedBetter), c.stopped_better},
                   {ToString(Outcome::kShifted), c.shifted},
                   {ToString(Outcome::kSafe), c.safe}};
  j["deadline_misses"] = c.deadline_misses;
  j["fallbacks"] = c.shifted + c.safe;
  j["bad_states"] = c.bad_states;
  j["restarts"] = c.restarts;
  j["iterations"] = r.iterations;
  j["iteration_histogram"] = Trimmed(c.iteration_histogram);
  j["prepare_ms"] = Quantiles(r.prepare_s);
  j["solve_ms"] = Quantiles(r.solve_s);
  j["step_ms"] = Quantiles(step_s);
  Json bins = Json::array();
  const Json counts = Trimmed(c.time_histogram);
  for (std::size_t i = 0; i < counts.size(); ++i) {
    const double from_ms = i == 0 ? 0.0 : std::ldexp(kFirstBin_ms, static_cast<int>(i));
    bins.push_back({{"from_ms", from_ms}, {"count", counts[i]}});
  }
  j["step_histogram"] = bins;
  return j;
}

Json EstimatorJson(const loop::LoopResult& r) {
  Json j = {{"taken", r.estimator.taken},
            {"refused", r.estimator.refused},
            {"useless", r.estimator.useless},
            {"restarts", r.estimator.restarts},
            {"current", nullptr}};
  if (r.current) {
    j["current"] = {{"estimated_m_s", VectorJson(r.current->estimated)},
                    {"actual_m_s", VectorJson(r.current->actual)},
                    {"rms_error_m_s", r.current->rms_error},
                    {"max_error_m_s", r.current->max_error}};
  }
  return j;
}

Json DrivesJson(const scene::Scene& scene, loop::ClosedLoop& loop) {
  const loop::PlantSide& plant = loop.plant_side();
  const std::vector<std::string> cables = CableNames(loop.plant());
  Json list = Json::array();
  for (int i = 0; i < plant.motor_count(); ++i) {
    const DriveReport& r = loop.control_side().motors().report(i);
    Json pulls = Json::array();
    for (const loop::ReeledCable& cable : plant.reel(i).cables) {
      pulls.push_back(cables[static_cast<std::size_t>(cable.index)]);
    }
    list.push_back({{"motor", scene.reduction.actuators[static_cast<std::size_t>(i)].name},
                    {"cables", pulls},
                    {"node", r.node},
                    {"step", Name(r.step)},
                    {"sound", r.problem == firmware_sim::DriveProblem::kNone},
                    {"state", Describe(r)},
                    {"emergencies", r.emcy_count},
                    {"tpdos_late", r.tpdo1_late}});
  }
  return list;
}

}  // namespace

Json ControlSummary(const ControlReport& report) {
  const loop::LoopResult& r = *report.result;
  const controller::ControlOptions& control = *report.scene->control;
  const bool planned = report.loop->control_side().mpc() != nullptr;
  Json j;
  j["controller"] = report.controller;
  j["mode"] = !planned                                                  ? Json()
              : control.mode == controller::MpcMode::kRealTimeIteration ? Json("rti")
                                                                        : Json("converged");
  j["goal"] = GoalJson(control.goal, report.loop->plant());
  j["body_length_m"] = report.loop->plant().body_length_m;
  j["cost"] = r.cost;
  j["cost_terms"] = Json::object();
  for (const auto& [name, cost] : r.cost_terms) j["cost_terms"][name] = cost;
  j["error"] = {{"name", r.error_name},
                {"mean", r.mean_error},
                {"max", r.max_error},
                {"final", r.final_error}};
  j["waypoints"] = WaypointsJson(control.goal, r);
  j["effort_n2_s"] = r.effort_n2_s;
  j["cable_work_j"] = r.cable_work_j;
  j["energetic_index"] = r.energetic_index;
  j["mean_speed_m_s"] = r.mean_speed_m_s;
  j["tension_error_n"] = r.tension_error_n;
  j["motor_periods"] = r.cycles * report.loop->plant_side().motor_count();
  j["limit_touches"] = r.limit_touches;
  j["solver"] = SolverJson(r);
  j["estimator"] = EstimatorJson(r);
  j["bus"] = {{"spec", report.bus},
              {"load", r.bus_load},
              {"load_peak", r.bus_load_peak},
              {"frames", r.traffic.frames},
              {"tpdos_late", r.late_pdos}};
  j["motors_lost"] = Json::array();
  for (std::size_t i = 0; i < report.scene->reduction.actuators.size(); ++i) {
    if (r.lost_motors.contains(static_cast<int>(i))) {
      j["motors_lost"].push_back(report.scene->reduction.actuators[i].name);
    }
  }
  j["drives"] = DrivesJson(*report.scene, *report.loop);
  j["real_time"] = nullptr;
  if (r.real_time) {
    const loop::RealTimeFigures& f = *r.real_time;
    Json& t = j["real_time"];
    t = FastLoopJson(f.control);
    t["cycles"] = r.cycles;
    t["worst_lateness_ms"] = 1e3 * r.worst_lateness_s;
    t["memory_locked"] = report.memory_locked;
    t["scheduled_fifo"] = f.refused.empty();
    t["achieved_rate"] = f.rate_hz;
    t["late_plans"] = f.late_plans;
    t["overtaken_plans"] = f.overtaken_plans;
    t["stuck_cycles"] = f.stuck_cycles;
    t["plant"] = PlantRunnerJson(f.plant);
    t["bare_timer"] = HistogramJson(f.timer);
  }
  return j;
}

}  // namespace mantle::tools
