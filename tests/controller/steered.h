#pragma once

#include <memory>
#include <vector>

#include "controller/controller.h"
#include "reduced/build/reduced_plant.h"
#include "tests/loop/vehicles.h"

/// What the tests of the steering controllers steer: the swimming vehicle along a path, at cruise,
/// and the clamped arm whose tip goes round.

namespace mantle::tests {

inline reduced::Reduction SteeredReduction(const std::vector<reduced::Actuator>& motors) {
  reduced::Reduction r;
  r.arms[0].segments = 3;
  r.arms[0].points = 2;
  r.actuators = motors;
  r.scheme = reduced::StepScheme::kBackwardEuler;
  return r;
}

inline controller::ControlOptions SteeredOptions(const controller::ControlGoal& goal, int motors) {
  controller::ControlOptions o;
  o.goal = goal;
  o.period_s = 0.1;
  o.motors.assign(motors, {0.0, 0.8, 2.0, false});
  o.cost.position = 100;
  o.cost.heading = 0.2;
  o.cost.turn_rate = 0.02;
  o.cost.tip = 1000;
  o.cost.effort = 0.05;
  o.cost.rate = 0.02;
  o.gait.period_s = 0.8;
  o.gait.motors.assign(motors, {0.0, 0.0, 0.5, 0.0, 0.5, 0.0});
  return o;
}

/// A model, its options and its reference, at addresses that stay.
struct Steered {
  Steered(const model::Robot& robot, const std::vector<reduced::Actuator>& motors,
          const controller::ControlGoal& goal)
      : model(robot, SteeredReduction(motors)),
        options(SteeredOptions(goal, static_cast<int>(motors.size()))),
        reference(goal, robot) {}
  controller::ControllerParts parts() const { return {model, step, options, reference}; }

  reduced::ReducedPlant model;
  reduced::StepSettings step{reduced::StepScheme::kBackwardEuler, 1e-8};
  controller::ControlOptions options;
  controller::Reference reference;
};

inline std::vector<reduced::Actuator> FourMotors() {
  std::vector<reduced::Actuator> motors = FiveMotors();
  motors.pop_back();
  return motors;
}

inline constexpr double kSpeed_m_s = 0.06;

/// Motors 0 to 3 pull the arm's cables, motor 4 pulses the mantle.
inline std::unique_ptr<Steered> SteeredVehicle(const controller::ControlGoal& goal) {
  auto s = std::make_unique<Steered>(SwimmingRobot(12, 32), FiveMotors(), goal);
  s->options.gait.motors[4] = {0.0, 0.5, 0.4, 0.0, 0.4, 0.0};
  return s;
}
inline controller::PathTask StraightPath() {
  return {{model::Vector3(0, 0, 1), model::Vector3(0, 0, 2)}, kSpeed_m_s, 2.0, 0.0266};
}

/// The circle's gait pulls the cables in turn.
inline std::unique_ptr<Steered> SteeredTip() {
  auto s = std::make_unique<Steered>(ClampedArm(12), FourMotors(),
                                     controller::CircleTask{0, 0.1, 0.4, 4.0, 2.0});
  s->options.gait.period_s = 4;
  for (int i = 0; i < 4; ++i) {
    s->options.gait.motors[i] = {0.0, 0.3, 0.25, 0.0, 0.25, 0.25 * i};
  }
  return s;
}

}  // namespace mantle::tests
