#pragma once

#include <cstdint>

#include "controller/exchange.h"
#include "controller/registry.h"

namespace mantle::tools {

/// The newest command from another program (MANTLE_COMMAND).
struct FollowCommand {
  std::int64_t came_us{0};  ///< CLOCK_MONOTONIC
  double time_out_s{0};
  model::VectorX tension_n;  ///< one per motor; empty before the first
};

/// The name under which `commands`, which must outlive every controller, is followed: the tensions
/// of the newest command until its time-out has passed, then the motors' lower limits. Bounds and
/// rates are seen to by the control side.
inline constexpr const char* kFollow = "follow";
void RegisterFollowController(controller::Exchange<FollowCommand>& commands);

}  // namespace mantle::tools
