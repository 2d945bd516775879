#pragma once

#include <gtest/gtest.h>

#include "model/plant.h"
#include "tests/support/random_values.h"

/// Random states of a plant and evaluations at perturbed states, for derivative tests.

namespace mantle::tests {

/// The initial state moved by random increments and given random velocities. `size` scales both: at
/// 1 the arm bends by about a radian, the mantle's radius changes by a few per cent.
inline model::PlantState RandomState(const model::Plant& plant, double size, unsigned seed) {
  RandomValues random(seed);
  const model::PlantState initial = InitialState(plant);
  model::PlantState state = initial;
  model::VectorX theta = model::VectorX::Zero(plant.velocity_size());
  theta.head<6>() = size * random.Twist(0.5, 0.2);
  model::VectorX v = model::VectorX::Zero(plant.velocity_size());
  v.head<6>() = size * random.Twist(2.0, 0.3);
  if (!plant.root_free()) theta.head<6>().setZero();
  Retract(plant, initial, theta, &state);  // root and bases
  for (std::size_t k = 0; k < plant.rods.size(); ++k) {
    const int a = static_cast<int>(k);
    const model::Rod& rod = plant.rods[k];
    model::Vector6 bend = size * random.Twist(2.0, 0.03);
    for (int i = 1; i <= rod.element_count(); ++i) {
      const double l = rod.elements[i - 1].length;
      const model::Vector6 d =
          l * (rod.elements[i - 1].reference_strain + bend + size * random.Twist(0.5, 0.01));
      state.pose[plant.ArmPose(a, i)] = state.pose[plant.ArmPose(a, i - 1)] * model::ExpSE3(d);
      v.segment<6>(plant.ArmVelocity(a, i)) = size * random.Twist(3.0, 0.3);
    }
  }
  for (int j = 0; j < plant.shape_count(); ++j) {
    const model::ShellNode& node = plant.shell->nodes[j];
    const double x = node.x_m / plant.shell->nodes.back().x_m;
    model::Vector3 move(1e-3 * std::sin(5 * x), 2e-3 * std::sin(3 * x), 0.05 * std::cos(4 * x));
    move += model::Vector3(2e-5, 2e-5, 0.01).cwiseProduct(random.Cube());
    const model::Vector3 free = model::Vector3::Ones() - node.held;
    state.shape[j] += size * move.cwiseProduct(free);
    const model::Vector3 speed = model::Vector3(0.05, 0.05, 2.0).cwiseProduct(random.Cube());
    v.segment<3>(plant.ShellVelocity(j)) = size * speed.cwiseProduct(free);
  }
  state.velocity = v;
  model::PlantInputs inputs;
  EvaluateInputs(plant, state.time_s, false, &inputs);
  ImposeRoot(plant, inputs, &state);
  return state;
}

/// f at (state moved by theta, velocity + dv).
inline model::VectorX ForceAt(const model::Plant& plant, const model::PlantState& state,
                              const model::PlantInputs& inputs, const model::VectorX& theta,
                              const model::VectorX& dv, model::PlantWork* work) {
  model::PlantState moved = state;
  Retract(plant, state, theta, &moved);
  moved.velocity = state.velocity + dv;
  const auto failure = EvaluateForces(plant, moved, inputs, work);
  EXPECT_FALSE(failure) << failure.Message();
  return work->force;
}

}  // namespace mantle::tests
