#include "tools/report/run_folder.h"

#include <fmt/format.h>

#include <algorithm>

#include "loop/scene/regular_file.h"
#include "tools/mantle/bad_input.h"
#include "tools/mantle/lcm_bridge.h"
#include "tools/mantle/output_folder.h"
#include "tools/report/shape_fault.h"
#include "tools/report/telemetry_columns.h"

namespace mantle::tools {
namespace {

namespace fs = std::filesystem;

constexpr std::uintmax_t kMostJson_bytes = 256 << 20;

Json ReadJsonFile(const fs::path& file) {
  try {
    return Json::parse(scene::ReadRegularFile(file, kMostJson_bytes));
  } catch (const scene::UnreadableFile& error) {
    throw BadInput(fmt::format("{}: cannot be read: {}", file.string(), error.what()));
  } catch (const Json::exception&) {
    throw BadInput(fmt::format("{}: is not JSON, or damaged", file.string()));
  }
}

// The name that a run goes by: the last part of its folder's.
std::string LabelOf(const fs::path& folder) {
  const fs::path path = fs::absolute(folder).lexically_normal();
  return path.has_filename() ? path.filename().string() : path.parent_path().filename().string();
}

/// Keeps the messages of a log; shapes must be consistent in themselves and among each other.
class LogReader final : public TelemetrySink {
 public:
  LogReader(const fs::path& file, RunRecord* record) : file_(file), record_(record) {}

  void Write(const StateTelemetry& m) override { record_->states.push_back(m); }
  void Write(const ReducedStateTelemetry&) override {}
  void Write(const PlanTelemetry& m) override { record_->plans.push_back(m); }
  void Write(const DrivesTelemetry& m) override { record_->drives.push_back(m); }
  void Write(const EnergyTelemetry& m) override { record_->energies.push_back(m); }
  void Write(const StatusTelemetry& m) override { record_->statuses.push_back(m); }
  void Write(const ControlTelemetry& m) override { record_->controls.push_back(m); }
  void Write(const WaterTelemetry& m) override { record_->waters.push_back(m); }
  void Write(const SessionTelemetry&) override {}
  void Write(const ShapeTelemetry& m) override {
    if (const char* fault = ShapeFault(m)) throw Bad(m, fault);
    if (!record_->shapes.empty()) {
      if (!SameBodies(m, record_->shapes.front())) {
        throw Bad(m, "has other bodies than the first message, must be one robot in a log");
      }
      if (m.utime < record_->shapes.back().utime) {
        throw Bad(m, "is older than the message before it");
      }
    }
    record_->shapes.push_back(m);
  }

 private:
  BadInput Bad(const ShapeTelemetry& m, const char* why) const {
    return BadInput(fmt::format("{}: MANTLE_SHAPE at utime {}: {}", file_.string(), m.utime, why));
  }

