#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "model/simulation.h"
#include "model/statics.h"

/// Robots of the literature's cases and short-hands to run them.

namespace mantle::tests {

/// A uniform clamped rod along +x of the world with given stiffness (GI, EI, EI, EA, GA, GA); its
/// radius matters to nothing else.
inline model::Robot ClampedRod(double length, const model::Vector6& stiffness, int elements) {
  model::Robot robot;
  robot.name = "rod";
  robot.root = model::ClampedRoot{};
  model::Arm arm;
  arm.name = "rod";
  arm.length_m = length;
  arm.radius_base_m = arm.radius_tip_m = 0.01 * length;
  arm.material = {1.0, 0.0, 0.0, 1.0};
  arm.stiffness = stiffness;
  arm.elements = elements;
  robot.arms = {arm};
  return robot;
}

inline model::PointWrench TipLoad(const model::Arm& arm, const model::Vector3& moment,
                                  const model::Vector3& force, model::LoadFrame frame) {
  model::Vector6 wrench;
  wrench << moment, force;
  return {"tip", arm.length_m, wrench, frame, model::ConstantSchedule{1}};
}

inline model::StaticsResult Equilibrium(const model::Robot& robot, int load_steps) {
  model::StaticsSettings settings;
  settings.load_steps = load_steps;
  const model::StaticsResult result = SolveStatics(model::Plant(robot), settings);
  EXPECT_TRUE(result.ok) << result.reason;
  return result;
}

/// Second-order extrapolation of results on n and 2n elements.
template <typename Value>
Value Extrapolate(const Value& coarse, const Value& fine) {
  return fine + (fine - coarse) / 3.0;
}

/// Observed order from errors with steps in ratio 2.
inline double Order(double coarse, double fine) { return std::log2(coarse / fine); }

inline model::RunSettings Settings(model::Integrator integrator, double step_s, double duration_s) {
  model::RunSettings s;
  s.stepper.integrator = integrator;
  s.step_s = step_s;
  s.duration_s = duration_s;
  s.output_interval_s = std::max(duration_s / 20, step_s);
  // What Newton leaves of an increment is 1/(gamma h) times as large in the velocity, at every
  // step: far below the errors of the method that these tests measure.
  s.stepper.newton_tolerance = 1e-12;
  return s;
}

inline model::RunResult CompleteRun(const model::Robot& robot, const model::RunSettings& settings) {
  const model::Plant plant(robot);
  model::Simulation simulation(plant, settings);
  const model::RunResult result = simulation.Run();
  EXPECT_TRUE(result.ok) << result.reason;
  return result;
}

}  // namespace mantle::tests
