#pragma once

#include "loop/closed_loop.h"
#include "tools/mantle/json.h"

/// How a loop in real time kept its times: part of summary.json (docs/outputs.md, docs/hil.md).

namespace mantle::tools {

/// Count, median, 99th percentile and maximum in ms, and the bins that hold something.
Json HistogramJson(const loop::DurationHistogram& histogram);

/// Of the control side: counts of cycles, and its histograms.
Json FastLoopJson(const loop::FastLoopCounters& counters);
/// Of the plant side.
Json PlantRunnerJson(const loop::PlantRunnerCounters& counters);

/// A line a histogram, by name, for a person: median, p99 and worst, and a row of blocks on a
/// logarithmic scale from 1 us to 1 s.
std::string HistogramLine(const std::string& name, const Json& histogram);

}  // namespace mantle::tools
