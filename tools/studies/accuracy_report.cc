#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "tools/studies/accuracy_study.h"

// What the rows of an accuracy study say: orders, front, recommendations.

namespace mantle::tools {
namespace {

// Errors below a few times the least of all families' are the reference's own; those above the
// ceiling are not where a method converges.
constexpr double kAboveLeast = 3, kCeiling = 0.02;
constexpr double kTargets[] = {0.1, 0.03, 0.01, 0.003, 0.001, 0.0003, 0.0001};

struct Family {
  std::string family, integrator;
  const char* size;
  bool inverse;
  double theory, reference_size;
};

double Number(const Json& row, const char* key) {
  return row.contains(key) && row[key].is_number() ? row[key].get<double>()
                                                   : std::numeric_limits<double>::quiet_NaN();
}

Json OrderJson(const Family& f, const std::vector<Json>& rows) {
  std::vector<ConvergencePoint> points;
  double floor = INFINITY;
  for (const Json& row : rows) {
    if (row["family"] != f.family || !row["ok"].get<bool>()) continue;
    if (f.family == "time") floor = std::min(floor, kAboveLeast * Number(row, "error"));
    if (!f.integrator.empty() && row.value("integrator", "") != f.integrator) continue;
    const double size = Number(row, f.size), error = Number(row, "error");
    if (std::isfinite(size) && std::isfinite(error))
      points.push_back({f.inverse ? 1 / size : size, error});
  }
  if (points.empty()) return {};
  Json j = {{"family", f.family},
            {"of", f.integrator.empty() ? f.family : f.integrator},
            {"theory", f.theory}};
  const auto fit = FitOrder(points, f.reference_size, std::isfinite(floor) ? floor : 0.0, kCeiling);
  j["order"] = fit ? Json(fit->order) : Json();
  if (fit) {
    j["points"] = fit->points;
    j["coarsest"] = f.inverse ? 1 / fit->coarsest : fit->coarsest;
    j["finest"] = f.inverse ? 1 / fit->finest : fit->finest;
    j["scatter"] = fit->scatter;
  } else {
    j["reason"] = fmt::format("fewer than three points with errors in [{:.2g}, {:g}]", floor,
                              kCeiling);
  }
  return j;
}

std::string Factor(double x) {
  return x >= 100 ? fmt::format("{:.0f}", x) : fmt::format("{:.3g}", x);
}

std::string Percent(double share) { return fmt::format("{:.3g} %", 100 * share); }

std::string SettingsText(const Json& row) {
  std::string text;
  const auto add = [&](const std::string& more) { text += (text.empty() ? "" : ", ") + more; };
  if (row.contains("reduced")) {
    add("reduced model, " + row["reduced"].get<std::string>());
  } else {
    if (row.contains("arm_elements")) add(row["arm_elements"].dump() + " arm elements");
    if (row.contains("mantle_elements")) add(row["mantle_elements"].dump() + " mantle elements");
    if (row.contains("tolerance")) {
      add(fmt::format("{} with tolerance {:g}", row["integrator"].get<std::string>(),
                      row["tolerance"].get<double>()));
    } else {
      add(fmt::format("{} at {:.4g} ms", row["integrator"].get<std::string>(),
                      1e3 * row["step_s"].get<double>()));
    }
  }
  add(Factor(row["times_real_time"].get<double>()) + " x real time");
  return text;
}

}  // namespace

Json AccuracyReport(const AccuracyScene& s, const std::vector<Json>& references,
                    std::vector<Json> rows) {
  Json j = {{"study", "accuracy"},
            {"scene", s.scene.name},
            {"description", s.scene.description},
            {"scene_file", s.file},
            {"set", s.overrides},
            {"duration_s", s.scene.run.duration_s},
            {"sample_s", s.sample_s},
            {"headline", s.scene.robot.arms.empty() &&
                                 !std::holds_alternative<model::FreeRoot>(s.scene.robot.root)
                             ? "volume of the mantle, relative to its largest change"
                             : "largest distance of root and tips, in body lengths"},
            {"versions", StudyVersions()},
            {"references", references}};
  std::vector<double> cost, error;
  for (const Json& row : rows) {
    const bool ok = row["ok"].get<bool>();
    cost.push_back(ok ? Number(row, "cpu_s") : NAN);
    error.push_back(ok ? Number(row, "error_in_all") : NAN);
  }
  for (std::size_t i = 0; i < rows.size(); ++i) {
    rows[i]["front"] = false;
    if (!std::isfinite(error[i])) cost[i] = NAN;
  }
  Json front = Json::array();
  for (int i : ParetoFront(cost, error)) {
    rows[i]["front"] = true;
    front.push_back(rows[i]["name"]);
  }
  j["orders"] = Json::array();
  std::vector<Family> families;
  for (const auto& [name, order] :
       {std::pair{"backward_euler", 1.0}, {"sdirk2", 2.0}, {"sdirk3", 3.0}}) {
    families.push_back({"time", name, "step_s", false, order, 0});
  }
  const auto& robot = s.scene.robot;
  if (!robot.arms.empty())
    families.push_back({"arms", "", "arm_elements", true, 2, 0.25 / robot.arms[0].elements});
  if (robot.mantle)
    families.push_back({"mantle", "", "mantle_elements", true, 2, 0.25 / robot.mantle->elements});
  for (const Family& f : families) {
    if (Json order = OrderJson(f, rows); !order.is_null()) j["orders"].push_back(std::move(order));
  }
  j["front"] = front;
  j["recommendations"] = Json::array();
  for (double target : kTargets) {
    int best = -1;
    for (int i = 0; i < static_cast<int>(rows.size()); ++i) {
      if (error[i] <= target && std::isfinite(cost[i]) && (best < 0 || cost[i] < cost[best]))
        best = i;
    }
    if (best < 0) continue;
    j["recommendations"].push_back(
        {{"target", target},
         {"point", rows[best]["name"]},
         {"error_in_all", error[best]},
         {"times_real_time", rows[best]["times_real_time"]},
         {"text", fmt::format("for {} of body length: {} (error {})", Percent(target),
                              SettingsText(rows[best]), Percent(error[best]))}});
  }
  double most = 0, least = INFINITY;
  for (double e : error) {
    if (!std::isfinite(e) || !(e > 0)) continue;
    most = std::max(most, e);
    least = std::min(least, e);
  }
  j["decades"] = most > 0 ? std::log10(most / least) : 0.0;
  j["points"] = rows;
  return j;
}

}  // namespace mantle::tools
