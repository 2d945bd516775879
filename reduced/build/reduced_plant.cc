#include "reduced/build/reduced_plant.h"

#include <fmt/format.h>

#include "reduced/build/arm.h"
#include "reduced/build/mantle.h"

namespace mantle::reduced {
namespace {

using model::BadRobot;
using Kind = ActuatorTarget::Kind;

model::Robot Checked(const model::Robot& robot) {
  if (robot.coupling != model::Coupling::kExact) {
    throw BadRobot("robot.coupling = \"frozen\": the reduced model has exact coupling only");
  }
  return robot;
}

int CountOf(const model::Plant& plant, Kind kind) {
  int distributed = 0, points = 0;
  for (const model::Rod& rod : plant.rods) {
    distributed += static_cast<int>(rod.distributed.size());
    points += static_cast<int>(rod.points.size());
  }
  switch (kind) {
    case Kind::kCable:
      return plant.cable_count();
    case Kind::kDistributed:
      return distributed;
    case Kind::kPoint:
      return points;
    case Kind::kStrip:
      return plant.shell ? static_cast<int>(plant.shell->strips.size()) : 0;
    case Kind::kNormalPressure:
      return plant.shell && plant.robot.effects.normal_pressure ? 1 : 0;
  }
  return 0;
}

std::vector<Actuator> DefaultActuators(const model::Plant& plant) {
  std::vector<Actuator> out;
  const auto add = [&](const std::string& name, Kind kind, int index) {
    out.push_back({name, {{kind, index, 1.0}}});
  };
  int cable = 0, distributed = 0, strip = 0;
  for (const model::Rod& rod : plant.rods) {
    for (const auto& c : rod.cables) add(rod.name + "." + c.name, Kind::kCable, cable++);
  }
  if (plant.shell) {
    for (const auto& s : plant.shell->spokes) {
      add(plant.shell->name + "." + s.strip.name, Kind::kCable, cable++);
    }
  }
  for (const model::Rod& rod : plant.rods) {
    for (const auto& d : rod.distributed) {
      add(rod.name + "." + d.name, Kind::kDistributed, distributed++);
    }
  }
  if (plant.shell) {
    for (const auto& s : plant.shell->strips) {
      add(plant.shell->name + "." + s.strip.name, Kind::kStrip, strip++);
    }
  }
  return out;
}

}  // namespace

ReducedPlant::ReducedPlant(const model::Robot& described, const Reduction& reduction)
    : plant(Checked(described)) {
  robot = plant.robot;
  cable_rest_m = plant.cable_rest_m;
  rigid_inertia = plant.rigid_inertia;
  root_loads = plant.root_loads;
  body_length_m = plant.body_length_m;
  const std::size_t count = plant.rods.size();
  if (count > 0 && reduction.arms.size() != 1 && reduction.arms.size() != count) {
    throw BadRobot(fmt::format("reduced.arms: {} entries, must be 1 or the number of arms, {}",
                               reduction.arms.size(), count));
  }
  for (std::size_t a = 0; a < count; ++a) {
    const ArmReduction& choice = reduction.arms[reduction.arms.size() == 1 ? 0 : a];
    try {
      arms.push_back(MakeReducedArm(plant, static_cast<int>(a), choice));
    } catch (const BadRobot& error) {
      throw BadRobot("reduced.arms." + plant.rods[a].name + "." + error.what());
    }
    arm_first_.push_back(coordinates_);
    cable_first_.push_back(plant.ArmCableIndex(static_cast<int>(a), 0));
    coordinates_ += arms.back().size();
  }
  mantle_first_ = coordinates_;
  spoke_first_ = plant.SpokeIndex(0);
  if (plant.shell) {
    try {
      mantle = std::make_unique<const ReducedMantle>(MakeReducedMantle(plant, reduction.mantle));
    } catch (const BadRobot& error) {
      throw BadRobot(std::string("reduced.") + error.what());
    }
    coordinates_ += mantle->size;
  }
  actuators = reduction.actuators.empty() ? DefaultActuators(plant) : reduction.actuators;
  for (const Actuator& actuator : actuators) {
    if (actuator.targets.empty()) {
      throw BadRobot("reduced.actuators." + actuator.name + ": drives nothing");
    }
    for (const ActuatorTarget& t : actuator.targets) {
      const int bound = CountOf(plant, t.kind);
      if (t.index < 0 || t.index >= bound) {
        throw BadRobot(fmt::format("reduced.actuators.{}: index = {}, must be in [0, {})",
                                   actuator.name, t.index, bound));
      }
    }
  }
  const model::PlantState full = model::InitialState(plant);
  start.root = full.pose[0];
  start.q = VectorX::Zero(coordinate_count());
  start.v = VectorX::Zero(velocity_count());
  start.v.head<6>() = full.velocity.head<6>();
}

}  // namespace mantle::reduced
