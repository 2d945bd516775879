#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string_view>

#include "loop/scene/regular_file.h"
#include "model/simulation.h"
#include "tools/mantle/lcm_bridge.h"
#include "tools/mantle/shape_telemetry.h"
#include "tools/mantle/water_telemetry.h"

/// telemetry.lcmlog of a run without a control loop (docs/telemetry.md): MANTLE_STATE,
/// MANTLE_ENERGY where energies are accounted, and MANTLE_SHAPE with, where water drags,
/// MANTLE_WATER.

namespace mantle::tools {

class RunLog {
 public:
  /// How much of the log there is, and the hash of these bytes.
  struct Mark {
    long bytes{0};
    std::uint64_t hash{scene::kEmptyHash};
  };

  /// Shapes of every `shape_every`-th sample, 1 or more, and of the last one. Throws BadInput as
  /// ShapeMessages.
  RunLog(const model::Plant& plant, int shape_every, std::string_view name = kTelemetryLogName);

  /// Makes the file in `folder`. A resumed run goes on from `begin`, made of `samples`. Throws
  /// BadInput, CannotGoOn.
  void Start(const std::filesystem::path& folder, std::string_view begin = {},
             std::int64_t samples = 0);
  /// `state` is what `sample` was observed of; `energy` may be null. Throws CannotGoOn.
  void Add(const model::Sample& sample, const model::PlantState& state,
           const model::EnergyAccount* energy, bool at_end);
  /// The system has what was added. Throws CannotGoOn.
  Mark Flush();
  /// The disk has it. Throws CannotGoOn.
  void Close();

 private:
  const model::Plant& plant_;
  ShapeMessages shapes_;
  WaterMessages waters_;
  int shape_every_;
  std::unique_ptr<LcmLink> link_;
  std::filesystem::path file_;
  std::string name_;
  std::int64_t samples_{0};
  Mark mark_;
};

}  // namespace mantle::tools
