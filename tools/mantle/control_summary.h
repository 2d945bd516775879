#pragma once

#include <string>

#include "loop/closed_loop.h"
#include "tools/mantle/summary.h"

/// What a closed loop has achieved: the table "control" of summary.json (docs/outputs.md).

namespace mantle::tools {

struct ControlReport {
  const scene::Scene* scene;
  loop::ClosedLoop* loop;
  const loop::LoopResult* result;
  std::string controller;  ///< its name
  std::string bus;
  bool real_time{false};
  bool memory_locked{false};
};

Json ControlSummary(const ControlReport& report);

}  // namespace mantle::tools
