#pragma once

#include <string>

#include "loop/scene/scene.h"
#include "model/statics.h"
#include "model/validity.h"
#include "tools/mantle/summary.h"

/// Outputs of `mantle static` (docs/outputs.md).

namespace mantle::tools {

/// summary.json. Loads are listed with their unit, the value at load factor 1, at the end and,
/// where one was passed, at the limit point.
Json StaticSummary(const scene::Scene& scene, const model::Plant& plant,
                   const model::StaticsResult& result, double wall_time_s,
                   const std::vector<std::string>& overrides);

/// path.csv: load_factor, unstable_directions, volume, tips, one row per converged point.
std::string StaticPathCsv(const model::Plant& plant, const model::StaticsResult& result);

/// shape.csv: every node of every body at the last equilibrium.
std::string ShapeCsv(const model::Plant& plant, const model::PlantState& state);

}  // namespace mantle::tools
