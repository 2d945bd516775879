// An arm with one motor, held: its drive announces itself on the bus.
#include "loop/plant_side/plant_side.h"

#include "firmware_sim/bus/loop_bus.h"

int main() {
  using namespace mantle;
  model::Arm arm;
  arm.name = "arm";
  arm.elements = 4;
  arm.length_m = 0.42;
  arm.radius_base_m = 0.015;
  arm.radius_tip_m = 0.006;
  arm.material = {.young_pa = 110e3, .poisson = 0, .viscosity_pa_s = 300, .density_kg_m3 = 1022};
  arm.cables.push_back(
      {"cable", 0.6, 0.0, 0.0, arm.length_m, model::GivenTension{model::ConstantSchedule{0.0}}});
  model::Robot robot;
  robot.name = "arm";
  robot.root = model::ClampedRoot{};
  robot.arms = {arm};
  const model::Plant plant(robot);
  firmware_sim::LoopMedium medium;
  const auto drives = medium.MakeStation(), other = medium.MakeStation();
  loop::PlantSide side(plant, {}, {{"motor", {{reduced::ActuatorTarget::Kind::kCable, 0, 1.0}}}},
                       {}, *drives);
  side.Hold(100'000);
  side.Pump(100'000);
  firmware_sim::CanFrame frame;
  return other->Receive({&frame, 1}) == 1 && frame.id == 0x701 ? 0 : 1;
}
