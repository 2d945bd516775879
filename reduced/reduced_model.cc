#include "reduced/reduced_model.h"

#include <fmt/format.h>

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

double* InputOf(const ActuatorTarget& target, model::PlantInputs* inputs) {
  switch (target.kind) {
    case Kind::kCable: {
      model::CableInput& cable = inputs->cables[target.index];
      return cable.reeled ? &cable.reel_m : &cable.tension_n;
    }
    case Kind::kDistributed:
      return &inputs->distributed[target.index];
    case Kind::kPoint:
      return &inputs->points[target.index];
    case Kind::kStrip:
      return &inputs->strips_pa[target.index];
    case Kind::kNormalPressure:
      return &inputs->normal_pressure_pa;
  }
  return nullptr;
}

}  // namespace

ReducedModel::ReducedModel(const model::Robot& robot, const Reduction& reduction)
    : plant(Checked(robot)) {
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
    coordinates_ += arms.back().size();
  }
  mantle_first_ = coordinates_;
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
}

ReducedState InitialState(const ReducedModel& model) {
  ReducedState s;
  s.q = VectorX::Zero(model.coordinate_count());
  s.v = VectorX::Zero(model.velocity_count());
  const model::PlantState full = InitialState(model.plant);
  s.root = full.pose[0];
  s.v.head<6>() = full.velocity.head<6>();
  return s;
}

std::string SizeComplaint(const ReducedModel& model, const ReducedState& state) {
  const auto complaint = [](const char* name, long have, int want) {
    return fmt::format("{} has {} entries, must be {}", name, have, want);
  };
  if (state.q.size() != model.coordinate_count()) {
    return complaint("q", state.q.size(), model.coordinate_count());
  }
  if (state.v.size() != model.velocity_count()) {
    return complaint("v", state.v.size(), model.velocity_count());
  }
  return {};
}

void ApplyControls(const ReducedModel& model, const double* u, model::PlantInputs* inputs) {
  for (const Actuator& actuator : model.actuators) {
    for (const ActuatorTarget& t : actuator.targets) {
      *InputOf(t, inputs) = 0.0;
      if (t.kind == Kind::kCable) inputs->cables[t.index].reel_rate_m_s = 0.0;
    }
  }
  for (const Actuator& actuator : model.actuators) {
    for (const ActuatorTarget& t : actuator.targets) *InputOf(t, inputs) += t.gain * *u;
    ++u;
  }
}

ReducedWork::ReducedWork(const ReducedModel& model)
    : residual(VectorX::Zero(model.velocity_count())) {
  for (const ReducedArm& arm : model.arms) arms.emplace_back(arm);
  if (model.mantle) mantle.emplace_back(*model.mantle);
}

ReducedJacobians::ReducedJacobians(const ReducedModel& model) {
  const int n = model.velocity_count();
  for (Eigen::MatrixXd* m : {&mass, &damping, &stiffness}) m->setZero(n, n);
  input.setZero(n, model.input_count());
}

}  // namespace mantle::reduced
