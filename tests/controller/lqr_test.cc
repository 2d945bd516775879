#include "controller/lqr.h"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <Eigen/QR>
#include <cmath>

#include "reduced/outputs.h"
#include "tests/controller/steered.h"
#include "tests/reduced/reduced_robots.h"

namespace mantle::controller {
namespace {

using Eigen::MatrixXd;
using tests::Steered;

MatrixXd RandomMatrix(int rows, int columns, unsigned seed) {
  const VectorX v = tests::RandomVector(rows * columns, seed);
  return Eigen::Map<const MatrixXd>(v.data(), rows, columns);
}

// P of one step further: Q + A^T (P - P B (R + B^T P B)^-1 B^T P) A.
MatrixXd Recursion(const MatrixXd& a, const MatrixXd& b, const MatrixXd& q, const MatrixXd& r,
                   const MatrixXd& p) {
  const MatrixXd pb = p * b;
  return q + a.transpose() * (p - pb * (r + b.transpose() * pb).ldlt().solve(pb.transpose())) * a;
}

TEST(Riccati, ScalarMatchesItsClosedForm) {
  const double a = 1.3, b = 0.7, q = 2.0, r = 0.5;
  const MatrixXd ma = MatrixXd::Constant(1, 1, a), mb = MatrixXd::Constant(1, 1, b);
  const MatrixXd mq = MatrixXd::Constant(1, 1, q), mr = MatrixXd::Constant(1, 1, r);
  // b^2 p^2 + (r (1 - a^2) - q b^2) p - q r = 0
  const double middle = r * (1 - a * a) - q * b * b;
  const double p = (-middle + std::sqrt(middle * middle + 4 * b * b * q * r)) / (2 * b * b);
  const Riccati solution = SolveRiccati(ma, mb, mq, mr, 8);
  constexpr double kRoundOff = 1e-12;
  EXPECT_NEAR(solution.value(0, 0), p, kRoundOff * p);
  EXPECT_NEAR(solution.gain(0, 0), b * p * a / (r + b * b * p), kRoundOff);
}

TEST(Riccati, DoublingsAreTheRecursion) {
  const MatrixXd a = 0.6 * RandomMatrix(6, 6, 1), b = RandomMatrix(6, 2, 2);
  const MatrixXd c = RandomMatrix(3, 6, 3), q = c.transpose() * c, r = MatrixXd::Identity(2, 2);
  MatrixXd p = MatrixXd::Zero(6, 6);
  for (int steps = 1, doublings = 0; doublings <= 4; steps *= 2, ++doublings) {
    p.setZero();
    for (int i = 0; i < steps; ++i) p = Recursion(a, b, q, r, p);
    constexpr double kRoundOff = 1e-11;
    EXPECT_LT((SolveRiccati(a, b, q, r, doublings).value - p).norm(), kRoundOff * p.norm())
        << steps;
  }
}

// An orthonormal basis of what the inputs reach: of the columns of [B, A B, A^2 B, ...], each
// scaled to one.
MatrixXd Reachable(const MatrixXd& a, const MatrixXd& b) {
  MatrixXd krylov(a.rows(), 2 * a.rows()), block = b;
  for (Eigen::Index i = 0; i < a.rows(); ++i) {
    for (Eigen::Index j = 0; j < 2; ++j) krylov.col(2 * i + j) = block.col(j).normalized();
    block = a * block;
  }
  Eigen::ColPivHouseholderQR<MatrixXd> qr(krylov);
  qr.setThreshold(1e-7);  // directions below are reached by round-off
  return MatrixXd(qr.householderQ()).leftCols(qr.rank());
}

class SteeringLqr : public ::testing::TestWithParam<bool> {
 protected:
  SteeringLqr()
      : steered_(GetParam() ? tests::SteeredTip() : tests::SteeredVehicle(tests::StraightPath())),
        directions_(PullDirections(steered_->model, steered_->reference.arm())),
        regulator_(steered_->model, steered_->step, steered_->options, steered_->reference,
                   directions_, BaselineGains{}) {}

