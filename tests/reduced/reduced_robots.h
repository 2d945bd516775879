#pragma once

#include "reduced/build/reduced_plant.h"
#include "tests/support/paper_robot.h"
#include "tests/support/random_values.h"

/// Robots, reductions and random states shared by the tests of the reduced model.

namespace mantle::tests {

inline model::StripPressure PaperStrip(model::Schedule pressure) {
  return {"muscle", 0.025, 0.105, std::move(pressure)};
}

/// Four cables 90 degrees apart at 0.6 h(X) to the tip, slack.
inline void AddFourCables(model::Arm* arm) {
  const char* names[] = {"left", "up", "right", "down"};
  for (int i = 0; i < 4; ++i) {
    model::ArmCable cable;
    cable.name = names[i];
    cable.angle_rad = i * std::numbers::pi / 2;
    cable.end_m = arm->length_m;
    cable.drive = model::GivenTension{};
    arm->cables.push_back(cable);
  }
}

/// Mantle, cone and one arm with cables and strip; every effect on.
inline model::Robot ControlRobot(int arm_elements = 20, int mantle_elements = 48) {
  model::Robot robot = PaperRobot(arm_elements, mantle_elements);
  robot.mantle->strips = {PaperStrip(model::ConstantSchedule{0.0})};
  AddFourCables(&robot.arms[0]);
  model::DistributedWrench torque;
  torque.name = "torque";
  torque.direction << 0, 0, 0.05, 0, 0, 0;
  torque.tip = 0;
  model::DistributedWrench pull = torque;  // dead: external
  pull.name = "pull";
  pull.direction << 0.01, 0, 0, 0, 0.1, 0;
  pull.frame = model::LoadFrame::kWorld;
  robot.arms[0].distributed = {torque, pull};
  robot.effects = EveryEffect();
  robot.rigid_body = model::RigidBody{"cone", model::Cone{0.015, 0.112, 1300.0}};
  robot.arms[0].material.density_kg_m3 = 1100;
  robot.mantle->material.density_kg_m3 = 980;
  return robot;
}

inline reduced::Reduction EquivalentReduction(const model::Robot& robot) {
  reduced::Reduction r;
  r.arms.clear();
  for (const model::Arm& arm : robot.arms) {
    reduced::ArmReduction a;
    a.segments = arm.elements;
    a.strains = reduced::kSixStrains;
    a.rule = reduced::SectionRule::kPlantNodes;
    r.arms.push_back(a);
  }
  r.mantle.cubature_tolerance = 0;
  r.mantle.lateral_slices = 0;
  return r;
}

/// A state in the reduced space: strains of about `size` rad per 0.42 m, mantle within its scale.
inline reduced::ReducedState RandomReducedState(const reduced::ReducedPlant& model, double size,
                                                unsigned seed) {
  RandomValues random(seed);
  reduced::ReducedState s = InitialState(model);
  if (model.plant.root_free()) {
    s.root = random.AnyPose(0.3);
    s.v.head<6>() = size * random.Twist(1.0, 0.3);
  }
  for (int a = 0; a < static_cast<int>(model.arms.size()); ++a) {
    const auto& arm = model.arms[a];
    reduced::Matrix6X b;
    for (std::size_t g = 0; g < arm.basis.groups().size(); ++g) {
      const reduced::StrainGroup& group = arm.basis.groups()[g];
      arm.basis.Evaluate(static_cast<int>(g), group.to_m, &b);
      for (int i = 0; i < group.columns; ++i) {
        int component = 0;
        b.col(i).cwiseAbs().maxCoeff(&component);
        const double scale = component < 3 ? size / 0.42 : 0.03 * size;
        s.q(model.arm_first(a) + group.first + i) = scale * random.Uniform();
        s.v(6 + model.arm_first(a) + group.first + i) = 3.0 * scale * random.Uniform();
      }
    }
  }
  if (model.mantle) {
    for (int i = 0; i < model.mantle->size; ++i) {
      const double scale = size * model.mantle->basis.scale(i);
      s.q(model.mantle_first() + i) = 0.3 * scale * random.Uniform();
      s.v(6 + model.mantle_first() + i) = 5.0 * scale * random.Uniform();
    }
  }
  return s;
}

inline model::VectorX RandomVector(int n, unsigned seed) {
  RandomValues random(seed);
  model::VectorX v(n);
  for (int i = 0; i < n; ++i) v(i) = random.Uniform();
  return v;
}

}  // namespace mantle::tests
