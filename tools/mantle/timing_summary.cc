#include "tools/mantle/timing_summary.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace mantle::tools {
namespace {

constexpr double kMs_us = 1e-3;
constexpr int kColumns = 42;  // two to an octave

}  // namespace

Json HistogramJson(const loop::DurationHistogram& histogram) {
  if (histogram.count() == 0) return nullptr;
  Json bins = Json::array();
  for (std::size_t i = 0; i < loop::DurationHistogram::kBins; ++i) {
    if (histogram.bins()[i] == 0) continue;
    bins.push_back({{"from_ms", kMs_us * loop::DurationHistogram::BinBegin_us(i)},
                    {"count", histogram.bins()[i]}});
  }
  return {{"count", histogram.count()},
          {"median_ms", kMs_us * histogram.Quantile_us(0.5)},
          {"p99_ms", kMs_us * histogram.Quantile_us(0.99)},
          {"max_ms", kMs_us * static_cast<double>(histogram.worst_us())},
          {"bins", bins}};
}

Json FastLoopJson(const loop::FastLoopCounters& c) {
  return {{"cycles", c.cycles},
          {"late_cycles", c.late_cycles},
          {"missed_cycles", c.missed_cycles},
          {"predicted_cycles", c.predicted},
          {"late_plans", c.late_plans},
          {"old_messages", c.old_messages},
          {"vehicle_lost", c.lost},
          {"sync_lateness", HistogramJson(c.lateness)},
          {"command", HistogramJson(c.command)}};
}

Json PlantRunnerJson(const loop::PlantRunnerCounters& c) {
  return {{"periods", c.periods},
          {"late_periods", c.late_periods},
          {"syncs", c.syncs},
          {"lateness", HistogramJson(c.lateness)},
          {"work", HistogramJson(c.work)}};
}

std::string HistogramLine(const std::string& name, const Json& histogram) {
  if (histogram.is_null()) return fmt::format("{:<14} nothing", name);
  std::array<double, kColumns> columns{};
  double most = 0;
  for (const Json& bin : histogram["bins"]) {
    const double from_us = bin["from_ms"].get<double>() / kMs_us;
    const int column = from_us < 1 ? 0 : 1 + static_cast<int>(2 * std::log2(from_us) + 1e-6);
    double& count = columns[static_cast<std::size_t>(std::clamp(column, 0, kColumns - 1))];
    count += bin["count"].get<double>();
    most = std::max(most, count);
  }
  constexpr const char* kBlocks[] = {" ",      "\u2581", "\u2582", "\u2583", "\u2584",
                                     "\u2585", "\u2586", "\u2587", "\u2588"};
  std::string row;
  for (const double count : columns) {
    const double share = count == 0 ? 0 : 1 + 7 * std::log1p(count) / std::log1p(most);
    row += kBlocks[static_cast<std::size_t>(share)];
  }
  return fmt::format("{:<14} median {:.3f}, p99 {:.3f}, max {:.3f} ms |{}| 1 us to 1 s", name,
                     histogram["median_ms"].get<double>(), histogram["p99_ms"].get<double>(),
                     histogram["max_ms"].get<double>(), row);
}

}  // namespace mantle::tools
