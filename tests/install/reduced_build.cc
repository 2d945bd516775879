// The reduced model of a free arm, at rest, stays finite over a step.
#include "reduced/build/simulation.h"

int main() {
  using namespace mantle;
  model::Arm arm;
  arm.name = "arm";
  arm.length_m = 0.4;
  arm.radius_base_m = arm.radius_tip_m = 0.01;
  arm.material = {.young_pa = 1e5, .poisson = 0, .viscosity_pa_s = 100, .density_kg_m3 = 1100};
  model::Robot robot;
  robot.root = model::ClampedRoot{};
  robot.arms = {arm};
  robot.effects.weight = true;
  const reduced::ReducedPlant model(robot, {});
  reduced::ReducedSimulation simulation(model, {.duration_s = 0.1});
  return simulation.Run().ok && simulation.state().q.allFinite() ? 0 : 1;
}
