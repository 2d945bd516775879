#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>

#include "controller/active_set_solver.h"
#include "controller/ipopt_solver.h"
#include "controller/mpc.h"
#include "tests/controller/control_scene.h"
#include "tests/controller/interior_point.h"

// The programs that the controller meets, taken from closed loops of the shipped scenes, are solved
// to the end, whatever the scale of the weights.

namespace mantle::controller {
namespace {

using tests::ControlScene;
using tests::InteriorPoint;

/// The controller in closed loop with the reduced model as the plant; every period the program is
/// at hand after its solve.
struct Periods {
  template <typename Change>
  Periods(const std::string& scene, const std::vector<std::string>& overrides, const Change& change)
      : world(scene, overrides),
        options(*world.scene.control),
        state(world.Start(0)),
        next(state),
        command(VectorX::Zero(world.model.input_count())) {
    change(&options);
    mpc = std::make_unique<Mpc>(world.model, world.step, options, world.reference);
    mpc->Start(state);
  }

  void Next() {
    start = state;
    mpc->Prepare(state, command);
    mpc->Solve(state, 0);
    mpc->RecordPosition(state.time_s, state.root.position);
    EXPECT_EQ(mpc->status().outcome, Outcome::kSolved) << ToString(mpc->status().solver);
    constexpr int kSyncs = 5;
    const double sync_s = options.period_s / kSyncs;
    for (int i = 0; i < kSyncs; ++i) {
      TensionsAt(mpc->plan(), state.time_s + sync_s, command);
      // a push that the model does not foresee, so that the start is not what was expected
      EXPECT_TRUE(world.propagator.Step(state, sync_s, 1.1 * command, &next, nullptr).ok);
      next.time_s = state.time_s + sync_s;
      std::swap(state, next);
    }
  }

