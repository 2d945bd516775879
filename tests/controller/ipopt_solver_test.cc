#include "controller/ipopt_solver.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/controller/dense_program.h"

namespace mantle::controller {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;
using tests::DenseProgram;
using tests::Of;

/// min (x - 1)^2 + (y - 2.5)^2 with five linear constraints (Nocedal & Wright, Numerical
/// Optimization, 2006, example 16.4): solution (1.4, 1.7), the first constraint active.
DenseProgram Nocedal() {
  DenseProgram p(Of({2, 0}), Of({0, 0}), Of({kInfinity, kInfinity}), Of({-2, -6, -2}),
                 Of({kInfinity, kInfinity, kInfinity}));
  p.is_quadratic = true;
  p.f = [](const VectorXd& x) { return std::pow(x(0) - 1, 2) + std::pow(x(1) - 2.5, 2); };
  p.df = [](const VectorXd& x) { return Of({2 * (x(0) - 1), 2 * (x(1) - 2.5)}); };
  const MatrixXd a{{1, -2}, {-1, -2}, {-1, 2}};
  p.g = [a](const VectorXd& x) { return VectorXd(a * x); };
  p.dg = [a](const VectorXd&) { return a; };
  p.h = [](const VectorXd&, double factor, const VectorXd&) {
    return MatrixXd(2 * factor * MatrixXd::Identity(2, 2));
  };
  return p;
}

/// W. Hock, K. Schittkowski, Test Examples for Nonlinear Programming Codes, 1981, problem 71.
DenseProgram HockSchittkowski71() {
  DenseProgram p(Of({1, 5, 5, 1}), VectorXd::Constant(4, 1.0), VectorXd::Constant(4, 5.0),
                 Of({25, 40}), Of({kInfinity, 40}));
  p.f = [](const VectorXd& x) { return x(0) * x(3) * (x(0) + x(1) + x(2)) + x(2); };
  p.df = [](const VectorXd& x) {
    const double sum = x(0) + x(1) + x(2);
    return Of({x(3) * (sum + x(0)), x(0) * x(3), x(0) * x(3) + 1, x(0) * sum});
  };
  p.g = [](const VectorXd& x) { return Of({x.prod(), x.squaredNorm()}); };
  p.dg = [](const VectorXd& x) {
    MatrixXd j(2, 4);
    for (int i = 0; i < 4; ++i) j(0, i) = x.prod() / x(i);
    j.row(1) = 2 * x.transpose();
    return j;
  };
  p.h = [](const VectorXd& x, double factor, const VectorXd& lambda) {
    MatrixXd m = MatrixXd::Zero(4, 4);
    m(0, 0) = factor * 2 * x(3);
    m(1, 0) = m(2, 0) = factor * x(3);
    m(3, 0) = factor * (2 * x(0) + x(1) + x(2));
    m(3, 1) = m(3, 2) = factor * x(0);
    for (int i = 0; i < 4; ++i) {
      for (int j = 0; j < i; ++j) m(i, j) += lambda(0) * x.prod() / (x(i) * x(j));
      m(i, i) += 2 * lambda(1);
    }
    return m;
  };
  return p;
}

SolveOptions Tight() {
  SolveOptions o;
  o.tolerance = 1e-9;
  o.max_iterations = 100;
  return o;
}

constexpr double kSolution = 1e-6;  // of programs solved to 1e-9 with curvatures of order one

TEST(IpoptSolver, SolvesAQuadraticProgram) {
  DenseProgram p = Nocedal();
  SolveResult r;
  MakeIpoptSolver()->Solve(p, Tight(), &r);
  EXPECT_EQ(r.status, SolveStatus::kSolved) << ToString(r.status);
  EXPECT_NEAR(r.x(0), 1.4, kSolution);
  EXPECT_NEAR(r.x(1), 1.7, kSolution);
  EXPECT_NEAR(r.objective, 0.8, kSolution);
  EXPECT_NEAR(r.lambda(0), -0.8, kSolution);  // 2 (x - 1) = -lambda, of f + lambda g
  EXPECT_GT(r.iterations, 0);
}

TEST(IpoptSolver, SolvesHockSchittkowski71WithBothSetsOfOptions) {
  const VectorXd published = Of({1.0, 4.74299963, 3.82114998, 1.37940829});
  for (bool fast : {true, false}) {
    DenseProgram p = HockSchittkowski71();
    SolveOptions o = Tight();
    o.fast = fast;
    SolveResult r;
    MakeIpoptSolver()->Solve(p, o, &r);
    EXPECT_EQ(r.status, SolveStatus::kSolved) << ToString(r.status);
    EXPECT_LT((r.x - published).cwiseAbs().maxCoeff(), kSolution);
    EXPECT_NEAR(r.objective, 17.0140173, kSolution);
  }
}

TEST(IpoptSolver, MultipliersAndResidualsSatisfyTheOptimalityConditions) {
  DenseProgram p = HockSchittkowski71();
  SolveResult r;
  MakeIpoptSolver()->Solve(p, Tight(), &r);
  const VectorXd lagrangian = p.df(r.x) + p.dg(r.x).transpose() * r.lambda - r.z_low + r.z_high;
  EXPECT_LT(lagrangian.cwiseAbs().maxCoeff(), kSolution);
  EXPECT_GE(r.z_low.minCoeff(), 0.0);
  EXPECT_GE(r.z_high.minCoeff(), 0.0);
  EXPECT_GT(r.z_low(0), 1.0) << "x_0 >= 1 is active";
  for (double residual : {r.stationarity, r.infeasibility, r.complementarity}) {
    EXPECT_GE(residual, 0.0);
    EXPECT_LT(residual, kSolution);
  }
}

TEST(IpoptSolver, StopsAtTheIterationBudget) {
  DenseProgram p = HockSchittkowski71();
  SolveOptions o = Tight();
  o.max_iterations = 2;
  SolveResult r;
  MakeIpoptSolver()->Solve(p, o, &r);
  EXPECT_EQ(r.status, SolveStatus::kIterationBudget);
  EXPECT_EQ(ToString(r.status), "stopped by the iteration budget");
  EXPECT_EQ(r.iterations, 2);
  EXPECT_TRUE(r.x.allFinite());
  EXPECT_FALSE(r.usable());
  EXPECT_GT(std::max({r.stationarity, r.infeasibility, r.complementarity}), 1e-6)
      << "an unfinished iterate does not look solved";
}

TEST(IpoptSolver, StopsAtADeadlineThatHasPassed) {
  DenseProgram p = HockSchittkowski71();
  SolveOptions o = Tight();
  o.deadline_ns = 1;
  SolveResult r;
  MakeIpoptSolver()->Solve(p, o, &r);
  EXPECT_EQ(r.status, SolveStatus::kDeadline);
  EXPECT_EQ(ToString(r.status), "stopped by the deadline");
  EXPECT_EQ(r.iterations, 0);
  EXPECT_FALSE(r.usable());
}

TEST(IpoptSolver, SaysThatAProgramIsInfeasible) {
  DenseProgram p(Of({0.0, 0.0}), Of({-10, -10}), Of({10, 10}), Of({3, -kInfinity}),
                 Of({kInfinity, 1}));
  p.f = [](const VectorXd& x) { return x.squaredNorm(); };
  p.df = [](const VectorXd& x) { return VectorXd(2 * x); };
  p.g = [](const VectorXd& x) { return Of({x.sum(), x.sum() + 0.1 * x(0) * x(0)}); };
  p.dg = [](const VectorXd& x) { return MatrixXd{{1, 1}, {1 + 0.2 * x(0), 1}}; };
  p.h = [](const VectorXd&, double factor, const VectorXd& lambda) {
    MatrixXd m = 2 * factor * MatrixXd::Identity(2, 2);
    m(0, 0) += 0.2 * lambda(1);
    return m;
  };
  SolveResult r;
  MakeIpoptSolver()->Solve(p, Tight(), &r);
  EXPECT_EQ(r.status, SolveStatus::kInfeasible) << ToString(r.status);
  EXPECT_EQ(ToString(SolveStatus::kInfeasible), "no feasible point near by");
  EXPECT_TRUE(r.x.allFinite());
}

TEST(IpoptSolver, SaysThatAFunctionIsNotFinite) {
  for (const bool throughout : {true, false}) {
    DenseProgram p = Nocedal();
    const auto f = p.f;
    // finite at the start alone, or nowhere
    p.f = [f, throughout](const VectorXd& x) {
      return throughout || (x - Of({2, 0})).norm() > 1e-3 ? std::numeric_limits<double>::quiet_NaN()
                                                          : f(x);
    };
    SolveResult r;
    MakeIpoptSolver()->Solve(p, Tight(), &r);
    EXPECT_FALSE(r.usable()) << ToString(r.status);
    EXPECT_TRUE(r.x.allFinite());
    if (throughout) {
      EXPECT_EQ(r.status, SolveStatus::kBadNumber) << ToString(r.status);
      EXPECT_EQ(ToString(r.status), "a function was not finite");
    }
  }
}

TEST(IpoptSolver, SaysThatIteratesDivergeOrTheBudgetEndsOnAnUnboundedProgram) {
  DenseProgram p(Of({0}), Of({-kInfinity}), Of({kInfinity}), VectorXd(0), VectorXd(0));
  p.f = [](const VectorXd& x) { return -x(0); };
  p.df = [](const VectorXd&) { return Of({-1}); };
  p.g = [](const VectorXd&) { return VectorXd(0); };
  p.dg = [](const VectorXd&) { return MatrixXd(0, 1); };
  p.h = [](const VectorXd&, double, const VectorXd&) { return MatrixXd(MatrixXd::Zero(1, 1)); };
  SolveResult r;
  MakeIpoptSolver()->Solve(p, Tight(), &r);
  EXPECT_TRUE(r.status == SolveStatus::kDiverging || r.status == SolveStatus::kIterationBudget)
      << ToString(r.status);
}

TEST(IpoptSolver, WhatWasSolvedBeforeLeavesNoTrace) {
  // Another program, a failure and other options go before; then the bits are those of a new
  // solver.
  for (bool fast : {true, false}) {
    SolveOptions o = Tight();
    o.fast = fast;
    DenseProgram p = HockSchittkowski71();
    SolveResult first, again;
    MakeIpoptSolver()->Solve(p, o, &first);
    auto used = MakeIpoptSolver();
    SolveOptions other = Tight();
    other.fast = !fast;
    other.deadline_ns = 1;
    other.initial_barrier = 0.1;
    DenseProgram q = Nocedal();
    used->Solve(p, other, &again);
    other.deadline_ns = 0;
    used->Solve(q, other, &again);
    ASSERT_TRUE(again.usable());
    used->Solve(p, o, &again);
    EXPECT_EQ(again.status, first.status);
    EXPECT_EQ(again.iterations, first.iterations);
    EXPECT_EQ(again.x, first.x);
    EXPECT_EQ(again.lambda, first.lambda);
  }
}

}  // namespace
}  // namespace mantle::controller
