#pragma once

#include <cstdint>
#include <vector>

#include "tools/mantle/telemetry.h"

/// The bodies of a shape as surfaces of triangles in the earth frame, the same points and triangles
/// for every shape of a run: the mantle and the rigid body as surfaces of revolution, arms as
/// tubes, their sections those of the nodes.

namespace mantle::tools {

/// Which body a vertex is of.
enum class SurfaceBody : std::int32_t { kMantle = 0, kArm = 1, kRigid = 2 };

struct Surface {
  std::vector<Triple> position;  ///< [m]
  std::vector<std::array<std::uint32_t, 3>> triangles;
  std::vector<SurfaceBody> body;  ///< of each vertex, as what follows
  std::vector<std::int32_t> arm;  ///< which arm; -1 for other bodies
  /// Of the mantle, NaN elsewhere; of arms, NaN elsewhere [1/m]: means of the spans beside.
  std::vector<double> hoop_strain, curvature;
};

Surface SurfaceOf(const ShapeTelemetry& shape);

/// v rotated by q (w, x, y, z).
Triple Rotate(const Quaternion& q, const Triple& v);

}  // namespace mantle::tools