  ControlScene world;
  ControlOptions options;
  std::unique_ptr<Mpc> mpc;
  ReducedState state, next, start;
  VectorX command;
};

constexpr int kPeriods = 12;
void AsItIs(ControlOptions*) {}

class ProgramsOf : public testing::TestWithParam<const char*> {};
INSTANTIATE_TEST_SUITE_P(
    Scenes, ProgramsOf,
    testing::Values("steer.toml", "swim.toml", "reach.toml", "octopus_swim.toml"),
    [](const auto& info) {
      return std::string(info.param).substr(0, std::string(info.param).find('.'));
    });

TEST_P(ProgramsOf, AreSolvedToTheEnd) {
  constexpr double kObjective = 1e-3, kResidual = 1e-8;
  Periods run(GetParam(), {}, AsItIs);
  for (int i = 0; i < kPeriods; ++i) {
    run.Next();
    InteriorPoint exact(&run.mpc->condensed());
    const double least = static_cast<double>(exact.Objective(exact.Solve()));
    ASSERT_LT(least, 0);
    EXPECT_LE(run.mpc->status().cost, least + kObjective * std::abs(least)) << i;
    // and no less: it keeps to its bounds
    EXPECT_GE(run.mpc->status().cost, least - kObjective * std::abs(least)) << i;
    const MpcStatus& s = run.mpc->status();
    const double slopes = run.mpc->condensed().gradient().cwiseAbs().maxCoeff();
    EXPECT_LT(s.stationarity, kResidual * slopes) << i;
    EXPECT_LT(s.complementarity, kResidual * slopes) << i;  // tensions are of order 1 N
    EXPECT_LT(s.infeasibility, kResidual) << i;
  }
}

TEST_P(ProgramsOf, HaveOneSolutionByEitherMethod) {
  constexpr double kSame_n = 1e-9;
  Periods run(GetParam(), {}, AsItIs);
  const auto alone = MakeActiveSetSolver(nullptr);
  const auto after = MakeActiveSetSolver(MakeIpoptSolver(), FirstGuess::kOtherSolver);
  SolveOptions o;
  o.max_iterations = 300;
  SolveResult a, b;
  int changes = 0, guessed = 0;
  for (int i = 0; i < kPeriods; ++i) {
    run.Next();
    alone->Solve(run.mpc->condensed(), o, &a);
    after->Solve(run.mpc->condensed(), o, &b);
    ASSERT_EQ(a.status, SolveStatus::kSolved);
    ASSERT_EQ(b.status, SolveStatus::kSolved);
    EXPECT_LT((a.x - b.x).cwiseAbs().maxCoeff(), kSame_n) << i;
    changes += a.iterations;
    guessed += b.iterations;
  }
  RecordProperty("points_per_program", std::to_string(double(changes) / kPeriods));
  RecordProperty("points_after_ipopt", std::to_string(double(guessed) / kPeriods));
}

TEST_P(ProgramsOf, HaveThePlanOfTheSameProgramInAnotherUnit) {
  constexpr double kSame_n = 1e-6;
  const bool arm = std::string(GetParam()) == "reach.toml";
  const std::vector<std::string> bound =
      arm ? std::vector<std::string>{"control.bounds=[{quantity='curvature',high=2,weight=1}]"}
          : std::vector<std::string>{"control.bounds=[{quantity='turn_rate',high=0.05,weight=1}]"};
  Periods as_it_is(GetParam(), bound, AsItIs);
  std::vector<std::unique_ptr<Periods>> scaled;
  for (const double unit : {1e-3, 1e-1, 1e3}) {
    scaled.push_back(std::make_unique<Periods>(GetParam(), bound, [unit](ControlOptions* o) {
      CostWeights& c = o->cost;  // `terminal` multiplies them, in seconds
      for (double* weight : {&c.position, &c.heading, &c.velocity, &c.mean_velocity, &c.turn_rate,
                             &c.tip, &c.volume, &c.effort, &c.rate}) {
        *weight *= unit;
      }
      for (SoftBound& b : o->bounds) b.weight *= unit;
    }));
  }
  for (int i = 0; i < kPeriods; ++i) {
    as_it_is.Next();
    const Plan& plan = as_it_is.mpc->plan();
    for (auto& other : scaled) {
      other->Next();
      EXPECT_LT((other->mpc->plan().tensions - plan.tensions).cwiseAbs().maxCoeff(), kSame_n) << i;
      // gains carry the penalty of 1e7 of active bounds
      ASSERT_EQ(other->mpc->plan().gains.size(), plan.gains.size());
      const double largest = plan.gains[0].cwiseAbs().maxCoeff();
      EXPECT_LT((other->mpc->plan().gains[0] - plan.gains[0]).cwiseAbs().maxCoeff(),
                kSame_n * largest)
          << i;
    }
  }
}

TEST(ExactPrograms, GainsHoldWhatTheSolutionHolds) {
  // A plan's gains against solutions of the program from starts to both sides, where those hold
  // the same bounds.
  constexpr double kMove = 1e-6, kShare = 1e-4;
  Periods run("steer.toml", {}, AsItIs);
  const auto solver = MakeActiveSetSolver(nullptr);
  SolveOptions o;
  o.max_iterations = 300;
  SolveResult at, up, down;
  const int motors = run.world.model.input_count();
  const Horizon& horizon = run.mpc->horizon();
  Eigen::MatrixXd change(motors, horizon.steps() + 1);
  const auto same = [](const SolveResult& a, const SolveResult& b) {
    const auto held = [](const VectorX& z) { return (z.array() > 0).eval(); };
    return (held(a.z_low) == held(b.z_low)).all() && (held(a.z_high) == held(b.z_high)).all() &&
           (held(a.lambda.cwiseAbs()) == held(b.lambda.cwiseAbs())).all();
  };
  int compared = 0, at_rest = 0;
  for (int i = 0; i < kPeriods; ++i) {
    run.Next();
    Condensed& program = run.mpc->condensed();
    VectorX from(2 * run.world.model.velocity_count());
    StateDifference(run.mpc->trajectory().states[0], run.start, from);
    solver->Solve(program, o, &at);
    const Eigen::MatrixXd& gain = run.mpc->plan().gains[0];
    const double largest = gain.cwiseAbs().maxCoeff();
    for (int c = 0; c < gain.cols(); c += 5) {
      VectorX by = from;
      by(c) += kMove;
      program.SetInitialDeviation(by);
      solver->Solve(program, o, &up);
      by(c) -= 2 * kMove;
      program.SetInitialDeviation(by);
      solver->Solve(program, o, &down);
      if (!same(up, at) || !same(down, at)) continue;
      change.setZero();
      AddChange(horizon, (up.x - down.x) / (2 * kMove), &change);
      EXPECT_LT((gain.col(c) - change.col(1)).cwiseAbs().maxCoeff(), kShare * largest)
          << "period " << i << ", state " << c;
      ++compared;
    }
    for (int m = 0; m < motors; ++m) at_rest += gain.row(m).cwiseAbs().maxCoeff() < 1e-5 * largest;
    program.SetInitialDeviation(from);
  }
  EXPECT_GT(compared, 50);
  EXPECT_GT(at_rest, 0) << "no motor was at its bound";
}

TEST(ExactPrograms, StoppedEarlyTheyAreFeasibleAndNoWorseThanTheirStart) {
  Periods run("steer.toml", {}, AsItIs);
  const auto solver = MakeActiveSetSolver(nullptr);
  SolveOptions o;
  SolveResult result;
  int better = 0;
  for (int i = 0; i < kPeriods; ++i) {
    run.Next();
    Condensed& program = run.mpc->condensed();
    for (o.max_iterations = 1; o.max_iterations < 300; ++o.max_iterations) {
      solver->Solve(program, o, &result);
      EXPECT_LT(program.Violation(result.x), 1e-12);
      EXPECT_LE(program.Model(result.x), 0.0);
      EXPECT_LE(result.iterations, o.max_iterations);
      better += program.Model(result.x) < 0;
      if (result.status == SolveStatus::kSolved) break;
      EXPECT_EQ(result.status, SolveStatus::kIterationBudget);
    }
    EXPECT_EQ(result.status, SolveStatus::kSolved);
  }
  EXPECT_GT(better, 0);
}

}  // namespace
}  // namespace mantle::controller
