#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include "controller/registry.h"
#include "controller/stage_cost.h"
#include "tests/controller/control_scene.h"
#include "tests/support/allocation_counter.h"

// What every Controller promises (controller/controller.h): the same suite over all that are
// registered, on the vehicle that is steered and the arm that reaches, with the reduced model as
// the world.

namespace mantle::controller {
namespace {

using tests::ControlScene;

constexpr double kSync_s = 0.01;

struct Variant {
  std::string controller, scene;
};
void PrintTo(const Variant& v, std::ostream* out) { *out << v.controller << "_" << v.scene; }

std::vector<Variant> Variants() {
  std::vector<Variant> all;
  for (const std::string& controller : ControllerNames()) {
    for (const char* scene : {"steer", "reach"}) all.push_back({controller, scene});
  }
  return all;
}

/// One controller and the world that it moves.
struct Drive {
  explicit Drive(ControlScene* scene)
      : world(*scene),
        controller(MakeController(world.parts())),
        state(InitialState(world.model)),
        next(state),
        tensions(world.model.input_count()) {
    for (Eigen::Index i = 0; i < tensions.size(); ++i) {
      tensions(i) = world.scene.control->motors[static_cast<std::size_t>(i)].min_tension_n;
    }
    controller->Start(state);
  }

  struct Way {
    bool prepares{true}, sees{true};
  };
  /// One SYNC: plans where one is due, commands, limits and moves the world.
  void Sync(int k, Way way) {
    const ControlOptions& options = *world.scene.control;
    const int every = static_cast<int>(std::lround(options.period_s / kSync_s));
    const ReducedState* estimate = way.sees ? &state : nullptr;
    if (k % every == 0) {
      if (way.prepares) controller->Prepare(state.time_s, tensions);
      controller->Update(state.time_s, estimate, tensions, 0);
    }
    VectorX commanded = tensions;
    const long before = tests::allocation_count;
    controller->Command(state.time_s, estimate, commanded);
    allocations += tests::allocation_count - before;
    ASSERT_TRUE(commanded.allFinite()) << state.time_s;
    LimitTensions(options.motors, tensions, kSync_s, commanded);
    tensions = commanded;
    ASSERT_TRUE(world.propagator.Step(state, kSync_s, tensions, &next, nullptr).ok);
    next.time_s = state.time_s + kSync_s;
    std::swap(state, next);
    commands.push_back(tensions);
  }

  ControlScene& world;
  std::unique_ptr<Controller> controller;
  ReducedState state, next;
  VectorX tensions;
  std::vector<VectorX> commands;
  long allocations{0};
};

class ControllerProperties : public ::testing::TestWithParam<Variant> {
 protected:
  ControllerProperties()
      : world_(GetParam().scene + ".toml",
               {"control.controller=\"" + GetParam().controller + "\""}) {}
  ControlScene world_;
};

TEST_P(ControllerProperties, TheSamePastGivesTheSameBits) {
  Drive one(&world_), two(&world_);
  for (int k = 0; k < 40; ++k) {
    one.Sync(k, {});
    two.Sync(k, {});
    ASSERT_EQ(one.tensions, two.tensions) << k;
  }
}

TEST_P(ControllerProperties, WhatPrepareLeavesUpdateDoes) {
  Drive with(&world_), without(&world_);
  for (int k = 0; k < 40; ++k) {
    with.Sync(k, {});
    without.Sync(k, {.prepares = false});
    ASSERT_EQ(with.tensions, without.tensions) << k;
  }
}

TEST_P(ControllerProperties, ADisturbanceOfNothingChangesNothing) {
  Drive told(&world_), untold(&world_);
  for (int k = 0; k < 40; ++k) {
    told.controller->SetDisturbance(Disturbance(static_cast<int>(told.tensions.size())));
    told.Sync(k, {});
    untold.Sync(k, {});
    ASSERT_EQ(told.tensions, untold.tensions) << k;
  }
}

TEST_P(ControllerProperties, CommandsOnWithoutAnEstimateAndComesBack) {
  Drive run(&world_);
  for (int k = 0; k < 150; ++k) run.Sync(k, {.sees = k < 30 || k >= 90});
  // Finite all along (see Sync); at the end it works again: some motor moves.
  double moved = 0;
  for (std::size_t k = run.commands.size() - 40; k < run.commands.size(); ++k) {
    moved = std::max(moved, (run.commands[k] - run.commands[k - 1]).cwiseAbs().maxCoeff());
  }
  EXPECT_GT(moved, 1e-4);
}

TEST_P(ControllerProperties, CommandAllocatesNothing) {
  if (!tests::kCountsAllocations) GTEST_SKIP() << "the allocator is a sanitizer's";
  Drive run(&world_);
  for (int k = 0; k < 40; ++k) run.Sync(k, {});
  EXPECT_EQ(run.allocations, 0);
}

TEST_P(ControllerProperties, DoesItsTaskBetterThanMotorsLeftAlone) {
  // The task's cost without effort over the first seconds, on the model that it believes in.
  constexpr int kSyncs = 400;
  StageCost cost(world_.model, *world_.scene.control, world_.reference);
  VectorX residual(cost.rows());
  const auto value = [&](const ReducedState& state) {
    cost.Evaluate(state, &residual, nullptr);
    return cost.Value(residual) * kSync_s;
  };
  Drive run(&world_);
  ReducedState idle = run.state, next = idle;
  const VectorX slack = run.tensions;
  double controlled = 0, alone = 0;
  for (int k = 0; k < kSyncs; ++k) {
    run.Sync(k, {});
    ASSERT_TRUE(world_.propagator.Step(idle, kSync_s, slack, &next, nullptr).ok);
    next.time_s = idle.time_s + kSync_s;
    std::swap(idle, next);
    controlled += value(run.state);
    alone += value(idle);
  }
  EXPECT_LT(controlled, alone);
}

INSTANTIATE_TEST_SUITE_P(Controllers, ControllerProperties, ::testing::ValuesIn(Variants()),
                         [](const auto& v) { return v.param.controller + "_" + v.param.scene; });

}  // namespace
}  // namespace mantle::controller
