#pragma once

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "loop/scene/scene.h"
#include "model/simulation.h"
#include "tests/support/paths.h"

/// A shipped scene with its plant, for tests of what a run tells of its bodies.

namespace mantle::testing_tools {

/// `name` as in scenes/NAME.toml.
struct SceneRobot {
  explicit SceneRobot(const std::string& name, const std::vector<std::string>& overrides = {})
      : scene(scene::LoadScene(tests::SourcePath("scenes/" + name + ".toml"), overrides)),
        plant(scene.robot) {}
  scene::Scene scene;
  model::Plant plant;
};

/// A state that is bent, stretched and moving, of the robot as it is driven until t_s.
inline model::PlantState Moved(const SceneRobot& robot, double t_s) {
  model::Simulation simulation(robot.plant, robot.scene.run);
  EXPECT_TRUE(simulation.AdvanceTo(t_s).ok);
  return simulation.state();
}

}  // namespace mantle::testing_tools
