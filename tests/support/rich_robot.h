#pragma once

#include "model/robot.h"

/// Everything an arm may carry beyond cables and dead loads, for derivative and equivalence tests:
/// pieces of every outline, coupled strains, muscles, payloads, loads told apart by source, and a
/// current that changes in time.

namespace mantle::tests {

/// Symmetric, positive definite, every strain coupled to every other.
inline model::Matrix6 CoupledStiffness() {
  model::Vector6 d;
  d << 2e-3, 3e-3, 4e-3, 60, 20, 25;
  model::Matrix6 s = d.asDiagonal();
  for (int i = 0; i < 6; ++i) {
    for (int k = 0; k < 6; ++k) {
      if (i != k) s(i, k) = 0.08 * std::sqrt(d(i) * d(k)) * ((i + k) % 2 == 0 ? 1.0 : -0.7);
    }
  }
  return s;
}

/// Three pieces on half, a quarter and a quarter of the arm: nodes exist where they meet if the
/// number of elements is a multiple of four.
inline void AddPieces(model::Arm* arm) {
  model::ArmPiece hollow;
  hollow.length_m = 0.5 * arm->length_m;
  hollow.outline = model::RoundOutline{{0.015, 0.012}, {0.006, 0.005}};
  hollow.material = arm->material;
  model::ArmPiece strip = hollow;
  strip.length_m = 0.25 * arm->length_m;
  strip.outline = model::RectangularOutline{{0.02, 0.016}, {0.012, 0.01}};
  strip.material.density_kg_m3 = 1300;
  model::ArmPiece coupled = strip;
  coupled.outline = model::RoundOutline{{0.01, 0.008}, {}};
  coupled.stiffness = CoupledStiffness();
  arm->pieces = {hollow, strip, coupled};
}

inline model::MuscleWave Wave(const std::string& name, const model::Vector3& axis) {
  model::MuscleWave wave;
  wave.name = name;
  wave.axis = axis.normalized();
  wave.amplitude_n_m = model::ConstantSchedule{2e-3};
  wave.wave_length_m = model::ConstantSchedule{0.3};
  wave.frequency_hz = model::ConstantSchedule{1.0};
  wave.phase_rad = 0.7;
  return wave;
}

/// Payloads half-way and at the tip.
inline void AddPayloads(model::Arm* arm) {
  model::Payload middle;
  middle.name = "middle";
  middle.at_m = 0.5 * arm->length_m;
  middle.offset_m = {0.004, 0.01, -0.006};
  middle.mass_kg = 0.05;
  middle.inertia_kg_m2 << 3e-6, 4e-7, -2e-7, 4e-7, 4e-6, 1e-7, -2e-7, 1e-7, 5e-6;
  middle.volume_m3 = 2e-5;
  model::Payload tip = middle;
  tip.name = "tip";
  tip.at_m = arm->length_m;
  tip.mass_kg = 0.02;
  arm->payloads = {middle, tip};
}

inline void AddRichness(model::Robot* robot) {
  model::Arm& arm = robot->arms[0];
  AddPieces(&arm);
  for (model::ArmCable& c : arm.cables) {
    c.path = {{0.0, 0.004, -0.002}, {arm.length_m, -0.003, 0.003}};
  }
  AddPayloads(&arm);
  arm.muscles = {Wave("bend", {0, 0, 1}), Wave("mixed", {0.5, 1, 0.2})};
  arm.muscles[1].envelope = {{0.05, model::ConstantSchedule{0.2}},
                             {0.3, model::ConstantSchedule{1.5}}};
  model::DistributedWrench inside;  // dead, of an actuator
  inside.name = "inside";
  inside.direction << 0.02, -0.01, 0.03, 0.1, 0.2, -0.1;
  inside.frame = model::LoadFrame::kWorld;
  inside.internal = true;
  inside.schedule = model::ConstantSchedule{1};
  model::DistributedWrench outside = inside;  // follows the section, of the world
  outside.name = "outside";
  outside.frame = model::LoadFrame::kBody;
  outside.internal = false;
  arm.distributed.push_back(inside);
  arm.distributed.push_back(outside);
  robot->effects.unsteady_current = model::UnsteadyCurrent{
      model::SineSchedule{0.2, 0.5, 0.3, 0.0, 0.0}, model::SineSchedule{0.1, 0.8, 1.0, 0.1, 0.0},
      model::TableSchedule{{0.0, 10.0}, {0.0, -3.0}}};
}

}  // namespace mantle::tests
