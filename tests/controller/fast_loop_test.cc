#include <gtest/gtest.h>

#include <cmath>

#include "controller/controller.h"
#include "tests/controller/control_scene.h"

// The fast loop answers a deviation between two plans. The right answer is what a new plan would
// be, solved for the deviated state: sign, size and motor of the feedback are held against that.

namespace mantle::controller {
namespace {

using tests::ControlScene;

// What counts is how the arm is pulled aside: opposite cables, one minus the other. How an answer
// is shared between the two depends on which of them is at its lower limit; a new plan lets the
// slack one be, the gains do not know of it unless it is within 0.2 mN. So the direction must
// agree, the size within a factor of two. A wrong sign gives a cosine of -1, a missing feedback
// none.
constexpr double kLeastCosine = 0.95;
constexpr double kFactor = 2.0;
constexpr double kLeastAnswer_n = 2e-3;  // well above what a solve to 1e-4 leaves undone

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

/// Pull of the arm's four cables in the two directions across it [N].
Eigen::Vector2d Aside(const VectorX& tensions) {
  return {tensions(0) - tensions(2), tensions(1) - tensions(3)};
}

class FastLoop : public testing::TestWithParam<Deviation> {};

TEST_P(FastLoop, AnswersADeviationAsANewPlanWould) {
  // Three controllers with the same past.
  Planner plain, solved, feedback;
  ReducedState deviated = plain.state;
  GetParam().apply(&deviated);
  const Eigen::Vector2d none = Aside(plain.Answer(plain.state, nullptr));
  const Eigen::Vector2d by_plan = Aside(solved.Answer(deviated, nullptr)) - none;
  const Eigen::Vector2d by_gain = Aside(feedback.Answer(feedback.state, &deviated)) - none;
  ASSERT_GT(by_plan.norm(), kLeastAnswer_n) << "the deviation asks for nothing";
  const double cosine = by_plan.dot(by_gain) / (by_plan.norm() * by_gain.norm());
  EXPECT_GT(cosine, kLeastCosine) << by_plan.transpose() << "  against  " << by_gain.transpose();
  EXPECT_GT(by_gain.norm(), by_plan.norm() / kFactor);
  EXPECT_LT(by_gain.norm(), by_plan.norm() * kFactor);
}

INSTANTIATE_TEST_SUITE_P(
    Deviations, FastLoop,
    testing::Values(Deviation{"Pitch",
                              [](ReducedState* s) {
                                s->root.rotation = s->root.rotation * model::ExpSO3({0.02, 0, 0});
                              }},
                    Deviation{"Yaw",
                              [](ReducedState* s) {
                                s->root.rotation = s->root.rotation * model::ExpSO3({0, -0.02, 0});
                              }},
                    Deviation{"PitchRate", [](ReducedState* s) { s->v(0) -= 0.4; }},
                    Deviation{"YawRate", [](ReducedState* s) { s->v(1) += 0.4; }},
                    Deviation{"Aside", [](ReducedState* s) { s->root.position.x() += 0.004; }}),
    [](const auto& info) { return std::string(info.param.name); });

}  // namespace
}  // namespace mantle::controller
