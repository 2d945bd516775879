#include <gtest/gtest.h>

#include <Eigen/QR>
#include <chrono>
#include <cmath>
#include <limits>
#include <random>
#include <string>

#include "controller/active_set_solver.h"
#include "controller/ipopt_solver.h"
#include "tests/controller/dense_program.h"

// What every Solver promises (controller/program.h), whatever its method: the same suite over all
// of them. Programs are made backwards, from a solution that is chosen: a convex quadratic program
// has no other.

namespace mantle::controller {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;
using tests::DenseProgram;
using tests::Of;

// Of a solution, with curvatures and slopes of order one and a solve to 1e-9.
constexpr double kSolution = 1e-6;

std::unique_ptr<Solver> ActiveSetAlone() { return MakeActiveSetSolver(nullptr); }
std::unique_ptr<Solver> ActiveSetAfterIpopt() {
  return MakeActiveSetSolver(MakeIpoptSolver(), FirstGuess::kOtherSolver);
}

struct Method {
  const char* name;
  std::unique_ptr<Solver> (*make)();
  bool fast;
};
void PrintTo(const Method& method, std::ostream* out) { *out << method.name; }

/// A strictly convex quadratic program with bounds on every variable and rows between two limits,
/// and the point, multipliers and value that solve it.
struct Known {
  DenseProgram program;
  VectorXd x, lambda, z_low, z_high;
  double objective;
};

Known Draw(unsigned seed, int n, int m) {
  std::mt19937 chance(seed);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> slack(0.2, 2.0);
  const auto vector = [&](int size) {
    return VectorXd::NullaryExpr(size, [&] { return normal(chance); });
  };
  const MatrixXd root = MatrixXd::NullaryExpr(n, n, [&] { return normal(chance); });
  const MatrixXd q = root * root.transpose() / n + 0.1 * MatrixXd::Identity(n, n);
  const MatrixXd a = MatrixXd::NullaryExpr(m, n, [&] { return normal(chance); });
  const VectorXd x = vector(n), row = a * x;
  VectorXd lambda = VectorXd::Zero(m), z_low = VectorXd::Zero(n), z_high = VectorXd::Zero(n);
  VectorXd x_low(n), x_high(n), g_low(m), g_high(m);
  for (int i = 0; i < n; ++i) {  // a third at each bound, a third between
    x_low(i) = i % 3 == 0 ? x(i) : x(i) - slack(chance);
    x_high(i) = i % 3 == 1 ? x(i) : x(i) + slack(chance);
    if (i % 3 == 0) z_low(i) = slack(chance);
    if (i % 3 == 1) z_high(i) = slack(chance);
  }
  for (int i = 0; i < m; ++i) {
    g_low(i) = i % 3 == 0 ? row(i) : row(i) - slack(chance);
    g_high(i) = i % 3 == 1 ? row(i) : row(i) + slack(chance);
    if (i % 3 == 0) lambda(i) = -slack(chance);
    if (i % 3 == 1) lambda(i) = slack(chance);
  }
  // q x + c + a^T lambda - z_low + z_high = 0
  const VectorXd c = -(q * x + a.transpose() * lambda - z_low + z_high);
  Known known{DenseProgram(vector(n), x_low, x_high, g_low, g_high),
              x,
              lambda,
              z_low,
              z_high,
              0.5 * x.dot(q * x) + c.dot(x)};
  known.program.is_quadratic = true;
  known.program.f = [q, c](const VectorXd& at) { return 0.5 * at.dot(q * at) + c.dot(at); };
  known.program.df = [q, c](const VectorXd& at) { return VectorXd(q * at + c); };
  known.program.g = [a](const VectorXd& at) { return VectorXd(a * at); };
  known.program.dg = [a](const VectorXd&) { return a; };
  known.program.h = [q](const VectorXd&, double factor, const VectorXd&) {
    return MatrixXd(factor * q);
  };
  return known;
}

class SolverProperties : public ::testing::TestWithParam<Method> {
 protected:
  SolveOptions Tight() const {
    SolveOptions o;
    o.tolerance = 1e-9;
    o.max_iterations = 100;
    o.fast = GetParam().fast;
    return o;
  }
  std::unique_ptr<Solver> solver_ = GetParam().make();
  SolveResult result_;
};

TEST_P(SolverProperties, FindsTheSolutionItsMultipliersAndItsValue) {
  for (unsigned seed = 1; seed <= 12; ++seed) {
    Known known = Draw(seed, 4 + static_cast<int>(seed), 2 + static_cast<int>(seed) / 3);
    solver_->Solve(known.program, Tight(), &result_);
    ASSERT_TRUE(result_.usable()) << seed << ": " << ToString(result_.status);
    EXPECT_LT((result_.x - known.x).cwiseAbs().maxCoeff(), kSolution) << seed;
    EXPECT_NEAR(result_.objective, known.objective, kSolution * (1 + std::abs(known.objective)));
  }
}

TEST_P(SolverProperties, MultipliersPointAsThePublicHeaderSays) {
  // Few enough active rows and bounds for the multipliers to be unique.
  for (unsigned seed = 1; seed <= 6; ++seed) {
    Known known = Draw(seed, 9, 2);
    solver_->Solve(known.program, Tight(), &result_);
    ASSERT_TRUE(result_.usable()) << seed;
    constexpr double kMultiplier = 1e-5;
    EXPECT_LT((result_.lambda - known.lambda).cwiseAbs().maxCoeff(), kMultiplier) << seed;
    EXPECT_LT((result_.z_low - known.z_low).cwiseAbs().maxCoeff(), kMultiplier) << seed;
    EXPECT_LT((result_.z_high - known.z_high).cwiseAbs().maxCoeff(), kMultiplier) << seed;
    EXPECT_GE(result_.z_low.minCoeff(), 0) << seed;
    EXPECT_GE(result_.z_high.minCoeff(), 0) << seed;
  }
}

TEST_P(SolverProperties, TheResidualsItReportsAreThoseOfItsPoint) {
  Known known = Draw(3, 12, 4);
  for (const int budget : {1, 3, 100}) {
    SolveOptions o = Tight();
    o.max_iterations = budget;
    solver_->Solve(known.program, o, &result_);
    const VectorXd gradient = known.program.df(result_.x) +
                              known.program.dg(result_.x).transpose() * result_.lambda -
                              result_.z_low + result_.z_high;
    EXPECT_NEAR(result_.stationarity, gradient.cwiseAbs().maxCoeff(), kSolution) << budget;
    EXPECT_NEAR(result_.objective, known.program.f(result_.x), kSolution) << budget;
  }
}

TEST_P(SolverProperties, AStartBeyondItsBoundsIsAsGoodAsAnother) {
  for (const double far : {-1e3, 1e3}) {
    Known known = Draw(5, 8, 3);
    DenseProgram moved(VectorXd::Constant(8, far), VectorXd(8), VectorXd(8), VectorXd(3),
                       VectorXd(3));
    VectorXd x_low(8), x_high(8), g_low(3), g_high(3);
    known.program.Bounds(x_low.data(), x_high.data(), g_low.data(), g_high.data());
    moved = DenseProgram(VectorXd::Constant(8, far), x_low, x_high, g_low, g_high);
    moved.is_quadratic = true;
    moved.f = known.program.f;
    moved.df = known.program.df;
    moved.g = known.program.g;
    moved.dg = known.program.dg;
    moved.h = known.program.h;
    solver_->Solve(moved, Tight(), &result_);
    ASSERT_TRUE(result_.usable()) << far << ": " << ToString(result_.status);
    EXPECT_LT((result_.x - known.x).cwiseAbs().maxCoeff(), kSolution) << far;
  }
}

TEST_P(SolverProperties, RowsThatContradictEachOtherAreNeverSolved) {
  DenseProgram p(Of({0, 0}), Of({-10, -10}), Of({10, 10}), Of({3, -kInfinity}), Of({kInfinity, 1}));
  p.is_quadratic = true;
  p.f = [](const VectorXd& x) { return x.squaredNorm(); };
  p.df = [](const VectorXd& x) { return VectorXd(2 * x); };
  p.g = [](const VectorXd& x) { return Of({x.sum(), x.sum()}); };
  p.dg = [](const VectorXd&) { return MatrixXd{{1, 1}, {1, 1}}; };
  p.h = [](const VectorXd&, double factor, const VectorXd&) {
    return MatrixXd(2 * factor * MatrixXd::Identity(2, 2));
  };
  solver_->Solve(p, Tight(), &result_);
  EXPECT_FALSE(result_.usable()) << ToString(result_.status);
  EXPECT_TRUE(result_.x.allFinite());
}

TEST_P(SolverProperties, WhatIsNotFiniteOrCannotBeEvaluatedIsNeverSolved) {
  for (int which = 0; which < 3; ++which) {
    Known known = Draw(7, 6, 2);
    const double nan = std::numeric_limits<double>::quiet_NaN();
    if (which == 0) known.program.f = [nan](const VectorXd&) { return nan; };
    if (which == 1)
      known.program.df = [nan](const VectorXd& x) { return VectorXd::Constant(x.size(), nan); };
    if (which == 2) known.program.g = [nan](const VectorXd&) { return VectorXd::Constant(2, nan); };
    solver_->Solve(known.program, Tight(), &result_);
    EXPECT_FALSE(result_.usable()) << which << ": " << ToString(result_.status);
    EXPECT_TRUE(result_.x.allFinite()) << which;
  }
}

TEST_P(SolverProperties, KeepsToItsBudgetAndItsDeadline) {
  Known known = Draw(9, 20, 6);
  SolveOptions o = Tight();
  o.max_iterations = 1;
  solver_->Solve(known.program, o, &result_);
  EXPECT_EQ(result_.status, SolveStatus::kIterationBudget);
  EXPECT_LE(result_.iterations, 1);
  EXPECT_TRUE(result_.x.allFinite());
  o = Tight();
  o.deadline_ns = std::chrono::steady_clock::now().time_since_epoch().count() - 1;
  solver_->Solve(known.program, o, &result_);
  EXPECT_EQ(result_.status, SolveStatus::kDeadline);
  EXPECT_FALSE(result_.usable());
}

TEST_P(SolverProperties, TheSameProgramGivesTheSameBitsWhateverCameBefore) {
  Known known = Draw(11, 10, 4), other = Draw(12, 15, 1);
  SolveResult first, again;
  GetParam().make()->Solve(known.program, Tight(), &first);
  SolveOptions late = Tight();
  late.deadline_ns = 1;
  solver_->Solve(other.program, Tight(), &again);
  solver_->Solve(other.program, late, &again);
  solver_->Solve(known.program, Tight(), &again);
  EXPECT_EQ(again.x, first.x);
  EXPECT_EQ(again.lambda, first.lambda);
  EXPECT_EQ(again.z_low, first.z_low);
  EXPECT_EQ(again.iterations, first.iterations);
}

INSTANTIATE_TEST_SUITE_P(Solvers, SolverProperties,
                         ::testing::Values(Method{"ipopt_fast", &MakeIpoptSolver, true},
                                           Method{"ipopt", &MakeIpoptSolver, false},
                                           Method{"the_factorys", &MakeSolver, true},
                                           Method{"active_set", &ActiveSetAlone, true},
                                           Method{"active_set_after_ipopt", &ActiveSetAfterIpopt,
                                                  true}),
                         [](const auto& method) { return std::string(method.param.name); });

}  // namespace
}  // namespace mantle::controller
