#include "tools/report/export_formats.h"
#include "tools/report/npz_file.h"

namespace mantle::tools {
namespace {

void Append(double v, std::vector<double>* to) { to->push_back(v); }
template <typename Container>
requires requires(const Container& c) { c.begin(); }
void Append(const Container& list, std::vector<double>* to) {
  for (const auto& v : list) Append(v, to);
}

// An array whose first axis is the shapes: what `part` says of each, of shape `rest` each.
template <typename Values>
void AddOverShapes(const RunRecord& run, const std::string& name, std::vector<std::size_t> rest,
                   Values values_of, NpzFile* file) {
  std::vector<double> values;
  for (const ShapeTelemetry& m : run.shapes) Append(values_of(m), &values);
  rest.insert(rest.begin(), run.shapes.size());
  file->Add(name, rest, values);
}

template <typename List>
auto Part(const List& list, std::size_t first, std::size_t count) {
  const auto begin = list.begin() + static_cast<std::ptrdiff_t>(first);
  return List(begin, begin + static_cast<std::ptrdiff_t>(count));
}

void AddShapes(const RunRecord& run, NpzFile* file) {
  const ShapeTelemetry& first = run.shapes.front();
  const auto add = [&](const std::string& name, std::vector<std::size_t> rest, auto part) {
    AddOverShapes(run, name, std::move(rest), part, file);
  };
  add("time_s", {}, [](const ShapeTelemetry& m) {
    return std::vector<double>{static_cast<double>(m.utime) / 1e6};
  });
  add("root_position_m", {3}, [](const ShapeTelemetry& m) { return m.root_position; });
  add("root_quaternion_wxyz", {4}, [](const ShapeTelemetry& m) { return m.root_quaternion; });
  std::size_t node = 0, span = 0;
  for (std::size_t a = 0; a < first.arm_name.size(); ++a) {
    const auto n = static_cast<std::size_t>(first.arm_nodes[a]);
    const std::string arm = first.arm_name[a] + "_";
    std::vector<double> fixed;
    Append(Part(first.arc_length, node, n), &fixed);
    file->Add(arm + "arc_length_m", {n}, fixed);
    fixed.clear();
    Append(Part(first.radius, node, n), &fixed);
    file->Add(arm + "radius_m", {n}, fixed);
    add(arm + "position_m", {n, 3},
        [&](const ShapeTelemetry& m) { return Part(m.position, node, n); });
    add(arm + "quaternion_wxyz", {n, 4},
        [&](const ShapeTelemetry& m) { return Part(m.quaternion, node, n); });
    add(arm + "strain", {n - 1, 6},
        [&](const ShapeTelemetry& m) { return Part(m.strain, span, n - 1); });
    add(arm + "stress", {n - 1, 6},
        [&](const ShapeTelemetry& m) { return Part(m.stress, span, n - 1); });
    node += n;
    span += n - 1;
  }
  if (const std::size_t n = first.mantle_profile.size(); n > 0) {
    const std::string mantle = first.mantle_name + "_";
    file->Add(mantle + "arc_length_m", {n}, first.mantle_arc_length);
    add(mantle + "profile", {n, 3}, [](const ShapeTelemetry& m) { return m.mantle_profile; });
    add(mantle + "strain", {n - 1, 5}, [](const ShapeTelemetry& m) { return m.mantle_strain; });
    add(mantle + "stress", {n - 1, 5}, [](const ShapeTelemetry& m) { return m.mantle_stress; });
  }
  std::size_t point = 0;
  for (std::size_t c = 0; c < first.cable_name.size(); ++c) {
    const auto n = static_cast<std::size_t>(first.cable_points[c]);
    const std::string cable = "cable_" + first.cable_name[c] + "_";
    add(cable + "position_m", {n, 3},
        [&](const ShapeTelemetry& m) { return Part(m.cable_position, point, n); });
    add(cable + "tension_n", {},
        [&](const ShapeTelemetry& m) { return std::vector<double>{double{m.cable_tension[c]}}; });
    point += n;
  }
}

// Plans with as many knots as the first one.
void AddPlans(const RunRecord& run, NpzFile* file) {
  const std::size_t knots = run.plans.front().time.size();
  const std::size_t motors = knots > 0 ? run.plans.front().tension.front().size() : 0;
  std::vector<double> made, time, tension, root;
  for (const PlanTelemetry& m : run.plans) {
    if (m.time.size() != knots || knots == 0 || m.tension.front().size() != motors) continue;
    made.push_back(static_cast<double>(m.utime) / 1e6);
    Append(m.time, &time);
    Append(m.tension, &tension);
    Append(m.root_position, &root);
  }
  file->Add("plan_made_s", {made.size()}, made);
  file->Add("plan_time_s", {made.size(), knots}, time);
  file->Add("plan_tension_n", {made.size(), knots, motors}, tension);
  file->Add("plan_root_position_m", {made.size(), knots, 3}, root);
}

}  // namespace

std::string ExportNpz(const RunRecord& run) {
  NpzFile file;
  if (!run.shapes.empty()) AddShapes(run, &file);
  if (!run.plans.empty()) AddPlans(run, &file);
  const auto table = [&](const std::optional<CsvTable>& t, const std::string& prefix) {
    if (!t) return;
    for (std::size_t c = 0; c < t->titles.size(); ++c) {
      file.Add(prefix + t->titles[c], {t->rows()}, t->columns[c]);
    }
  };
  table(run.trajectory, "trajectory_");
  table(run.solver, "solver_");
  table(run.path, "path_");
  return file.Finish();
}

}  // namespace mantle::tools
