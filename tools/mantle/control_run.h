#pragma once

#include <string>

#include "tools/mantle/scene_options.h"

/// `mantle run` of a scene with a table [control]: the closed loop (docs/control.md).

namespace mantle::tools {

struct ControlRunOptions {
  std::string controller;  ///< empty: the scene's
  std::string bus;         ///< empty: the scene's
  bool real_time{false};
  std::string lcm_url;  ///< empty: nowhere
  std::string record;   ///< candump log to write; empty: none

  /// The first option that was given, as it is typed; null where none was.
  const char* FirstGiven() const;
};

/// Runs to the scene's duration, writes summary.json, trajectory.csv, telemetry.lcmlog and, for a
/// controller that plans, solver.csv (docs/outputs.md), and prints what was achieved. The log has
/// the shape of every `shape_every`-th sample; 0: of none. Returns the exit status. Throws
/// scene::BadScene, BadInput.
int RunControlScene(const SceneOptions& scene, const ControlRunOptions& options, int shape_every);

}  // namespace mantle::tools
