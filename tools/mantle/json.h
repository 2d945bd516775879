#pragma once

#include <nlohmann/json.hpp>

namespace mantle::tools {

/// JSON of results: keys in the order in which they are written.
using Json = nlohmann::ordered_json;

}  // namespace mantle::tools
