#pragma once

#include <string>
#include <vector>

#include "tools/mantle/json.h"

namespace mantle::tools {

/// The rows of a study as CSV: a column for every number, word and truth value of any row, those of
/// tables within by path ("errors.root.largest"), lists joined by "; ", and of every row the
/// versions it was made with. Cells with commas, quotes or line feeds are quoted (RFC 4180).
/// Numbers read back to the same bits.
std::string StudyCsv(const std::vector<Json>& rows, const Json& versions);

}  // namespace mantle::tools
