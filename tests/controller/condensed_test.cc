#include "controller/condensed.h"

#include <gtest/gtest.h>

#include "controller/gait.h"
#include "controller/ipopt_solver.h"
#include "controller/multiple_shooting.h"
#include "tests/controller/control_scene.h"

namespace mantle::controller {
namespace {

using tests::ControlScene;

// Small horizons: the same code, shorter runs.
const std::vector<std::string> kSmall = {"control.grid.steps=10", "control.grid.step=0.1",
                                         "control.grid.knots=[1,2,4,7,10]"};

struct Problem {
  explicit Problem(const std::string& scene, std::vector<std::string> more = {})
      : world(scene, Joined(std::move(more))),
        options(*world.scene.control),
        horizon(MakeHorizon(options.grid, options.motors)),
        cost(world.model, options, world.reference),
        condensed(world.model, horizon, &cost, options),
        history(3.0),
        base(world.Motion(horizon)) {
    history.Reset(0.0, Vector3::Zero());
    history.Add(base.states[0].time_s, base.states[0].root.position);
    condensed.Prepare(base, history, 0.0);
  }
  static std::vector<std::string> Joined(std::vector<std::string> more) {
    more.insert(more.begin(), kSmall.begin(), kSmall.end());
    return more;
  }

  /// True cost of the base changed by w, from an initial state moved by `by`.
  double Cost(const VectorX& w, const VectorX& by) {
    Trajectory t = base;
    MoveState(base.states[0], by, &t.states[0]);
    AddChange(horizon, w, &t.tensions);
    EXPECT_TRUE(world.propagator.Roll(horizon, false, &t).ok);
    return condensed.Cost(t, history);
  }
  VectorX NoChange() const { return VectorX::Zero(condensed.variables()); }
  VectorX NoMove() const { return VectorX::Zero(2 * world.model.velocity_count()); }

