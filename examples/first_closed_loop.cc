// A closed loop without a scene file: an arm in water whose tip goes round in a circle, pulled by
// four cables on simulated CANopen drives, by the predictive controller.
//
// Components: loop ipopt
// Prints: ^tip [0-9.]+ mm off on average after the approach, [0-9]+ plans, [0-9]+ CAN frames

#include <cstdio>
#include <numbers>
#include <string>

#include "loop/closed_loop.h"

using namespace mantle;

model::Robot CabledArm() {
  model::Arm arm;
  arm.name = "arm";
  arm.length_m = 0.42;
  arm.radius_base_m = 0.015;
  arm.radius_tip_m = 0.006;
  arm.material = {.young_pa = 110e3, .poisson = 0, .viscosity_pa_s = 300, .density_kg_m3 = 1022};
  arm.drag_coefficients = {0.01, 2.5, 2.5};
  arm.added_mass_coefficient = 1.5;
  for (int k = 0; k < 4; ++k) {  // at 0.6 of the radius, along the whole arm
    arm.cables.push_back({"cable" + std::to_string(k), 0.6, k * 0.5 * std::numbers::pi, 0.0,
                          arm.length_m, model::GivenTension{model::ConstantSchedule{0.0}}});
  }
  model::Robot robot;
  robot.name = "arm";
  robot.root = model::ClampedRoot{};
  robot.arms = {arm};
  robot.effects.weight = robot.effects.buoyancy = true;
  robot.effects.drag = robot.effects.added_mass = robot.effects.viscosity = true;
  return robot;
}

// One motor for each cable.
reduced::Reduction FourSegments() {
  reduced::Reduction reduction;
  reduction.arms[0].segments = 4;
  reduction.arms[0].points = 2;
  for (int k = 0; k < 4; ++k) {
    reduction.actuators.push_back(
        {"motor" + std::to_string(k), {{reduced::ActuatorTarget::Kind::kCable, k, 1.0}}});
  }
  return reduction;
}

controller::ControlOptions RoundAndRound() {
  controller::ControlOptions control;
  control.goal =
      controller::CircleTask{.radius_m = 0.105, .height_m = 0.355, .period_s = 4, .approach_s = 2};
  control.period_s = 0.05;
  control.grid = {.steps = 16, .step_s = 0.05, .knots = {1, 2, 3, 4, 6, 8, 11, 16}};
  control.motors.assign(4, {.min_tension_n = 0.02, .max_tension_n = 1.0, .max_rate_n_s = 4.0});
  control.cost.tip = 2000;
  control.cost.effort = 0.05;
  control.cost.rate = 0.01;
  control.gait.motors.assign(4, {.low_n = 0.02, .high_n = 0.02});
  return control;
}

int main() {
  scene::Scene scene;
  scene.name = "first_closed_loop";
  scene.robot = CabledArm();
  scene.reduction = FourSegments();
  scene.control = RoundAndRound();
  scene.has_time = true;
  scene.run.duration_s = 4;
  try {
    loop::ClosedLoop loop(scene);
    const loop::LoopResult result = loop.Run();
    if (!result.ok) return std::fprintf(stderr, "%s\n", result.reason.c_str()), 3;
    std::printf("tip %.1f mm off on average after the approach, %llu plans, %llu CAN frames\n",
                1e3 * result.mean_error, static_cast<unsigned long long>(result.counters.solves),
                static_cast<unsigned long long>(result.traffic.frames));
    return 0;
  } catch (const std::exception& error) {
    return std::fprintf(stderr, "%s\n", error.what()), 2;
  }
}
