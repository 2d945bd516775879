#pragma once

#include <gtest/gtest.h>

#include "reduced/build/simulation.h"

namespace mantle::tests {

/// A run of the robot's reduced model with 8 segments an arm, in steps of 10 ms.
inline model::RunResult EightSegmentRun(const model::Robot& robot, double duration_s) {
  reduced::Reduction reduction;
  reduction.arms[0].segments = 8;
  const reduced::ReducedPlant model(robot, reduction);
  reduced::ReducedRunSettings settings;
  settings.duration_s = duration_s;
  settings.step_s = 0.01;
  const model::RunResult result = reduced::ReducedSimulation(model, settings).Run();
  EXPECT_TRUE(result.ok) << result.reason;
  return result;
}

}  // namespace mantle::tests