  ControlScene world;
  ControlOptions options;
  Horizon horizon;
  StageCost cost;
  Condensed condensed;
  PositionHistory history;
  Trajectory base;
};

class CondensedOf : public testing::TestWithParam<const char*> {};
INSTANTIATE_TEST_SUITE_P(
    Scenes, CondensedOf, testing::Values("steer.toml", "swim.toml", "reach.toml"),
    [](const auto& info) {
      return std::string(info.param).substr(0, std::string(info.param).find('.'));
    });

TEST_P(CondensedOf, GradientMatchesDifferencesOfTheTrueCost) {
  Problem p(GetParam());
  const VectorX& g = p.condensed.gradient();
  // Central differences: truncation by the cost's third derivative times step^2, over the model's
  // Newton tolerance divided by the step.
  constexpr double kStep_n = 2e-3, kShare = 2e-4;
  for (int j = 0; j < g.size(); ++j) {
    VectorX w = p.NoChange();
    w(j) = kStep_n;
    const double up = p.Cost(w, p.NoMove());
    w(j) = -kStep_n;
    const double down = p.Cost(w, p.NoMove());
    EXPECT_NEAR(g(j), (up - down) / (2 * kStep_n), kShare * g.cwiseAbs().maxCoeff()) << j;
  }
}

// The cost with dynamics and residuals linear in (w, delta x_0), but for the damping: what the
// condensed quadratic program has to be, summed node by node.
double LinearCost(Problem* p, const VectorX& w, const VectorX& by) {
  const int steps = p->horizon.steps();
  Eigen::MatrixXd change = Eigen::MatrixXd::Zero(p->base.tensions.rows(), p->base.tensions.cols());
  AddChange(p->horizon, w, &change);
  VectorX moved = by;
  double cost = 0;
  std::vector<Vector3> position;
  const auto place = [&](int k) {
    const model::Pose& root = p->base.states[k].root;
    position.push_back(root.position + root.rotation * Vector3(moved.segment<3>(3)));
  };
  place(0);
  for (int k = 1; k <= steps; ++k) {
    const auto& j = p->base.jacobians[k - 1];
    moved = (j.state * moved + j.input * (0.5 * (change.col(k - 1) + change.col(k)))).eval();
    place(k);
    const VectorX r = p->condensed.residual(k) + p->condensed.jacobian(k) * moved;
    cost += p->condensed.StageWeight(k) * p->condensed.weights(k).dot(r.cwiseAbs2());
  }
  Eigen::MatrixXd h = Eigen::MatrixXd::Zero(w.size(), w.size());
  VectorX g = VectorX::Zero(w.size());
  p->condensed.AddInputCost(p->base, &h, &g);
  cost += 0.5 * w.dot(h * w) + g.dot(w);
  if (!p->cost.has_mean_velocity()) return cost;
  const double period = p->cost.averaging_s(), start = p->base.states[0].time_s;
  for (int k = 1; k <= steps; ++k) {
    const double t = start + p->horizon.time_s[k];
    constexpr double kSameTime_s = 1e-9;
    const double then = t - period + kSameTime_s;
    Vector3 before = p->history.At(t - period);
    for (int i = 0; i < steps; ++i) {
      const double a = start + p->horizon.time_s[i], b = start + p->horizon.time_s[i + 1];
      if (then < a || then >= b) continue;
      before = position[i] + (t - period - a) / (b - a) * (position[i + 1] - position[i]);
    }
    cost += p->condensed.StageWeight(k) * p->condensed.mean_velocity_weight(k) *
            ((position[k] - before) / period - p->world.reference.At(t).velocity).squaredNorm();
  }
  return cost;
}

TEST_P(CondensedOf, ProgramIsTheLinearisedProblem) {
  Problem p(GetParam());
  VectorX by = p.NoMove(), w = p.NoChange();
  for (int i = 0; i < by.size(); ++i) by(i) = 0.01 * std::cos(3.0 * i);
  for (int j = 0; j < w.size(); ++j) w(j) = 0.05 * std::sin(1.0 + 7 * j);
  constexpr double kRoundOff = 1e-9;
  p.condensed.SetInitialDeviation(by);
  const double model = p.condensed.Model(w);
  const double linear = LinearCost(&p, w, by) - LinearCost(&p, p.NoChange(), by);
  EXPECT_NEAR(model, linear, kRoundOff * std::max(1.0, std::abs(linear)));
}

TEST(Condensed, GainsMatchDifferencesOfResolves) {
  // First free, then with bounds and rates that bind.
  for (const char* rate : {"control.limits.rate=50", "control.limits.rate=0.6"}) {
    Problem p("steer.toml", {rate, "control.motors[0].rate=50"});
    auto solver = MakeIpoptSolver();
    SolveOptions options;
    options.tolerance = 1e-10;
    options.initial_barrier = 1e-6;
    options.max_iterations = 200;
    SolveResult result;
    p.condensed.Prepare(p.base, p.history, 0.5);
    const auto solve = [&](const VectorX& by) {
      p.condensed.SetInitialDeviation(by);
      solver->Solve(p.condensed, options, &result);
      EXPECT_TRUE(result.usable()) << ToString(result.status);
      return result.x;
    };
    const VectorX w = solve(p.NoMove());
    std::vector<Eigen::MatrixXd> gains;
    p.condensed.Gains(w, result, 2, &gains);
    const int motors = p.world.model.input_count();
    Eigen::MatrixXd change = Eigen::MatrixXd::Zero(motors, p.horizon.steps() + 1);
    constexpr double kStep = 1e-4, kShare = 5e-3;
    double largest = gains[0].cwiseAbs().maxCoeff();
    int compared = 0;
    for (int c = 0; c < gains[0].cols(); c += 3) {
      VectorX by = p.NoMove();
      by(c) = kStep;
      const VectorX up = solve(by);
      by(c) = -kStep;
      const VectorX down = solve(by);
      change.setZero();
      AddChange(p.horizon, (up - down) / (2 * kStep), &change);
      for (int i = 0; i < motors; ++i) {
        EXPECT_NEAR(gains[0](i, c), change(i, 1), kShare * largest) << rate << " " << i << " " << c;
        ++compared;
      }
    }
    EXPECT_GT(compared, 0);
    EXPECT_GT(largest, 1e-3);
  }
}

TEST(Condensed, AgreesWithMultipleShooting) {
  // Gauss-Newton on the condensed problem and Ipopt on the sparse one meet at the same plan.
  Problem p("reach.toml", {"control.grid.steps=6", "control.grid.knots=[1,2,4,6]"});
  auto solver = MakeIpoptSolver();
  SolveOptions options;
  options.tolerance = 1e-9;
  options.max_iterations = 300;
  options.initial_barrier = 1e-4;
  SolveResult result;
  Trajectory t = p.base;
  for (int i = 0; i < 40; ++i) {
    p.condensed.Prepare(t, p.history, 1e-3);
    p.condensed.SetInitialDeviation(p.NoMove());
    solver->Solve(p.condensed, options, &result);
    ASSERT_TRUE(result.usable()) << ToString(result.status);
    AddChange(p.horizon, result.x, &t.tensions);
    ASSERT_TRUE(p.world.propagator.Roll(p.horizon, true, &t).ok);
    if (result.x.cwiseAbs().maxCoeff() < 1e-7) break;
  }
  const double condensed_cost = p.condensed.Cost(t, p.history);
  p.condensed.Prepare(p.base, p.history, 0.0);
  MultipleShooting sparse(p.horizon, p.base, &p.condensed, &p.cost, &p.world.propagator);
  options.fast = false;
  SolveResult other;
  solver->Solve(sparse, options, &other);
  ASSERT_TRUE(other.usable()) << ToString(other.status);
  Trajectory s = p.base;
  AddChange(p.horizon, other.x.head(sparse.decisions()), &s.tensions);
  ASSERT_TRUE(p.world.propagator.Roll(p.horizon, false, &s).ok);
  const double sparse_cost = p.condensed.Cost(s, p.history);
  EXPECT_NEAR(sparse_cost, condensed_cost, 1e-5 * condensed_cost);
  EXPECT_LT((s.tensions - t.tensions).cwiseAbs().maxCoeff(), 2e-3);  // N, of 0..1 N
}

TEST(MultipleShooting, DerivativesMatchDifferences) {
  Problem p("steer.toml", {"control.grid.steps=3", "control.grid.knots=[1,3]"});
  MultipleShooting sparse(p.horizon, p.base, &p.condensed, &p.cost, &p.world.propagator);
  const int n = sparse.variables(), m = sparse.constraints();
  VectorX x(n);
  for (int i = 0; i < n; ++i) x(i) = 1e-3 * std::sin(5.0 * i);
  VectorX gradient(n), values(sparse.JacobianPattern().row.size());
  ASSERT_TRUE(sparse.Gradient(x.data(), true, gradient.data()));
  ASSERT_TRUE(sparse.Jacobian(x.data(), false, values.data()));
  Eigen::MatrixXd jacobian = Eigen::MatrixXd::Zero(m, n);
  for (Eigen::Index e = 0; e < values.size(); ++e) {
    jacobian(sparse.JacobianPattern().row[e], sparse.JacobianPattern().column[e]) += values(e);
  }
  // Differences over 1e-5 of steps that are solved to 1e-10, with stiff rates.
  constexpr double kStep = 1e-5, kNewton = 5e-4;
  VectorX up(m), down(m);
  for (int i = 0; i < n; i += 5) {
    VectorX y = x;
    double fu = 0, fd = 0;
    y(i) = x(i) + kStep;
    ASSERT_TRUE(sparse.Objective(y.data(), true, &fu));
    ASSERT_TRUE(sparse.Constraints(y.data(), false, up.data()));
    y(i) = x(i) - kStep;
    ASSERT_TRUE(sparse.Objective(y.data(), true, &fd));
    ASSERT_TRUE(sparse.Constraints(y.data(), false, down.data()));
    EXPECT_NEAR(gradient(i), (fu - fd) / (2 * kStep), 1e-5 * gradient.cwiseAbs().maxCoeff()) << i;
    const VectorX column = (up - down) / (2 * kStep);
    EXPECT_LT((jacobian.col(i) - column).cwiseAbs().maxCoeff(),
              kNewton * std::max(1.0, column.cwiseAbs().maxCoeff()))
        << i;
  }
}

}  // namespace
}  // namespace mantle::controller
