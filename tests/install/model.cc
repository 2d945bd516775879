// A hanging arm, released, falls for a moment.
#include "model/simulation.h"

int main() {
  using namespace mantle::model;
  Arm arm;
  arm.name = "arm";
  arm.length_m = 0.4;
  arm.radius_base_m = arm.radius_tip_m = 0.01;
  arm.material = {.young_pa = 1e5, .poisson = 0, .viscosity_pa_s = 100, .density_kg_m3 = 1100};
  Robot robot;
  robot.root = ClampedRoot{};
  robot.arms = {arm};
  robot.effects.weight = true;
  const Plant plant(robot);
  Simulation simulation(plant, {.duration_s = 0.1});
  return simulation.Run().ok ? 0 : 1;
}
