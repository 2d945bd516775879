#include "controller/state_filter.h"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <Eigen/LU>

#include "loop/plant_side/sensor_model.h"
#include "reduced/outputs.h"
#include "tests/controller/reduced_truth.h"

namespace mantle::controller {
namespace {

using tests::kPeriod_s;
using tests::Noise;
using tests::Truth;

/// As scenes have it.
const double kGate = EstimatorOptions{}.gate;

StateFilter MakeFilter(const Truth& truth, const EstimatorOptions& options = {},
                       const SensorOptions& sensors = {}) {
  return {truth.world.model, truth.world.step, options, sensors, truth.world.scene.control->motors};
}

/// Cables that alternate around a straight arm do nothing, and no measurement can tell them.
VectorX WithoutAlternation(VectorX bias) {
  VectorX alternating = VectorX::Zero(bias.size());
  alternating.tail(4) << 0.5, -0.5, 0.5, -0.5;
  bias -= alternating.dot(bias) * alternating;
  return bias;
}

TEST(StateFilter, CovarianceIsCarriedByTheModelsDerivatives) {
  Truth truth("steer.toml");
  EstimatorOptions sure;
  sure.model_noise = 1e-6;
  sure.tension_walk_n = sure.acceleration_walk_m_s2 = 0;
  StateFilter filter = MakeFilter(truth, sure);
  filter.Start(truth.state);
  const Eigen::MatrixXd before = filter.covariance();
  const int n = static_cast<int>(2 * truth.state.v.size()),
            motors = static_cast<int>(truth.u.size());
  // A by central differences, of steps that are solved to 1e-10.
  constexpr double kStep = 1e-5, kNear = 5e-4;
  Eigen::MatrixXd a = Eigen::MatrixXd::Identity(n + motors + 3, n + motors + 3);
  ReducedState base = truth.state, moved = base, up = base, down = base;
  ASSERT_TRUE(truth.world.propagator.Step(truth.state, kPeriod_s, truth.u, &base, nullptr).ok);
  VectorX by(n), plus(n), minus(n);
  for (int j = 0; j < n + motors + 3; ++j) {
    for (const int sign : {1, -1}) {
      by.setZero();
      VectorX u = truth.u;
      Disturbance d(motors);
      if (j < n) {
        by(j) = sign * kStep;
      } else if (j < n + motors) {
        u(j - n) += sign * kStep;
      } else {
        d.acceleration_m_s2(j - n - motors) = sign * kStep;
      }
      MoveState(truth.state, by, &moved);
      moved.time_s = truth.state.time_s;
      truth.world.propagator.SetDisturbance(d);
      ASSERT_TRUE(truth.world.propagator.Step(moved, kPeriod_s, u, &up, nullptr).ok);
      StateDifference(base, up, sign > 0 ? plus : minus);
    }
    a.block(0, j, n, 1) = (plus - minus) / (2 * kStep);
  }
  filter.Predict(truth.state.time_s + kPeriod_s, truth.u);
  const Eigen::MatrixXd expected = a * before * a.transpose(), after = filter.covariance();
  const VectorX size = after.diagonal().cwiseSqrt();
  const Eigen::MatrixXd error =
      size.cwiseInverse().asDiagonal() * (after - expected) * size.cwiseInverse().asDiagonal();
  EXPECT_LT(error.cwiseAbs().maxCoeff(), kNear);
}

TEST(StateFilter, NoiseOfTheModelEntersRatesAndDisturbances) {
  Truth truth("steer.toml");
  const int n = static_cast<int>(truth.state.v.size()), motors = static_cast<int>(truth.u.size());
  const auto variances = [&](double model_noise, double walk) {
    EstimatorOptions options;
    options.model_noise = model_noise;
    options.tension_walk_n = options.acceleration_walk_m_s2 = walk;
    StateFilter filter = MakeFilter(truth, options);
    filter.Start(truth.state);
    filter.Predict(truth.state.time_s + kPeriod_s, truth.u);
    return VectorX(filter.covariance().diagonal());
  };
  const VectorX sure = variances(1e-9, 0), once = variances(1, 0.1), twice = variances(2, 0.2);
  const VectorX added = once - sure, more = twice - sure;
  constexpr double kRoundOff = 1e-9;
  EXPECT_LT(added.head(n).cwiseAbs().maxCoeff(), kRoundOff) << "places";
  EXPECT_GT(added.tail(n + motors + 3).minCoeff(), 0.0) << "rates, tensions, acceleration";
  EXPECT_LT((more - 4 * added).cwiseAbs().maxCoeff(), kRoundOff * more.maxCoeff());
  EXPECT_NEAR(added(2 * n), kPeriod_s * 0.01, kRoundOff);
}

TEST(StateFilter, ACorrectionIsKalmans) {
  Truth truth("steer.toml");
  const SensorOptions noise = Noise();
  StateFilter filter = MakeFilter(truth, {}, noise);
  filter.Start(truth.state);
  const int n = static_cast<int>(2 * truth.state.v.size());
  // At the start the covariance of the state is that of a measurement.
  const VectorX r = filter.covariance().diagonal().head(n);
  filter.Predict(truth.state.time_s + kPeriod_s, truth.u);
  const Eigen::MatrixXd p = filter.covariance();
  VectorX innovation(n);
  for (int i = 0; i < n; ++i) innovation(i) = 1e-3 * std::sin(1.0 + i);
  ReducedState measured = filter.state();
  MoveState(filter.state(), innovation, &measured);
  const ReducedState before = filter.state();
  filter.Correct(measured);
  Eigen::MatrixXd s = p.topLeftCorner(n, n);
  s.diagonal() += r;
  const Eigen::MatrixXd gain = p.leftCols(n) * s.inverse();
  const VectorX change = gain * innovation;
  VectorX moved(n);
  StateDifference(before, filter.state(), moved);
  constexpr double kRoundOff = 1e-8;  // of an inverse with a condition of 1e6
  EXPECT_LT((moved - change.head(n)).cwiseAbs().maxCoeff(), kRoundOff);
  EXPECT_LT((filter.disturbance().bias_n - change.segment(n, truth.u.size())).cwiseAbs().maxCoeff(),
            kRoundOff);
  EXPECT_LT((filter.disturbance().acceleration_m_s2 - change.tail<3>()).cwiseAbs().maxCoeff(),
            kRoundOff);
  const Eigen::MatrixXd after = p - gain * p.topRows(n);
  EXPECT_LT((filter.covariance() - after).cwiseAbs().maxCoeff(),
            kRoundOff * p.diagonal().maxCoeff());
}

TEST(StateFilter, IsNotSurerThanItIsRight) {
  // Errors over their deviations: their mean square is one where the filter is right, less where
  // it allows for a model that is worse than this one.
  Truth truth("steer.toml");
  const SensorOptions noise = Noise();
  StateFilter filter = MakeFilter(truth, {}, noise);
  loop::SensorModel sensors(truth.world.model, noise);
  filter.Start(truth.state);
  const int n = static_cast<int>(2 * truth.state.v.size());
  VectorX error(n), squares = VectorX::Zero(n);
  constexpr int kPeriods = 400;
  for (int i = 0; i < kPeriods; ++i) {
    truth.Advance(truth.NoBias());
    filter.Predict(truth.state.time_s, truth.u);
    filter.Correct(*sensors.Measure(truth.state));
    StateDifference(filter.state(), truth.state, error);
    squares += error.cwiseAbs2().cwiseQuotient(filter.covariance().diagonal().head(n)) / kPeriods;
  }
  EXPECT_LT(squares.mean(), 1.0) << squares.transpose();
  EXPECT_LT(squares.maxCoeff(), 3.0) << squares.transpose();
  const Eigen::MatrixXd& p = filter.covariance();
  const VectorX size = p.diagonal().cwiseSqrt();
  const Eigen::MatrixXd scaled =
      size.cwiseInverse().asDiagonal() * p * size.cwiseInverse().asDiagonal();
  EXPECT_GT(Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(scaled).eigenvalues().minCoeff(), -1e-9);
}

class BiasOf : public testing::TestWithParam<int> {};
INSTANTIATE_TEST_SUITE_P(Motors, BiasOf, testing::Values(0, 1, 3));

TEST_P(BiasOf, AMotorIsFoundInSomeSeconds) {
  Truth truth("steer.toml");
  StateFilter filter = MakeFilter(truth);
  filter.Start(truth.state);
  VectorX bias = truth.NoBias();
  bias(GetParam()) = 0.05;
  for (int i = 0; i < 1000; ++i) {
    truth.Advance(bias);
    filter.Predict(truth.state.time_s, truth.u);
    filter.Correct(truth.state);
  }
  constexpr double kNear_n = 5e-3;  // a tenth
  const VectorX error = WithoutAlternation(filter.disturbance().bias_n - bias);
  EXPECT_LT(error.cwiseAbs().maxCoeff(), kNear_n) << filter.disturbance().bias_n.transpose();
}

TEST(StateFilter, FindsAnAccelerationOfTheRoot) {
  Truth truth("steer.toml");
  EstimatorOptions options;
  options.model_noise = 0.2;  // else the noise of the root's velocity explains most of it
  StateFilter filter = MakeFilter(truth, options);
  filter.Start(truth.state);
  Disturbance d(static_cast<int>(truth.u.size()));
  d.acceleration_m_s2 = {0, 0, -5e-3};
  truth.world.propagator.SetDisturbance(d);
  for (int i = 0; i < 2000; ++i) {
    truth.Advance(truth.NoBias());
    filter.Predict(truth.state.time_s, truth.u);
    filter.Correct(truth.state);
  }
  constexpr double kNear_m_s2 = 1e-3;  // a fifth: it shares with the tensions' bias
  EXPECT_LT((filter.disturbance().acceleration_m_s2 - d.acceleration_m_s2).norm(), kNear_m_s2)
      << filter.disturbance().acceleration_m_s2.transpose();
}

class CurrentOf : public testing::TestWithParam<const char*> {};
INSTANTIATE_TEST_SUITE_P(Roots, CurrentOf, testing::Values("steer.toml", "reach.toml"));

TEST_P(CurrentOf, TheWaterIsFoundBesideTheTensionsBias) {
  Truth truth(GetParam());
  EstimatorOptions options;
  options.current = true;
  StateFilter filter = MakeFilter(truth, options);
  filter.Start(truth.state);
  Disturbance d(static_cast<int>(truth.u.size()));
  d.current_m_s = {0.03, 0.05, 0.01};
  truth.world.propagator.SetDisturbance(d);
  for (int i = 0; i < 1500; ++i) {
    truth.Advance(truth.NoBias());
    filter.Predict(truth.state.time_s, truth.u);
    filter.Correct(truth.state);
  }
  constexpr double kNear_m_s = 5e-3;
  EXPECT_LT((filter.disturbance().current_m_s - d.current_m_s).norm(), kNear_m_s)
      << filter.disturbance().current_m_s.transpose();
  EXPECT_EQ(filter.refused(), 0);
}

ReducedState Wild(const ReducedState& state) {
  ReducedState wild = state;
  wild.q.array() += 5.0;
  return wild;
}

TEST(StateFilter, TheGateRefusesOneWildMeasurementAndTakesTheNext) {
  Truth truth("steer.toml");
  EstimatorOptions options, open;
  open.gate = 0;
  options.gate = kGate;
  StateFilter filter = MakeFilter(truth, options, Noise()),
              without = MakeFilter(truth, open, Noise());
  loop::SensorModel sensors(truth.world.model, Noise());
  filter.Start(truth.state);
  without.Start(truth.state);
  for (int i = 0; i < 100; ++i) {
    truth.Advance(truth.NoBias());
    filter.Predict(truth.state.time_s, truth.u);
    without.Predict(truth.state.time_s, truth.u);
    const ReducedState good = *sensors.Measure(truth.state);
    EXPECT_EQ(filter.Correct(i == 50 ? Wild(good) : good), i != 50) << i;
    without.Correct(i == 50 ? Wild(good) : good);
  }
  EXPECT_EQ(filter.refused(), 1);
  EXPECT_EQ(filter.restarts(), 0);
  EXPECT_LT((filter.state().q - truth.state.q).norm(),
            0.1 * (without.state().q - truth.state.q).norm());
}

TEST(StateFilter, AGateThatHadRefusedForTooLongOpensAgain) {
  Truth truth("steer.toml");
  EstimatorOptions options;
  options.gate = kGate;
  StateFilter filter = MakeFilter(truth, options);
  filter.Start(truth.state);
  // The whole vehicle is found elsewhere, and stays there.
  const model::Vector3 away(0, 0, 1);
  int taken = 0;
  for (int i = 0; i < 3 * StateFilter::kMostRefused; ++i) {
    truth.Advance(truth.NoBias());
    filter.Predict(truth.state.time_s, truth.u);
    ReducedState measured = truth.state;
    measured.root.position += away;
    taken += filter.Correct(measured) ? 1 : 0;
    EXPECT_EQ(taken > 0, i >= StateFilter::kMostRefused) << i;
  }
  EXPECT_EQ(filter.restarts(), 1);
  EXPECT_EQ(taken, 2 * StateFilter::kMostRefused);
  EXPECT_LT((filter.state().root.position - truth.state.root.position - away).norm(), 1e-3);
  const Eigen::MatrixXd& p = filter.covariance();
  EXPECT_LT((p - p.transpose()).norm(), 1e-9 * p.norm());
}

TEST(StateFilter, FindsNothingWhereNothingIs) {
  Truth truth("steer.toml");
  StateFilter filter = MakeFilter(truth);
  filter.Start(truth.state);
  for (int i = 0; i < 200; ++i) {
    truth.Advance(truth.NoBias());
    filter.Predict(truth.state.time_s, truth.u);
    filter.Correct(truth.state);
  }
  EXPECT_LT(filter.disturbance().bias_n.cwiseAbs().maxCoeff(), 1e-6);
  EXPECT_LT(filter.disturbance().acceleration_m_s2.norm(), 1e-6);
}

TEST(StateFilter, ABiasStaysWithinHalfAMotorsRange) {
  Truth truth("steer.toml");
  StateFilter filter = MakeFilter(truth);
  filter.Start(truth.state);
  const auto& motors = truth.world.scene.control->motors;
  VectorX bias = truth.NoBias();
  bias(1) = 1.0;
  for (int i = 0; i < 3000; ++i) {
    truth.Advance(bias);
    filter.Predict(truth.state.time_s, truth.u);
    filter.Correct(truth.state);
    for (Eigen::Index m = 0; m < bias.size(); ++m) {
      ASSERT_LE(std::abs(filter.disturbance().bias_n(m)), 0.5 * motors[m].max_tension_n);
    }
  }
  EXPECT_GT(filter.disturbance().bias_n(1), 0.3 * motors[1].max_tension_n);
}

}  // namespace
}  // namespace mantle::controller
