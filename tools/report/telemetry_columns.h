#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "tools/mantle/telemetry.h"
#include "tools/report/csv_table.h"

/// Messages as columns of tables, under the titles of trajectory.csv (docs/outputs.md), for what
/// has no such table: a run that is going on, a recording.

namespace mantle::tools {

using Columns = std::vector<std::pair<std::string, double>>;

/// What messages of one instant say; each may be null.
Columns TrajectoryColumns(const StateTelemetry* state, const ControlTelemetry* control,
                          const EnergyTelemetry* energy);

/// The root's estimated position in the earth frame ("estimate_x_m"), and the estimator's errors:
/// of the root its attitude [rad], position [m], turn rate [rad/s] and velocity [m/s], truth
/// against estimate, in the estimate's root frame ("error_x_m"), and, where the estimator tells its
/// deviations, three of each ("sigma3_x_m"). Empty where the message has fewer than a root's
/// errors.
Columns EstimateColumns(const ControlTelemetry& control);

/// The table of a log: a row for each state, with the others of the same instant. None without
/// states. Rows of other columns than the first one's are left out.
std::optional<CsvTable> RecordedTable(const std::vector<StateTelemetry>& states,
                                      const std::vector<ControlTelemetry>& controls,
                                      const std::vector<EnergyTelemetry>& energies);

}  // namespace mantle::tools
