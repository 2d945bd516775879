#include <gtest/gtest.h>

#include <cmath>

#include "controller/controller.h"
#include "tests/controller/control_scene.h"

// The fast loop answers a deviation between two plans. The right answer is what a new plan would
// be, solved for the deviated state: sign, size and motor of the feedback are held against that.

namespace mantle::controller {
namespace {

using tests::ControlScene;

// Deviations small enough for the same bounds to be active: there the answer is linear, in every
// motor. What is left is the square of the deviation.
constexpr double kShare = 0.03;
constexpr double kLeastAnswer_n = 1e-4;

/// The MPC of the steering scene after a few plans on its own model, without delay, with limits so
/// wide that the tensions of the next nodes are free.
struct Planner {
  Planner()
      : world("steer.toml",
              {"control.grid.steps=10", "control.grid.step=0.1", "control.grid.knots=[1,2,4,7,10]",
               "control.delay=0", "control.limits.rate=50", "control.motors[0].rate=50"}),
        controller(MakeMpcController(world.parts())),
        state(world.Start(0.0)),
        next(state),
        command(VectorX::Constant(world.model.input_count(), 0.2)) {
    controller->Start(state);
    for (int turn = 0; turn < 4; ++turn) {
      controller->Update(state.time_s, &state, command, 0);
      for (int i = 0; i < 5; ++i) {
        controller->Command(state.time_s + kSync_s, nullptr, command);
        EXPECT_TRUE(world.propagator.Step(state, kSync_s, command, &next, nullptr).ok);
        next.time_s = state.time_s + kSync_s;
        std::swap(state, next);
      }
    }
  }

  /// Tensions one node after `at`, with a plan made for `planned`, and `seen` at the plan's start.
  VectorX Answer(const ReducedState& planned, const ReducedState* seen) {
    controller->Update(state.time_s, &planned, command, 0);
    EXPECT_EQ(controller->mpc()->status().outcome, Outcome::kSolved);
    VectorX tensions = command;
    controller->Command(controller->mpc()->plan().time_s[1], seen, tensions);
    return tensions;
  }

  static constexpr double kSync_s = 0.01;
  ControlScene world;
  std::unique_ptr<Controller> controller;
  ReducedState state, next;
  VectorX command;
};

struct Deviation {
  const char* name;
  void (*apply)(ReducedState*);
};
void PrintTo(const Deviation& deviation, std::ostream* out) { *out << deviation.name; }

class FastLoop : public testing::TestWithParam<Deviation> {};

TEST_P(FastLoop, AnswersADeviationAsANewPlanWould) {
  // Three controllers with the same past.
  Planner plain, solved, feedback;
  ReducedState deviated = plain.state;
  GetParam().apply(&deviated);
  const VectorX none = plain.Answer(plain.state, nullptr);
  const VectorX by_plan = solved.Answer(deviated, nullptr) - none;
  const VectorX by_gain = feedback.Answer(feedback.state, &deviated) - none;
  ASSERT_GT(by_plan.norm(), kLeastAnswer_n) << "the deviation asks for nothing";
  EXPECT_LT((by_gain - by_plan).norm(), kShare * by_plan.norm())
      << by_plan.transpose() << "  against  " << by_gain.transpose();
}

INSTANTIATE_TEST_SUITE_P(
    Deviations, FastLoop,
    testing::Values(Deviation{"Pitch",
                              [](ReducedState* s) {
                                s->root.rotation = s->root.rotation * model::ExpSO3({5e-4, 0, 0});
                              }},
                    Deviation{"Yaw",
                              [](ReducedState* s) {
                                s->root.rotation = s->root.rotation * model::ExpSO3({0, -5e-4, 0});
                              }},
                    Deviation{"PitchRate", [](ReducedState* s) { s->v(0) -= 0.01; }},
                    Deviation{"YawRate", [](ReducedState* s) { s->v(1) += 0.01; }},
                    Deviation{"Aside", [](ReducedState* s) { s->root.position.x() += 1e-4; }}),
    [](const auto& info) { return std::string(info.param.name); });

}  // namespace
}  // namespace mantle::controller
