// A program with the control side alone, as one that drives a vehicle would be: it links no other
// part of the loop (control_side_link_test.sh looks at what came into it), and turns a sensor
// message into a torque for every motor. Exit status 0 where it does.

#include <cstdio>

#include "firmware_sim/bus/loop_bus.h"
#include "loop/control_side/control_side.h"
#include "tests/loop/vehicles.h"

int main() {
  using namespace mantle;
  const model::Robot robot = tests::ClampedArm(8);
  reduced::Reduction reduction;
  reduction.arms[0].segments = 2;
  reduction.actuators = {tests::CableMotor("a", 0), tests::CableMotor("b", 2)};
  const reduced::ReducedModel model(robot, reduction);
  controller::ControlOptions control;
  control.controller = ToString(controller::ControllerKind::kGait);
  control.goal = controller::CircleTask{};
  control.motors.assign(2, {});
  control.gait.motors.assign(2, {.low_n = 0.3, .high_n = 0.3});
  firmware_sim::LoopMedium medium;
  const auto station = medium.MakeStation();
  loop::ControlSide side({.model = model, .robot = robot, .control = control}, *station);
  loop::Sensors message;
  message.has_state = true;
  message.state = InitialState(model);
  message.cables.resize(2);
  for (int k = 0; k < 50; ++k) {
    message.time_s = message.state.time_s = 0.01 * k;
    side.Turn(message);
    side.PrepareNext();
  }
  // Without drives nothing reels in; the torque loops ask for more and more of it.
  for (const loop::MotorCommand& torque : side.torques()) {
    if (torque.torque_permille <= 0) {
      std::fprintf(stderr, "torque %d, must be above 0\n", torque.torque_permille);
      return 1;
    }
  }
  return 0;
}