  const fs::path& file_;
  RunRecord* record_;
};

// Damage is for the reader to know where the run was stopped, and refused where it was not.
void Damaged(const std::string& what, RunRecord* record) {
  if (record->complete) throw BadInput(what);
  record->notes.push_back(what + "; what stands before that is shown");
}

void ReadLog(const fs::path& file, RunRecord* record) {
  if (!fs::exists(file)) return;
  LogReader reader(file, record);
  std::int64_t malformed = 0;
  const char* why = "";
  const LogEnd end = ReadEventLog(file, [&](const LogEvent& event) {
    if (!event.channel.starts_with("MANTLE_")) return;
    if (!DecodeTelemetry(event.channel, event.bytes, reader, &why)) ++malformed;
  });
  if (malformed > 0) {
    Damaged(fmt::format("{}: {} of {} messages cannot be read: {}", file.string(), malformed,
                        end.events, why),
            record);
  }
  if (end.damaged_at_byte) {
    Damaged(fmt::format("{}: cut short or damaged after event {} (byte {})", file.string(),
                        end.events, *end.damaged_at_byte),
            record);
  }
}

std::optional<CsvTable> ReadTable(const fs::path& file, RunRecord* record) {
  if (!fs::exists(file)) return {};
  CsvTable table = ReadCsvTable(file);
  if (table.cut_short) Damaged(fmt::format("{}: cut short", file.string()), record);
  if (table.rows() == 0) {
    record->notes.push_back(fmt::format("{}: has no rows", file.string()));
    return {};
  }
  return table;
}

bool IsComplete(const Json& summary) {
  return summary.is_object() && summary.contains("complete") && summary["complete"].is_boolean() &&
         summary["complete"].get<bool>();
}

RunRecord Start(const fs::path& folder, ResultKind kind, const Json& summary) {
  RunRecord record;
  record.label = LabelOf(folder);
  record.folder = folder;
  record.kind = kind;
  record.summary = summary;
  record.complete = kind == ResultKind::kStudy                                ? true
                    : kind == ResultKind::kModes || kind == ResultKind::kTune ? !summary.is_null()
                                                                              : IsComplete(summary);
  if (summary.is_null()) {
    record.notes.push_back("There is no summary.json: the run was killed, or is still going on.");
  } else if (!record.complete && summary.contains("reason") && summary["reason"].is_string()) {
    record.notes.push_back("Stopped: " + summary["reason"].get<std::string>());
  }
  if (summary.is_object() && summary.contains("warnings") && summary["warnings"].is_array()) {
    for (const Json& warning : summary["warnings"]) {
      if (warning.is_string()) record.notes.push_back(warning.get<std::string>());
    }
  }
  return record;
}

BadInput NoResults(const fs::path& folder) {
  std::string why = fmt::format("{}: ", folder.string());
  if (fs::is_directory(folder)) {
    why +=
        "has no results: must hold summary.json or trajectory.csv of `mantle run`, `static`, "
        "`modes` or `compare`, study.json of `mantle study`, tuning.json of `mantle tune`, or "
        "telemetry.lcmlog";
  } else {
    why += fs::exists(folder) ? "is no folder: must be a folder of results"
                              : "there is no such folder: must be a folder of results";
  }
  const fs::path partial = PartialOf(folder, "").parent_path();
  if (fs::is_directory(partial)) why += fmt::format("; a stopped run left {}", partial.string());
  return BadInput(why);
}

}  // namespace

const char* ToString(ResultKind kind) {
  switch (kind) {
    case ResultKind::kRun:
      return "run";
    case ResultKind::kCompare:
      return "compare";
    case ResultKind::kStatic:
      return "static";
    case ResultKind::kModes:
      return "modes";
    case ResultKind::kStudy:
      return "study";
    case ResultKind::kTune:
      return "tune";
  }
  return "run";
}

std::vector<RunRecord> ReadRunFolder(const fs::path& folder) {
  const auto has = [&](const char* name) { return fs::exists(folder / name); };
  if (!fs::is_directory(folder)) throw NoResults(folder);
  if (has("study.json") && !has("summary.json")) {
    return {Start(folder, ResultKind::kStudy, ReadJsonFile(folder / "study.json"))};
  }
  if (has("tuning.json") && !has("summary.json")) {
    return {Start(folder, ResultKind::kTune, ReadJsonFile(folder / "tuning.json"))};
  }
  const Json summary = has("summary.json") ? ReadJsonFile(folder / "summary.json") : Json();
  if (has("full.csv") || has("reduced.csv")) {
    std::vector<RunRecord> records;
    for (const std::string model : {"full", "reduced"}) {
      RunRecord record = Start(folder, ResultKind::kCompare, summary);
      record.label += ": " + model;
      record.trajectory = ReadTable(folder / (model + ".csv"), &record);
      ReadLog(folder / (model + ".lcmlog"), &record);
      records.push_back(std::move(record));
    }
    return records;
  }
  const ResultKind kind = has("path.csv")     ? ResultKind::kStatic
                          : has("shapes.csv") ? ResultKind::kModes
                                              : ResultKind::kRun;
  const bool recording = summary.is_null() && !has("trajectory.csv") && kind == ResultKind::kRun;
  if (recording && !has(kTelemetryLogName)) {
    throw NoResults(folder);
  }
  RunRecord record = Start(folder, kind, summary);
  record.trajectory = ReadTable(folder / "trajectory.csv", &record);
  record.solver = ReadTable(folder / "solver.csv", &record);
  record.path = ReadTable(folder / "path.csv", &record);
  ReadLog(folder / kTelemetryLogName, &record);
  if (recording) {
    record.notes = {"A recording: telemetry alone, without a run's tables and summary."};
    record.trajectory = RecordedTable(record.states, record.controls, record.energies);
  }
  record.states.clear();
  return {std::move(record)};
}

}  // namespace mantle::tools
