#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "tools/mantle/summary.h"
#include "tools/mantle/telemetry.h"
#include "tools/report/csv_table.h"

/// A folder of results read back (docs/outputs.md): what `mantle run`, `static`, `modes`,
/// `compare`, `study` and `tune` leave, whole or as *.partial, and recordings of `mantle live`.

namespace mantle::tools {

enum class ResultKind { kRun, kCompare, kStatic, kModes, kStudy, kTune };
const char* ToString(ResultKind kind);

struct RunRecord {
  std::string label;             ///< tells it from others on the page
  std::filesystem::path folder;  ///< as it was given
  ResultKind kind{ResultKind::kRun};
  bool complete{false};
  Json summary;  ///< of summary.json, study.json or tuning.json; null where there is none
  std::vector<std::string> notes;  ///< what a reader must know: what is missing, or cut short

  /// Of a recording, which has no tables, the trajectory is made of its log.
  std::optional<CsvTable> trajectory, solver, path;
  std::vector<ShapeTelemetry> shapes;  ///< all with the same bodies
  std::vector<PlanTelemetry> plans;
  std::vector<DrivesTelemetry> drives;
  std::vector<StateTelemetry> states;  ///< of a recording alone, while it is read
  std::vector<EnergyTelemetry> energies;
  std::vector<StatusTelemetry> statuses;
  std::vector<ControlTelemetry> controls;
  std::vector<WaterTelemetry> waters;
};

/// One record; two (the full and the reduced model) of `mantle compare`. A log or table that is cut
/// short is read up to there, with a note, where the results are not complete. Throws BadInput: no
/// folder, or not one of results; a file that is no regular one; damage in results that are
/// complete.
std::vector<RunRecord> ReadRunFolder(const std::filesystem::path& folder);

}  // namespace mantle::tools