  std::unique_ptr<Steered> steered_;
  Eigen::Matrix2Xd directions_;
  SteeringRegulator regulator_;
};

TEST_P(SteeringLqr, GainSettlesThoughSomeModesCannotBeControlled) {
  // 512 steps; what keeps growing in the value costs the gain digits.
  constexpr double kSettled = 1e-6;
  EXPECT_LT(regulator_.riccati().change, kSettled);
  const SteeringModel& m = regulator_.linear();
  const MatrixXd& p = regulator_.riccati().value;
  const MatrixXd residual = Recursion(m.a, m.b, m.q, m.r, p) - p;
  const MatrixXd z = Reachable(m.a, m.b);
  EXPECT_LT((z.transpose() * residual * z).norm(), kSettled * (z.transpose() * p * z).norm());
}

TEST_P(SteeringLqr, WhatCanBeControlledIsStable) {
  const SteeringModel& m = regulator_.linear();
  const MatrixXd z = Reachable(m.a, m.b);
  ASSERT_GT(z.cols(), 4);
  const MatrixXd closed = z.transpose() * (m.a - m.b * regulator_.riccati().gain) * z;
  const double radius = closed.eigenvalues().cwiseAbs().maxCoeff();
  EXPECT_LT(radius, 1.0);
  EXPECT_GT(radius, 0.0);
}

TEST_P(SteeringLqr, OneAxisDoesNotMoveTheOther) {
  // Four cables on a round arm: a quarter turn maps the problem onto itself, so that the gain on
  // the pulls themselves is a multiple of the identity.
  const MatrixXd own = regulator_.riccati().gain.rightCols(2);
  constexpr double kSymmetry = 1e-6;
  EXPECT_NEAR(own(0, 0), own(1, 1), kSymmetry * own(0, 0));
  EXPECT_LT(std::abs(own(0, 1)) + std::abs(own(1, 0)), kSymmetry * own(0, 0));
}

TEST_P(SteeringLqr, TheSteadyPullHoldsTheSteadyState) {
  const SteeringModel& m = regulator_.linear();
  const Steered& s = *steered_;
  const int n = s.model.velocity_count(), k = m.half(n);
  // 0.2 deg/s, or 1.4 mm of the tip: drag, quadratic, is not yet felt.
  const Vector2 demand = GetParam() ? Vector2(1.2e-3, -0.8e-3) : Vector2(3e-3, 1e-3);
  const VectorX steady = m.steady * demand;
  VectorX by = VectorX::Zero(2 * n);
  by.segment(6, n - 6) = steady.segment(6 - m.first, n - 6);
  by.tail(k) = steady.segment(k, k);
  ReducedState straight = InitialState(s.model), turning = straight;
  if (!GetParam()) straight.v(5) = tests::kSpeed_m_s;
  MoveState(straight, by, &turning);
  VectorX tensions = VectorX::Constant(s.model.input_count(), 0.02), pulled = tensions;
  AddPull(directions_, steady.tail<2>(), pulled);
  Propagator propagator(s.model, s.step);
  ReducedState straight_next = straight, turning_next = turning;
  ASSERT_TRUE(propagator.Step(straight, m.period_s, tensions, &straight_next, nullptr).ok);
  ASSERT_TRUE(propagator.Step(turning, m.period_s, pulled, &turning_next, nullptr).ok);
  VectorX now(2 * n), next(2 * n);
  StateDifference(straight, turning, now);
  StateDifference(straight_next, turning_next, next);
  // What drag leaves. A turn rate that is wrong by a tenth loses 7e-3 of the demand in this step.
  constexpr double kShare = 5e-3;
  const VectorX change = next - now;
  EXPECT_LT(change.segment(6, n - 6).norm(), kShare * now.segment(6, n - 6).norm());
  EXPECT_LT(change.segment<2>(n).norm(), kShare * demand.norm()) << "turn rate";
  EXPECT_GT(now.segment(6, n - 6).norm(), 0.01) << "the arm is bent [1/m]";
}

INSTANTIATE_TEST_SUITE_P(VehicleAndTip, SteeringLqr, ::testing::Bool(),
                         [](const auto& info) { return info.param ? "Tip" : "Vehicle"; });

}  // namespace
}  // namespace mantle::controller
