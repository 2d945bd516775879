#include "tools/report/page_data.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "mantle/version.h"
#include "tools/report/packed_array.h"
#include "tools/report/telemetry_columns.h"

namespace mantle::tools {
namespace {

using Rows = std::vector<std::size_t>;

constexpr std::size_t kFewestFrames = 2;
constexpr std::size_t kMostPlans = 2'000;
// What plots stand over, and shapes are found by, takes single precision.
constexpr double kTimeError = 1e-9;

double Seconds(std::int64_t utime) { return static_cast<double>(utime) / 1e6; }

template <typename Message>
std::vector<double> Times(const std::vector<Message>& messages) {
  std::vector<double> times;
  for (const Message& m : messages) times.push_back(Seconds(m.utime));
  return times;
}

/// One number of each kept message, or several: what `values` appends.
template <typename Message, typename Values>
std::vector<double> Collect(const std::vector<Message>& messages, const Rows& kept, Values values) {
  std::vector<double> out;
  for (const std::size_t i : kept) values(messages[i], &out);
  return out;
}

template <typename Message>
Json PackTimes(const std::vector<Message>& messages, const Rows& kept) {
  const std::vector<double> times = Collect(
      messages, kept, [](const Message& m, auto* out) { out->push_back(Seconds(m.utime)); });
  return Pack(times, kTimeError).json;
}

/// A table with its first column `over`.
Json TableJson(const std::vector<std::string>& titles,
               const std::vector<std::vector<double>>& columns, const PageOptions& options) {
  const std::vector<double>& over = columns.front();
  const Rows kept = EveryKth(over.size(), ThinningFor(over.size(), options.rows));
  Json list = Json::array();
  for (std::size_t c = 0; c < columns.size(); ++c) {
    const std::vector<double>& all = columns[c];
    if (std::none_of(all.begin(), all.end(), [](double v) { return std::isfinite(v); })) continue;
    std::vector<double> values;
    for (const std::size_t i : kept) values.push_back(all[i]);
    const PackedArray packed = Pack(values, c == 0 ? kTimeError : 0.0);
    const double error = packed.error + ThinningError(over, all, kept);
    list.push_back({{"name", titles[c]}, {"data", packed.json}, {"error", error}});
  }
  return {
      {"over", titles.front()}, {"rows", kept.size()}, {"of_rows", over.size()}, {"columns", list}};
}

Json TableJson(const CsvTable& table, const PageOptions& options) {
  return TableJson(table.titles, table.columns, options);
}

Json EnergyJson(const std::vector<EnergyTelemetry>& energies, const PageOptions& options) {
  std::vector<std::string> titles{"time_s", "gravity_j", "dissipated_j"};
  std::vector<std::vector<double>> columns(3);
  for (const std::string& name : energies.front().work_name) {
    titles.push_back("work " + name);
    columns.emplace_back();
  }
  for (const EnergyTelemetry& m : energies) {
    if (m.work.size() + 3 != columns.size()) continue;
    columns[0].push_back(Seconds(m.utime));
    columns[1].push_back(m.gravity);
    columns[2].push_back(m.dissipated);
    for (std::size_t k = 0; k < m.work.size(); ++k) columns[3 + k].push_back(m.work[k]);
  }
  return TableJson(titles, columns, options);
}

Json CountersJson(const std::vector<StatusTelemetry>& statuses, const PageOptions& options) {
  std::vector<std::vector<double>> columns(4);
  for (const StatusTelemetry& m : statuses) {
    columns[0].push_back(Seconds(m.utime));
    columns[1].push_back(static_cast<double>(m.misses));
    columns[2].push_back(static_cast<double>(m.fallbacks));
    columns[3].push_back(static_cast<double>(m.safe_decays));
  }
  return TableJson({"time_s", "misses", "fallbacks", "safe_decays"}, columns, options);
}

// Empty where no estimator reports.
Json EstimateJson(const std::vector<ControlTelemetry>& controls, const PageOptions& options) {
  std::vector<std::string> titles{"time_s"};
  for (const auto& [title, value] : EstimateColumns(controls.front())) titles.push_back(title);
  if (titles.size() == 1) return {};
  std::vector<std::vector<double>> columns(titles.size());
  for (const ControlTelemetry& m : controls) {
    const auto row = EstimateColumns(m);
    if (row.size() + 1 != columns.size()) continue;
    columns[0].push_back(Seconds(m.utime));
    for (std::size_t k = 0; k < row.size(); ++k) columns[k + 1].push_back(row[k].second);
  }
  return TableJson(titles, columns, options);
}

// Where the words change.
Json StatusJson(const std::vector<StatusTelemetry>& statuses) {
  Json time = Json::array(), mode = Json::array(), solver = Json::array();
  const StatusTelemetry* before = nullptr;
  for (const StatusTelemetry& m : statuses) {
    if (before != nullptr && m.control_mode == before->control_mode &&
        m.solver_status == before->solver_status) {
      continue;
    }
    time.push_back(Seconds(m.utime));
    mode.push_back(m.control_mode);
    solver.push_back(m.solver_status);
    before = &m;
  }
  return {{"time", time}, {"control_mode", mode}, {"solver_status", solver}};
}

Json PlansJson(const std::vector<PlanTelemetry>& plans) {
  const Rows kept = EveryKth(plans.size(), ThinningFor(plans.size(), kMostPlans));
  std::size_t knots = plans.front().time.size(), arms = 0;
  for (const PlanTelemetry& m : plans) knots = std::min(knots, m.time.size());
  if (knots > 0) arms = plans.front().tip_position.front().size();
  const auto triple = [](const Triple& p, std::vector<double>* out) {
    out->insert(out->end(), p.begin(), p.end());
  };
  Json j = {{"time", PackTimes(plans, kept)}, {"knots", knots}, {"arms", arms}};
  j["ahead"] = Pack(Collect(plans, kept, [&](const PlanTelemetry& m, auto* out) {
                 out->insert(out->end(), m.time.begin(),
                             m.time.begin() + static_cast<std::ptrdiff_t>(knots));
               })).json;
  j["root"] = Pack(Collect(plans, kept, [&](const PlanTelemetry& m, auto* out) {
                for (std::size_t k = 0; k < knots; ++k) triple(m.root_position[k], out);
              })).json;
  j["tips"] = Pack(Collect(plans, kept, [&](const PlanTelemetry& m, auto* out) {
                for (std::size_t k = 0; k < knots; ++k) {
                  for (std::size_t a = 0; a < arms; ++a) triple(m.tip_position[k][a], out);
                }
              })).json;
  return j;
}

Json DrivesJson(const std::vector<DrivesTelemetry>& drives, const PageOptions& options) {
  const Rows kept = EveryKth(drives.size(), ThinningFor(drives.size(), options.rows));
  const DrivesTelemetry& first = drives.front();
  const auto field = [&](auto DrivesTelemetry::*member) {
    return Pack(Collect(drives, kept,
                        [&](const DrivesTelemetry& m, auto* out) {
                          for (const auto value : m.*member)
                            out->push_back(static_cast<double>(value));
                        }))
        .json;
  };
  return {{"time", PackTimes(drives, kept)},
          {"motors", first.motor_name},
          {"nodes", first.node},
          {"statusword", field(&DrivesTelemetry::statusword)},
          {"torque_permille", field(&DrivesTelemetry::torque_permille)},
          {"target_torque_permille", field(&DrivesTelemetry::target_torque_permille)},
          {"temperature_celsius", field(&DrivesTelemetry::temperature_celsius)},
          {"reeled_length", field(&DrivesTelemetry::reeled_length)}};
}

// Largest distance of a node between a shape that is left out and the line between its neighbours.
double ShapeThinningError(const std::vector<ShapeTelemetry>& shapes, const Rows& kept) {
  double error = 0;
  for (std::size_t i = 0; i + 1 < kept.size(); ++i) {
    const ShapeTelemetry &a = shapes[kept[i]], &b = shapes[kept[i + 1]];
    for (std::size_t j = kept[i] + 1; j < kept[i + 1]; ++j) {
      const double span = Seconds(b.utime - a.utime);
      const double share = span > 0 ? Seconds(shapes[j].utime - a.utime) / span : 0;
      for (std::size_t n = 0; n < a.position.size(); ++n) {
        double square = 0;
        for (std::size_t k = 0; k < 3; ++k) {
          const double line = a.position[n][k] + share * (b.position[n][k] - a.position[n][k]);
          square += std::pow(shapes[j].position[n][k] - line, 2);
        }
        error = std::max(error, std::sqrt(square));
      }
    }
  }
  return error;
}

std::size_t FrameBytes(const ShapeTelemetry& m) {
  const std::size_t numbers = 7 + 3 * m.position.size() + m.strain.size() +
                              2 * m.mantle_profile.size() + m.mantle_strain.size() +
                              3 * m.cable_position.size() + m.cable_tension.size() + 1;
  return numbers * sizeof(std::uint16_t) * 4 / 3 + 1;
}

// Arrows, for which so many instants and a line between them are enough; null where the messages
// are not of these shapes.
Json DragJson(const RunRecord& r) {
  const std::size_t nodes = r.shapes.front().position.size();
  const auto fits = [&](const WaterTelemetry& m) { return m.drag.size() == nodes; };
  if (r.waters.empty() || !std::all_of(r.waters.begin(), r.waters.end(), fits)) return {};
  constexpr std::size_t kMostInstants = 500;
  const Rows kept = EveryKth(r.waters.size(), ThinningFor(r.waters.size(), kMostInstants));
  Json j = {{"time", PackTimes(r.waters, kept)}};
  j["nodes"] = Pack(Collect(r.waters, kept, [](const WaterTelemetry& m, auto* out) {
                 for (const auto& force : m.drag) {
                   out->insert(out->end(), force.begin(), force.end());
                 }
               })).json;
  j["body"] = Pack(Collect(r.waters, kept, [](const WaterTelemetry& m, auto* out) {
                out->insert(out->end(), m.body_drag.begin(), m.body_drag.end());
              })).json;
  return j;
}

Json ShapeJson(const std::vector<ShapeTelemetry>& shapes, std::size_t bytes) {
  const ShapeTelemetry& first = shapes.front();
  const std::size_t most = std::max(kFewestFrames, bytes / FrameBytes(first));
  const Rows kept = EveryKth(shapes.size(), ThinningFor(shapes.size(), most));
  double error = 0;
  const auto pack = [&](auto values) { return Pack(Collect(shapes, kept, values)); };
  const auto place = [&](auto values) {
    const PackedArray packed = pack(values);
    error = std::max(error, std::sqrt(3.0) * packed.error);
    return packed.json;
  };
  Json j = {{"time", PackTimes(shapes, kept)}, {"of_frames", shapes.size()}, {"error_m", 0.0}};
  j["root_position"] = place([](const ShapeTelemetry& m, auto* out) {
    out->insert(out->end(), m.root_position.begin(), m.root_position.end());
  });
  j["root_quaternion"] =
      pack([](const ShapeTelemetry& m, auto* out) {
        out->insert(out->end(), m.root_quaternion.begin(), m.root_quaternion.end());
      }).json;
  j["arms"] = Json::array();
  std::size_t node = 0, span = 0;
  for (std::size_t a = 0; a < first.arm_name.size(); ++a) {
    const auto nodes = static_cast<std::size_t>(first.arm_nodes[a]);
    std::vector<double> radius(first.radius.begin() + static_cast<std::ptrdiff_t>(node),
                               first.radius.begin() + static_cast<std::ptrdiff_t>(node + nodes));
    Json arm = {{"name", first.arm_name[a]}, {"nodes", nodes}, {"radius", Pack(radius).json}};
    arm["position"] = place([&](const ShapeTelemetry& m, auto* out) {
      for (std::size_t i = node; i < node + nodes; ++i) {
        out->insert(out->end(), m.position[i].begin(), m.position[i].end());
      }
    });
    arm["curvature"] = pack([&](const ShapeTelemetry& m, auto* out) {
                         for (std::size_t i = span; i < span + nodes - 1; ++i) {
                           out->push_back(std::hypot(m.strain[i][1], m.strain[i][2]));
                         }
                       }).json;
    j["arms"].push_back(arm);
    node += nodes;
    span += nodes - 1;
  }
  j["mantle"] = Json();
  if (!first.mantle_profile.empty()) {
    Json mantle = {{"name", first.mantle_name},
                   {"nodes", first.mantle_profile.size()},
                   {"half_thickness", first.mantle_half_thickness}};
    mantle["profile"] = place([](const ShapeTelemetry& m, auto* out) {
      for (const Triple& q : m.mantle_profile) out->insert(out->end(), q.begin(), q.begin() + 2);
    });
    mantle["hoop"] = pack([](const ShapeTelemetry& m, auto* out) {
                       for (const auto& e : m.mantle_strain) out->push_back(double{e[1]});
                     }).json;
    j["mantle"] = mantle;
  }
  j["rigid"] = first.rigid_profile;
  j["cables"] = Json::array();
  std::size_t point = 0;
  for (std::size_t c = 0; c < first.cable_name.size(); ++c) {
    const auto points = static_cast<std::size_t>(first.cable_points[c]);
    Json cable = {{"name", first.cable_name[c]}, {"points", points}};
    cable["position"] = place([&](const ShapeTelemetry& m, auto* out) {
      for (std::size_t i = point; i < point + points; ++i) {
        out->insert(out->end(), m.cable_position[i].begin(), m.cable_position[i].end());
      }
    });
    cable["tension"] = pack([&](const ShapeTelemetry& m, auto* out) {
                         out->push_back(double{m.cable_tension[c]});
                       }).json;
    j["cables"].push_back(cable);
    point += points;
  }
  j["error_m"] = error + ShapeThinningError(shapes, kept);
  return j;
}

Json RunJson(const RunRecord& r, const PageOptions& options) {
  Json j = {{"label", r.label},       {"folder", r.folder.string()}, {"kind", ToString(r.kind)},
            {"complete", r.complete}, {"summary", r.summary},        {"notes", r.notes}};
  if (r.trajectory) j["trajectory"] = TableJson(*r.trajectory, options);
  if (r.solver) j["solver"] = TableJson(*r.solver, options);
  if (r.path) j["path"] = TableJson(*r.path, options);
  if (!r.energies.empty()) j["energy"] = EnergyJson(r.energies, options);
  if (!r.plans.empty()) j["plans"] = PlansJson(r.plans);
  if (!r.drives.empty()) j["drives"] = DrivesJson(r.drives, options);
  if (!r.statuses.empty()) {
    j["counters"] = CountersJson(r.statuses, options);
    j["status"] = StatusJson(r.statuses);
  }
  if (!r.controls.empty()) {
    if (Json estimate = EstimateJson(r.controls, options); !estimate.is_null()) {
      j["estimate"] = std::move(estimate);
    }
  }
  if (!r.shapes.empty()) {
    constexpr std::size_t kLeastForShapes = 200'000;
    Json drag = DragJson(r);
    const std::size_t others =
        drag.dump().size() + j.dump(-1, ' ', false, Json::error_handler_t::replace).size();
    const std::size_t left = options.run_bytes > others ? options.run_bytes - others : 0;
    j["shape"] = ShapeJson(r.shapes, std::max(left, kLeastForShapes));
    j["shape"]["drag"] = std::move(drag);
  }
  return j;
}

}  // namespace

Json PageData(std::span<const RunRecord> records, const PageOptions& options) {
  Json runs = Json::array();
  for (const RunRecord& record : records) runs.push_back(RunJson(record, options));
  return {{"format", kPageFormat}, {"made_by", fmt::format("Mantle {}", kVersion)}, {"runs", runs}};
}

void TellApart(std::vector<RunRecord>* records) {
  std::map<std::string, int> count;
  for (const RunRecord& r : *records) ++count[r.label];
  for (RunRecord& r : *records) {
    if (count[r.label] < 2) continue;
    const std::string model =
        r.label.find(": ") == std::string::npos ? "" : r.label.substr(r.label.rfind(": "));
    r.label = r.folder.lexically_normal().string() + model;
  }
  count.clear();
  for (RunRecord& r : *records) {
    if (const int n = ++count[r.label]; n > 1) r.label += fmt::format(" ({})", n);
  }
}

}  // namespace mantle::tools
