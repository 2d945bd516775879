#include "loop/scene/scene_schema.h"

#include "controller/options_schema.h"
#include "loop/options_schema.h"
#include "model/robot_schema.h"
#include "model/run_schema.h"
#include "reduced/reduction_schema.h"

namespace mantle::scene {
namespace {

using schema::Optional;
using schema::Visitor;

// The motors of a closed loop: those of [reduced], or one per cable.
void DemandMotors(Visitor& v, Scene* scene) {
  std::vector<reduced::Actuator>& motors = scene->reduction.actuators;
  if (motors.empty()) motors = reduced::CableActuators(scene->robot);
  v.Demand(!motors.empty(), "control", "there is no cable to pull: give arms or mantle cables");
  for (const reduced::Actuator& motor : motors) {
    for (const reduced::ActuatorTarget& target : motor.targets) {
      v.Demand(target.kind == reduced::ActuatorTarget::Kind::kCable, "control",
               "motor " + motor.name + " drives what is no cable");
    }
  }
}

}  // namespace

void Describe(Visitor& v, Scene& scene) {
  v.Name({.name = "name", .meaning = "stands in the outputs", .fallback = "file name"},
         &scene.name);
  v.Text({.name = "description", .meaning = "one line for people", .fallback = "empty"},
         &scene.description);
  std::string extends;
  v.Text(Optional({.name = "extends",
                   .meaning = "this scene is that one with its own tables merged over it, key by "
                              "key; arrays are replaced whole",
                   .bound = "a file beside this one"}),
         &extends);
  scene.robot.name = scene.name;
  Describe(v, scene.robot);
  scene.has_time = v.Table(
      Optional({.name = "time", .meaning = "a run in time", .also = "needed by `mantle run`"}),
      [&](Visitor& t) { model::DescribeTime(t, scene.run); });
  v.Table({"output", "what a run writes"},
          [&](Visitor& t) { model::DescribeOutput(t, scene.run); });
  scene.has_statics =
      v.Object(Optional({"statics", "an equilibrium, for `mantle static`"}), &scene.statics);
  v.Table({"reduced", "the reduced model"},
          [&](Visitor& t) { Describe(t, scene.robot, scene.reduction); });
  if (v.Has("control")) DemandMotors(v, &scene);
  controller::ControlOptions control;
  if (v.Table(Optional({.name = "control", .meaning = "a closed loop", .also = "cables to pull"}),
              [&](Visitor& t) { Describe(t, scene.robot, scene.reduction.actuators, control); })) {
    scene.control = control;
  }
  v.Object({"drives", "CANopen drives and cables of a closed loop"}, &scene.drives);
  v.Object({"sensors", "standard deviations of white noise on what is measured; none by default"},
           &scene.sensors);
  v.Object({"mismatch", "factors on a closed loop's plant that the controller does not know"},
           &scene.mismatch);
  v.Demand(scene.control || scene.mismatch.none(), "mismatch",
           "acts in a closed loop alone: give [control], or leave it out");
}

Catalogue SceneCatalogue() {
  return MakeCatalogue([](schema::Visitor& v) {
    Scene scene;
    Describe(v, scene);
  });
}

}  // namespace mantle::scene
