#pragma once

#include <cstdint>
#include <optional>

#include "tools/mantle/json.h"
#include "tools/mantle/telemetry.h"

/// What a run said at one instant, and how the page of `mantle live` gets it (tools/report/page/
/// src/live_frame.ts): whole in itself, so that a viewer may miss any number of frames.

namespace mantle::tools {

struct LiveFrame {
  std::int64_t utime{0};
  std::optional<StateTelemetry> state;
  std::optional<ControlTelemetry> control;
  std::optional<DrivesTelemetry> drives;
  std::optional<EnergyTelemetry> energy;
  std::optional<StatusTelemetry> status;
  std::optional<ShapeTelemetry> shape;
  std::optional<WaterTelemetry> water;
};

/// The tables' rows at this instant, by the titles of trajectory.csv (docs/outputs.md) and those of
/// the report's other tables: {"trajectory": {"time_s": ..., ...}, "energy": {...}, ...}. What is
/// not finite is null.
Json FrameRows(const LiveFrame& frame);

/// Rows and all the rest. `plan`, `session`: the newest ones, null where there is none.
Json FrameJson(const LiveFrame& frame, const PlanTelemetry* plan, const SessionTelemetry* session);

}  // namespace mantle::tools
