#include "tools/report/telemetry_columns.h"

namespace mantle::tools {
namespace {

constexpr const char* kAxes[] = {"x", "y", "z"};

template <typename List>
void AddAxes(const std::string& stem, const List& values, std::size_t first, const char* unit,
             Columns* row) {
  for (std::size_t k = 0; k < 3; ++k) row->emplace_back(stem + kAxes[k] + unit, values[first + k]);
}

void AddState(const StateTelemetry& m, Columns* row) {
  AddAxes("root_", m.root_position, 0, "_m", row);
  AddAxes("root_w", m.root_twist, 0, "_rad_s", row);
  AddAxes("root_v", m.root_twist, 3, "_m_s", row);
  for (std::size_t a = 0; a < m.arm_name.size(); ++a) {
    AddAxes(m.arm_name[a] + "_tip_", m.tip_position[a], 0, "_m", row);
  }
  if (m.volume != 0) row->emplace_back("volume_m3", m.volume);
  row->emplace_back("thrust_n", m.thrust);
  for (std::size_t c = 0; c < m.cable_name.size(); ++c) {
    row->emplace_back(m.cable_name[c] + "_length_m", m.cable_length[c]);
    row->emplace_back(m.cable_name[c] + "_tension_n", m.cable_tension[c]);
  }
}

void AddControl(const ControlTelemetry& m, Columns* row) {
  for (std::size_t i = 0; i < m.motor_name.size(); ++i) {
    row->emplace_back("command_" + m.motor_name[i] + "_n", m.commanded_tension[i]);
    row->emplace_back("actual_" + m.motor_name[i] + "_n", m.actual_tension[i]);
  }
  if (m.reference_kind == "position") {
    AddAxes("reference_", m.reference, 0, "_m", row);
    row->emplace_back("error_position_m", m.error);
  } else if (m.reference_kind == "tip") {
    AddAxes("reference_tip_", m.reference, 0, "_m", row);
    row->emplace_back("error_tip_m", m.error);
  } else if (m.reference_kind == "velocity") {
    AddAxes("reference_v", m.reference, 0, "_m_s", row);
    row->emplace_back("error_mean_speed_m_s", m.error);
  }
}

void AddEnergy(const EnergyTelemetry& m, Columns* row) {
  row->emplace_back("kinetic_solid_j", m.kinetic_solid);
  row->emplace_back("kinetic_water_j", m.kinetic_water);
  row->emplace_back("elastic_arms_j", m.elastic_arms);
  row->emplace_back("elastic_mantle_j", m.elastic_mantle);
  row->emplace_back("index_output_w", m.output_power);
  row->emplace_back("index_input_w", m.input_power);
}

// The message of this time among rising ones, from `next` on; null where there is none.
template <typename Message>
const Message* AtTime(const std::vector<Message>& messages, std::int64_t utime, std::size_t* next) {
  while (*next < messages.size() && messages[*next].utime < utime) ++*next;
  const bool there = *next < messages.size() && messages[*next].utime == utime;
  return there ? &messages[*next] : nullptr;
}

}  // namespace

Columns TrajectoryColumns(const StateTelemetry* state, const ControlTelemetry* control,
                          const EnergyTelemetry* energy) {
  Columns row;
  if (state != nullptr) AddState(*state, &row);
  if (control != nullptr) AddControl(*control, &row);
  if (energy != nullptr) AddEnergy(*energy, &row);
  return row;
}

Columns EstimateColumns(const ControlTelemetry& m) {
  constexpr std::size_t kRoot = 6;
  constexpr const char* kNames[] = {"rx_rad",   "ry_rad", "rz_rad",   "x_m",
                                    "y_m",      "z_m",    "wx_rad_s", "wy_rad_s",
                                    "wz_rad_s", "vx_m_s", "vy_m_s",   "vz_m_s"};
  Columns columns;
  const std::size_t half = m.estimate_error.size() / 2;
  if (half < kRoot) return columns;
  AddAxes("estimate_", m.root_position, 0, "_m", &columns);
  const bool told = m.deviation.size() == m.estimate_error.size();
  for (std::size_t k = 0; k < 2 * kRoot; ++k) {
    const std::size_t at = k < kRoot ? k : half + k - kRoot;
    columns.emplace_back(std::string("error_") + kNames[k], m.estimate_error[at]);
    if (told) columns.emplace_back(std::string("sigma3_") + kNames[k], 3.0 * m.deviation[at]);
  }
  return columns;
}

std::optional<CsvTable> RecordedTable(const std::vector<StateTelemetry>& states,
                                      const std::vector<ControlTelemetry>& controls,
                                      const std::vector<EnergyTelemetry>& energies) {
  std::optional<CsvTable> table;
  std::size_t control = 0, energy = 0;
  for (const StateTelemetry& state : states) {
    const Columns row = TrajectoryColumns(&state, AtTime(controls, state.utime, &control),
                                          AtTime(energies, state.utime, &energy));
    if (!table) {
      table.emplace();
      table->titles.push_back("time_s");
      for (const auto& [title, value] : row) table->titles.push_back(title);
      table->columns.resize(table->titles.size());
    }
    if (row.size() + 1 != table->titles.size()) continue;
    table->columns[0].push_back(static_cast<double>(state.utime) / 1e6);
    for (std::size_t k = 0; k < row.size(); ++k) table->columns[k + 1].push_back(row[k].second);
  }
  return table;
}

}  // namespace mantle::tools
