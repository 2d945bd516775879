#pragma once

#include "loop/scene/catalogue.h"
#include "tools/mantle/summary.h"

namespace mantle::tools {

/// A JSON schema (draft 2020-12) of scenes: keys, types, bounds, choices, units and keys that
/// exclude each other, for editors that complete and check TOML. What depends on several values
/// (a strip on its meridian) is left to `mantle check`.
Json JsonSchema(const scene::Catalogue& catalogue);

}  // namespace mantle::tools
