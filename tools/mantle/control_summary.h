#pragma once

#include <string>

#include "loop/closed_loop.h"
#include "tools/mantle/summary.h"

/// What a closed loop has achieved: the table "control" of summary.json (docs/outputs.md).

namespace mantle::tools {

/// "mpc", "gait", "pursuit", "pid", "lqr": what scenes and --controller say.
const char* ControllerName(controller::ControllerKind kind);
/// Throws std::invalid_argument where there is none of that name.
controller::ControllerKind ControllerOf(const std::string& name);

struct ControlReport {
  const scene::Scene* scene;
  loop::ClosedLoop* loop;
  const loop::LoopResult* result;
  controller::ControllerKind controller;
  std::string bus;
  bool real_time{false};
  bool memory_locked{false};
};

Json ControlSummary(const ControlReport& report);

}  // namespace mantle::tools
