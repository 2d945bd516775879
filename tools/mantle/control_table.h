#pragma once

#include <string>

#include "tools/mantle/summary.h"

/// What a person reads at the end of a closed loop.

namespace mantle::tools {

/// Lines for a terminal, of a run's summary with its table "control".
std::string ControlTable(const Json& summary);

}  // namespace mantle::tools
