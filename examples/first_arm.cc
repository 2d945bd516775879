// A clamped arm under its own weight in water, released: where is its tip after two seconds?
//
// Components: model
// Prints: ^tip at .* after 2\.0 s

#include <cstdio>

#include "model/simulation.h"

int main() {
  using namespace mantle::model;
  Arm arm;
  arm.name = "arm";
  arm.length_m = 0.42;
  arm.radius_base_m = 0.015;
  arm.radius_tip_m = 0.006;
  arm.material = {.young_pa = 110e3, .poisson = 0, .viscosity_pa_s = 300, .density_kg_m3 = 1100};
  arm.drag_coefficients = {0.01, 2.5, 2.5};
  arm.added_mass_coefficient = 1.5;

  Robot robot;
  robot.name = "first_arm";
  robot.root = ClampedRoot{};
  robot.arms = {arm};
  robot.effects.weight = robot.effects.buoyancy = true;
  robot.effects.drag = robot.effects.added_mass = robot.effects.viscosity = true;

  const Plant plant(robot);
  Simulation simulation(plant, {.duration_s = 2.0});
  const RunResult result = simulation.Run();
  const Vector3 tip = result.last.tips.front().position;
  std::printf("tip at %.4f %.4f %.4f m after %.1f s, %ld steps\n", tip.x(), tip.y(), tip.z(),
              result.sim_time_s, result.counters.steps);
  return result.ok ? 0 : 1;
}
