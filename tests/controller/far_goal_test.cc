#include <gtest/gtest.h>

#include <cmath>

#include "controller/controller.h"
#include "tests/controller/control_scene.h"

// Closed loops on the reduced model whose goal is out of reach, and plans that are far apart.

namespace mantle::controller {
namespace {

using tests::ControlScene;

constexpr double kSync_s = 0.01;

struct Flight {
  double cost{0};
  VectorX variation_n_s;  ///< of every motor's tension: sum of its changes over the time
};

/// `seconds` of the scene with the plant of `plant`, whose overrides come after those of both;
/// the fast loop's feedback times `feedback`.
Flight Fly(const std::string& scene, std::vector<std::string> overrides, double seconds,
           const std::vector<std::string>& plant = {}, double feedback = 1) {
  const ControlScene world(scene, overrides);
  overrides.insert(overrides.end(), plant.begin(), plant.end());
  const ControlScene other(scene, overrides);
  const ControlOptions& options = *world.scene.control;
  const auto controller = MakeMpcController(world.parts());
  StageCost cost(world.model, options, world.reference);
  Propagator truth(other.model, other.step);
  ReducedState state = InitialState(world.model), next = state;
  VectorX command = VectorX::Zero(world.model.input_count()), before = command;
  VectorX planned = command, answer = command, residual(cost.rows());
  Flight flight;
  flight.variation_n_s = command;
  controller->Start(state);
  const int period = static_cast<int>(std::lround(options.period_s / kSync_s));
  const int syncs = static_cast<int>(std::lround(seconds / kSync_s));
  for (int i = 0; i < syncs; ++i) {
    if (i % period == 0) controller->Update(state.time_s, &state, command, 0);
    before = command;
    planned = answer = command;
    controller->Command(state.time_s + kSync_s, nullptr, planned);
    controller->Command(state.time_s + kSync_s, &state, answer);
    command = planned + feedback * (answer - planned);
    LimitTensions(options.motors, before, kSync_s, command);
    EXPECT_TRUE(truth.Step(state, kSync_s, command, &next, nullptr).ok);
    next.time_s = state.time_s + kSync_s;
    std::swap(state, next);
    cost.Evaluate(state, &residual, nullptr);
    flight.cost +=
        kSync_s * (cost.Value(residual) + cost.InputValue(command, (command - before) / kSync_s));
    flight.variation_n_s += (command - before).cwiseAbs() / seconds;
  }
  return flight;
}

TEST(FarGoal, ArmsDoNotChatterAfterAReferenceThatIsTooFast) {
  // Alternating at the node rate by what rates allow (2 N/s) is 1 to 1.4 N/s.
  constexpr double kSteering_n_s = 0.5, kSwimming_n_s = 0.9;
  const Flight steer = Fly("steer.toml", {"control.goal.speed=0.2"}, 5);
  EXPECT_LT(steer.variation_n_s.tail(4).maxCoeff(), kSteering_n_s);
  const Flight swim = Fly("swim.toml", {"control.goal.speed=0.4"}, 4);
  EXPECT_LT(swim.variation_n_s.tail(4).maxCoeff(), kSwimming_n_s);
}

TEST(FarGoal, GainsEarnTheirPlaceWherePlansAreFarApart) {
  // A plant whose arm is 20 % stiffer than believed, a plan every 0.2 s.
  const auto cost = [](double feedback) {
    return Fly("reach.toml", {"control.period=0.2"}, 6, {"arms[0].material.young=132000"}, feedback)
        .cost;
  };
  const double without = cost(0);
  EXPECT_LT(cost(1), 0.95 * without);
  EXPECT_GT(cost(-1), 1.1 * without);
}

}  // namespace
}  // namespace mantle::controller
