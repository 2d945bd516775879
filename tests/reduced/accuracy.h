#pragma once

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <vector>

#include "model/statics.h"
#include "reduced/build/simulation.h"
#include "tests/reduced/reduced_robots.h"

/// Errors of the reduced model against the plant on a fine mesh, at the same effects: what the
/// tables of docs/reduced.md print and accuracy_test.cc bounds.

namespace mantle::tests {

// Meshes of the plant: its own error is then below 0.02 % of L and 0.02 % of the volume.
inline constexpr int kFineArm = 96, kFineMantle = 128;
inline constexpr double kFineStep_s = 0.005;       // of the plant
inline constexpr double kOutputInterval_s = 0.05;  // a multiple of every step, which ends there

/// The paper's arm in water, clamped.
inline model::Robot ArmAlone() {
  model::Robot robot;
  robot.name = "arm";
  robot.root = model::ClampedRoot{};
  robot.arms = {PaperArm(kFineArm)};
  robot.arms[0].mount = model::Pose::Identity();
  robot.effects.drag = robot.effects.added_mass = robot.effects.viscosity = true;
  return robot;
}

/// One cable at 0.6 h(X) to the tip.
inline model::Robot ArmWithCable(double tension_n) {
  model::Robot robot = ArmAlone();
  AddFourCables(&robot.arms[0]);
  robot.arms[0].cables.resize(1);
  robot.arms[0].cables[0].drive = model::GivenTension{model::ConstantSchedule{tension_n}};
  return robot;
}

/// The paper's torque (erratum 14), on for 1.5 s.
inline model::Robot ArmWithTorque() {
  model::Robot robot = ArmAlone();
  model::DistributedWrench torque;
  torque.name = "torque";
  torque.direction << 0, 0, 0.05, 0, 0, 0;
  torque.tip = 0;
  torque.schedule = model::IntervalSchedule{1.0, {0.0}, {1.5}};
  robot.arms[0].distributed = {torque};
  return robot;
}

/// The paper's mantle in water, clamped, without its jet.
inline model::Robot MantleAlone(model::Schedule pressure) {
  model::Robot robot;
  robot.name = "mantle";
  robot.root = model::ClampedRoot{};
  robot.mantle = PaperMantle(kFineMantle, 4);
  robot.mantle->strips = {PaperStrip(std::move(pressure))};
  robot.effects.added_mass = robot.effects.viscosity = robot.effects.drag = true;
  return robot;
}

/// Equilibrium under the loads at t = 0, by backward Euler steps so long that only statics is left.
/// Throws std::runtime_error where it does not settle.
inline reduced::ReducedState Settle(const reduced::ReducedPlant& m) {
  constexpr int kSteps = 400;
  constexpr double kLongest_s = 100.0, kStill = 1e-9;  // rates, in 1/s of each coordinate's unit
  reduced::StepSettings settings;
  settings.scheme = reduced::StepScheme::kBackwardEuler;
  settings.max_iterations = 100;
  reduced::StepWork work(m);
  reduced::ReducedState s = InitialState(m), next = s;
  model::PlantInputs inputs;
  EvaluateInputs(m.plant, 0.0, false, &inputs);
  double h = 0.01;
  for (int i = 0; i < kSteps; ++i) {
    if (!TakeStep(m, settings, h, s, inputs, inputs, &work, &next, nullptr).ok) {
      h *= 0.5;
      continue;
    }
    s = next;
    if (h == kLongest_s && s.v.cwiseAbs().maxCoeff() < kStill) return s;
    h = std::min(2.0 * h, kLongest_s);
  }
  throw std::runtime_error("the reduced model does not settle");
}

inline model::PlantState Lifted(const reduced::ReducedPlant& m, const reduced::ReducedState& s) {
  reduced::Projection projection(m);
  model::PlantState lifted = InitialState(m.plant);
  projection.Lift(s, &lifted);
  return lifted;
}

inline model::PlantState FullEquilibrium(const model::Robot& robot) {
  model::StaticsSettings settings;
  settings.load_steps = 20;
  const model::StaticsResult result = SolveStatics(model::Plant(robot), settings);
  if (!result.ok) throw std::runtime_error("plant: " + result.reason);
  return result.state;
}

/// Of the tip, relative to the arm's length.
inline double StaticTipError(const model::Robot& robot, const reduced::Reduction& reduction,
                             const model::PlantState& full) {
  const reduced::ReducedPlant m(robot, reduction);
  return (Lifted(m, Settle(m)).pose.back().position - full.pose.back().position).norm() /
         robot.arms[0].length_m;
}

/// Of the enclosed volume, relative to its change.
inline double StaticVolumeError(const model::Robot& robot, const reduced::Reduction& reduction,
                                const model::PlantState& full) {
  const reduced::ReducedPlant m(robot, reduction);
  const double volume = model::ShellVolume(full.shape);
  return std::abs(model::ShellVolume(Lifted(m, Settle(m)).shape) - volume) /
         std::abs(volume - m.plant.shell->rest_volume_m3);
}

/// Throws std::runtime_error where the plant's run ends early.
inline std::vector<model::Sample> FullRun(const model::Robot& robot, double duration_s) {
  const model::Plant plant(robot);
  model::RunSettings settings;
  settings.duration_s = duration_s;
  settings.step_s = kFineStep_s;
  settings.output_interval_s = kOutputInterval_s;
  settings.account_energy = false;
  model::Simulation simulation(plant, settings);
  std::vector<model::Sample> out;
  const model::RunResult result = simulation.Run([&](const model::Sample& s) {
    out.push_back(s);
    return true;
  });
  if (!result.ok) throw std::runtime_error("plant: " + result.reason);
  return out;
}

/// Largest over the samples; NaN where the reduced model could not go on.
struct RunErrors {
  double root{0};     ///< of its path, relative to the body length
  double heading{0};  ///< [rad], between the directions e3
  double tip{0};      ///< relative to the arm's length
  double volume{0};   ///< relative to the largest change of the plant's
};
inline RunErrors ErrorsOfRun(const model::Robot& robot, const reduced::Reduction& reduction,
                             double step_s, const std::vector<model::Sample>& full) {
  const reduced::ReducedPlant m(robot, reduction);
  reduced::ReducedRunSettings settings;
  settings.duration_s = full.back().time_s;
  settings.step_s = step_s;
  settings.output_interval_s = kOutputInterval_s;
  reduced::ReducedSimulation simulation(m, settings);
  double change = 0;
  for (const auto& s : full) change = std::max(change, std::abs(s.volume_m3 - full[0].volume_m3));
  RunErrors e;
  std::size_t i = 0;
  const model::RunResult result = simulation.Run([&](const model::Sample& s) {
    const model::Sample& f = full.at(i++);
    const auto largest = [](double* value, double x) { *value = std::max(*value, x); };
    largest(&e.root, (s.root.position - f.root.position).norm() / m.plant.body_length_m);
    const model::Vector3 e3 = model::Vector3::UnitZ();
    const model::Vector3 a = s.root.rotation * e3, b = f.root.rotation * e3;
    largest(&e.heading, std::atan2(a.cross(b).norm(), a.dot(b)));
    for (std::size_t k = 0; k < s.tips.size(); ++k) {
      largest(&e.tip, (s.tips[k].position - f.tips[k].position).norm() / robot.arms[k].length_m);
    }
    if (change > 0) largest(&e.volume, std::abs(s.volume_m3 - f.volume_m3) / change);
    return true;
  });
  if (!result.ok || i != full.size()) {
    const double nan = std::nan("");
    return {nan, nan, nan, nan};
  }
  return e;
}

}  // namespace mantle::tests
