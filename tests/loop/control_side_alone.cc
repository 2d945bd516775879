// A program with the control side alone, as one that drives a vehicle would be: it links no other
// part of the loop and no plant (control_side_link_test.sh looks at what came into it), believes in
// a model of constants of its own, and turns sensor messages into a command for every motor. Exit
// status 0 where it does.

#include <cstdio>

#include "firmware_sim/bus/loop_bus.h"
#include "loop/control_side/control_side.h"

namespace {

// A rigid body with two motors that move nothing.
class RigidBody : public mantle::reduced::ReducedModel {
 public:
  RigidBody() {
    using Kind = mantle::reduced::ActuatorTarget::Kind;
    robot.name = "body";
    rigid_inertia.setIdentity();
    body_length_m = 0.3;
    cable_rest_m = {0.1, 0.1};
    actuators = {{"a", {{Kind::kCable, 0, 1.0}}}, {"b", {{Kind::kCable, 1, 2.0}}}};
    start.q.setZero(0);
    start.v.setZero(6);
  }
};

}  // namespace

int main() {
  using namespace mantle;
  const RigidBody model;
  controller::ControlOptions control;
  control.controller = ToString(controller::ControllerKind::kGait);
  control.goal = controller::CruiseTask{};
  control.estimator.disturbance = false;
  control.motors.assign(2, {});
  control.gait.motors.assign(2, {.low_n = 0.3, .high_n = 0.3});
  firmware_sim::LoopMedium medium;
  const auto station = medium.MakeStation();
  loop::ControlSide side(
      {.model = model, .step = {}, .control = control, .sensors = {}, .drives = {}}, *station);
  loop::Sensors message;
  message.has_state = true;
  message.state = InitialState(model);
  message.cables.resize(2);
  for (int k = 0; k < 50; ++k) {
    message.time_s = message.state.time_s = 0.01 * k;
    side.Turn(message);
    side.PrepareNext();
  }
  // No drive answers, so that every motor counts as lost: none is told to pull.
  for (const loop::MotorCommand& torque : side.torques()) {
    if (torque.torque_permille > 0) {
      std::fprintf(stderr, "torque %d, must not be above 0\n", torque.torque_permille);
      return 1;
    }
  }
  if (side.health().lost_count() != 2 || side.torques().size() != 2) {
    std::fprintf(stderr, "%d of %zu motors lost, must be 2 of 2\n", side.health().lost_count(),
                 side.torques().size());
    return 1;
  }
  return 0;
}
