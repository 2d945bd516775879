#pragma once

#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "controller/options.h"
#include "model/simulation.h"
#include "reduced/reduction.h"
#include "tests/support/paper_robot.h"

/// Robots and motors of the closed loop's tests.

namespace mantle::tests {

inline reduced::Actuator CableMotor(const std::string& name, int cable) {
  return {name, {{reduced::ActuatorTarget::Kind::kCable, cable, 1.0}}};
}

/// The paper's arm with four cables 90 degrees apart ([physics.md] 2).
inline model::Arm CabledArm(int elements) {
  model::Arm arm = PaperArm(elements);
  for (int k = 0; k < 4; ++k) {
    arm.cables.push_back({"cable" + std::to_string(k + 1), 0.6, k * 0.5 * std::numbers::pi, 0.0,
                          arm.length_m, model::GivenTension{model::ConstantSchedule{0.0}}});
  }
  return arm;
}

/// Mantle with eight spokes, cone and one arm, free in water, with the effects that steering needs
/// ([physics.md] 3 and 9): cables 0 to 3 bend the arm, cable 4 squeezes the mantle.
inline model::Robot SwimmingRobot(int arm_elements = 20, int mantle_elements = 32) {
  model::Robot robot = PaperRobot(arm_elements, mantle_elements);
  robot.arms = {CabledArm(arm_elements)};
  robot.mantle->spokes = {
      {"squeeze", 0.025, 0.105, 8, model::GivenTension{model::ConstantSchedule{0.0}}}};
  robot.effects = EveryEffect();
  robot.effects.jet_thrust->flux = model::FluxReading::kRadial;
  robot.effects.jet_thrust->place = model::ThrustPlace::kDome;
  return robot;
}

inline std::vector<reduced::Actuator> FiveMotors() {
  std::vector<reduced::Actuator> motors;
  for (int k = 0; k < 4; ++k) motors.push_back(CableMotor("arm" + std::to_string(k + 1), k));
  motors.push_back(CableMotor("mantle", 4));
  return motors;
}

/// The paper's arm alone, clamped, in water.
inline model::Robot ClampedArm(int elements = 20) {
  model::Robot robot;
  robot.name = "arm";
  robot.root = model::ClampedRoot{};
  robot.arms = {CabledArm(elements)};
  robot.effects.drag = robot.effects.added_mass = robot.effects.viscosity = true;
  return robot;
}

inline model::RunSettings LoopRun() {
  model::RunSettings run;
  run.duration_s = 1e9;  // the vehicle says how far
  run.step_s = 0.01;
  return run;
}

/// A triangle between zero and `peak`, at zero at t = 0.
inline double Triangle(double t_s, double period_s, double peak) {
  const double phase = std::fmod(t_s, period_s) / period_s;
  return peak * (1.0 - std::abs(2.0 * phase - 1.0));
}

}  // namespace mantle::tests
