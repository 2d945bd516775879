#pragma once

#include <string>
#include <vector>

#include "model/plant.h"
#include "model/simulation.h"

/// Rows of trajectory.csv (docs/outputs.md): one per sample, numbers in shortest form that reads
/// back to the same bits.

namespace mantle::tools {

/// Names of the cables in the order of Sample::cable_length_m: "ARM_CABLE", then "MANTLE_SPOKES".
std::vector<std::string> CableNames(const model::Plant& plant);

/// Title line, with line end. Columns depend on the robot alone.
std::string TrajectoryTitles(const model::Plant& plant);

std::string TrajectoryRow(const model::Plant& plant, const model::Sample& sample);

}  // namespace mantle::tools
