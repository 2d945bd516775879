#include "loop/closed_loop.h"
#include "tools/mantle/control_summary.h"
#include "tools/studies/study_kinds.h"

// One controller on one scene.

namespace mantle::tools {

Json RunControlPoint(const StudyPoint& point) {
  const std::string controller = point.options.at("controller");
  scene::Scene scene = scene::LoadScene(point.scene, point.overrides);
  loop::ClosedLoopOptions run;
  run.controller = controller == "converged" ? "mpc" : controller;
  if (controller == "converged" && scene.control) {
    scene.control->mode = controller::MpcMode::kConverged;
  }
  loop::ClosedLoop loop(scene, run);
  const double begin = CpuSeconds();
  const loop::LoopResult result = loop.Run();
  Json row = ControlSummary({&scene, &loop, &result, *run.controller, scene.drives.bus});
  row["controller"] = controller;
  row["scene"] = scene.name;
  row["name"] = point.name;
  row["overrides"] = point.overrides;
  row["ok"] = result.ok;
  row["reason"] = result.reason;
  row["sim_time_s"] = result.time_s;
  row["wall_time_s"] = result.wall_s;
  row["cpu_s"] = CpuSeconds() - begin;
  return row;
}

}  // namespace mantle::tools
