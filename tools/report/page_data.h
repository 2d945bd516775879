#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "tools/report/run_folder.h"

/// What the report's page gets of runs (tools/report/page/src/model.ts): tables, shapes, plans and
/// drives as packed arrays, thinned evenly where they would not fit, with the error that this
/// makes.

namespace mantle::tools {

inline constexpr int kPageFormat = 2;

struct PageOptions {
  /// Largest size of what one run puts on the page [bytes]; shapes are thinned to it.
  std::size_t run_bytes{4'200'000};
  /// Most rows of a table.
  std::size_t rows{4'000};
};

/// {"format", "made_by", "runs"}. Labels of the records differ.
Json PageData(std::span<const RunRecord> records, const PageOptions& options = {});

/// Makes the labels of records differ: by their folders, then by numbers.
void TellApart(std::vector<RunRecord>* records);

}  // namespace mantle::tools
