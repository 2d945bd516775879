#pragma once

#include <gtest/gtest.h>

#include <cmath>

#include "controller/controller.h"
#include "controller/gait.h"
#include "loop/scene/scene.h"
#include "reduced/build/reduced_plant.h"
#include "tests/support/paths.h"

/// A shipped control scene made small: its reduced model, reference and a trajectory with some
/// motion in it, for tests of the controller.

namespace mantle::tests {

struct ControlScene {
  explicit ControlScene(const std::string& name, std::vector<std::string> overrides = {})
      : scene(scene::LoadScene(tests::SourcePath("scenes/") + name, overrides)),
        model(scene.robot, scene.reduction),
        step{scene.reduction.scheme, 1e-10},
        reference(scene.control->goal, scene.robot),
        propagator(model, step) {}

  controller::ControllerParts parts() const { return {model, step, *scene.control, reference}; }

  /// Under way, bent, with the mantle moving.
  reduced::ReducedState Start(double t_s = 3.0) {
    reduced::ReducedState s = InitialState(model);
    model::VectorX u = model::VectorX::Constant(model.input_count(), 0.05);
    u(0) = 0.3;
    u(1) = 0.2;
    reduced::ReducedState next = s;
    for (int i = 0; i < 6; ++i) {
      EXPECT_TRUE(propagator.Step(s, 0.05, u, &next, nullptr).ok);
      std::swap(s, next);
    }
    s.time_s = t_s;
    return s;
  }

  /// Tensions that differ from motor to motor and node to node, within limits and rates.
  controller::Trajectory Motion(const controller::Horizon& horizon) {
    controller::Trajectory t(model, horizon);
    t.states[0] = Start();
    const auto& limits = scene.control->motors;
    model::VectorX pulse(model.input_count());
    for (int k = 0; k <= horizon.steps(); ++k) {
      controller::GaitTensions(scene.control->gait, t.states[0].time_s + horizon.time_s[k], pulse);
      for (int i = 0; i < model.input_count(); ++i) {
        const double wave = 0.2 + 0.1 * std::sin(horizon.time_s[k] * (1 + i) + i);
        t.tensions(i, k) = limits[i].decides_every_node ? pulse(i) : wave;
      }
    }
    EXPECT_TRUE(propagator.Roll(horizon, true, &t).ok);
    return t;
  }

  scene::Scene scene;
  reduced::ReducedPlant model;
  reduced::StepSettings step;
  controller::Reference reference;
  controller::Propagator propagator;
};

}  // namespace mantle::tests
