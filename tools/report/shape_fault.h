#pragma once

#include "tools/mantle/telemetry.h"

/// Whether a shape is consistent in itself and with those before it, which the wire alone does not
/// say.

namespace mantle::tools {

/// What is wrong with a shape; null: nothing. Its counts must be those of its lists.
const char* ShapeFault(const ShapeTelemetry& shape);

/// Whether both are of the same bodies, so that one may be drawn after the other.
bool SameBodies(const ShapeTelemetry& a, const ShapeTelemetry& b);

}  // namespace mantle::tools
