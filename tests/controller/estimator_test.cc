#include "controller/estimator.h"

#include <gtest/gtest.h>

#include <cmath>
#include <deque>
#include <limits>

#include "controller/sensors.h"
#include "reduced/outputs.h"
#include "tests/controller/control_scene.h"

namespace mantle::controller {
namespace {

using tests::ControlScene;

constexpr double kPeriod_s = 0.01;

/// The reduced model itself as the truth, pulled by tensions that vary.
struct Truth {
  explicit Truth(const std::string& scene)
      : world(scene), state(world.Start(0.0)), next(state), u(world.model.input_count()) {}

  /// One period; u are the tensions pulled during it, plus `bias` that nobody is told of.
  void Advance(const VectorX& bias, double h = kPeriod_s) {
    for (Eigen::Index i = 0; i < u.size(); ++i) {
      u(i) = 0.2 + 0.1 * std::sin(3 * state.time_s + static_cast<double>(i));
    }
    EXPECT_TRUE(world.propagator.Step(state, h, u + bias, &next, nullptr).ok);
    next.time_s = state.time_s + h;
    std::swap(state, next);
  }
  VectorX NoBias() const { return VectorX::Zero(u.size()); }

  ControlScene world;
  ReducedState state, next;
  VectorX u;
};

double Error(const ReducedState& a, const ReducedState& b) {
  VectorX d(2 * a.v.size());
  StateDifference(a, b, d);
  return d.cwiseAbs().maxCoeff();
}

TEST(Estimator, DirectWithDelayIsTheTruthWhereTheModelIsExact) {
  Truth truth("steer.toml");
  model::EstimatorOptions options;
  Estimator estimator(truth.world.model, truth.world.step, options);
  estimator.Start(truth.state);
  std::deque<ReducedState> way = {truth.state};
  constexpr int kDelay = 4;
  // The same steps from the same states: what differs is round-off of the times.
  constexpr double kRoundOff = 1e-9;
  for (int i = 1; i <= 60; ++i) {
    truth.Advance(truth.NoBias());
    way.push_back(truth.state);
    const bool comes = i > kDelay && i % 7 != 0;  // some are lost
    estimator.Update(truth.state.time_s, truth.u, comes ? &way[way.size() - 1 - kDelay] : nullptr);
    EXPECT_LT(Error(truth.state, estimator.state()), kRoundOff) << i;
    EXPECT_NEAR(estimator.state().time_s, truth.state.time_s, 1e-12);
    if (comes) {
      EXPECT_NEAR(estimator.age_s(), kDelay * kPeriod_s, 1e-9);
    }
  }
}

TEST(Estimator, DirectTakesAFreshMeasurementAsItIs) {
  Truth truth("reach.toml");
  Estimator estimator(truth.world.model, truth.world.step, {});
  estimator.Start(InitialState(truth.world.model));
  truth.Advance(truth.NoBias());
  estimator.Update(truth.state.time_s, truth.u, &truth.state);
  EXPECT_EQ(estimator.state().q, truth.state.q);
  EXPECT_EQ(estimator.state().v, truth.state.v);
  EXPECT_EQ(estimator.age_s(), 0.0);
}

TEST(Estimator, ADelayedMeasurementCorrectsAWrongStart) {
  Truth truth("steer.toml");
  Estimator estimator(truth.world.model, truth.world.step, {});
  ReducedState wrong = InitialState(truth.world.model);
  wrong.time_s = truth.state.time_s;
  estimator.Start(wrong);
  std::deque<ReducedState> way = {truth.state};
  for (int i = 1; i <= 3; ++i) {
    truth.Advance(truth.NoBias());
    way.push_back(truth.state);
    estimator.Update(truth.state.time_s, truth.u, nullptr);
  }
  EXPECT_GT(Error(truth.state, estimator.state()), 1e-2);
  truth.Advance(truth.NoBias());
  estimator.Update(truth.state.time_s, truth.u, &way[1]);
  EXPECT_LT(Error(truth.state, estimator.state()), 1e-9);
}

TEST(Estimator, ObserverReducesNoiseAndFollows) {
  // White noise through a first-order filter of gain g keeps sqrt(g / (2 - g)) of it, 0.42 at 0.3;
  // the rest allows for rates that the model feeds into the coordinates.
  constexpr double kMostShare = 0.6;
  Truth truth("steer.toml");
  model::SensorOptions noise;
  noise.position_m = 2e-3;
  noise.attitude_rad = 5e-3;
  noise.velocity_m_s = 5e-3;
  noise.angular_velocity_rad_s = 2e-2;
  noise.strain = 0.1;
  noise.strain_rate = 0.2;
  noise.mantle = noise.mantle_rate = 0.02;
  Sensors sensors(truth.world.model, noise);
  model::EstimatorOptions options;
  options.observer = true;
  options.gain = 0.3;
  Estimator observer(truth.world.model, truth.world.step, options);
  observer.Start(truth.state);
  const int n = truth.world.model.velocity_count();
  VectorX d(2 * n), raw = VectorX::Zero(2 * n), filtered = raw;
  for (int i = 0; i < 400; ++i) {
    truth.Advance(truth.NoBias());
    const auto measured = sensors.Measure(truth.state);
    observer.Update(truth.state.time_s, truth.u, &*measured);
    StateDifference(truth.state, *measured, d);
    raw += d.cwiseAbs2();
    StateDifference(truth.state, observer.state(), d);
    filtered += d.cwiseAbs2();
  }
  const auto share = [&](Eigen::Index at, Eigen::Index size) {
    return std::sqrt(filtered.segment(at, size).sum() / raw.segment(at, size).sum());
  };
  EXPECT_LT(share(3, 3), kMostShare) << "position";
  EXPECT_LT(share(0, 3), kMostShare) << "attitude";
  EXPECT_LT(share(6, truth.world.model.arms[0].size()), kMostShare) << "strains";
  EXPECT_LT(share(n + 3, 3), kMostShare) << "velocity";
}

TEST(Estimator, AMeasurementThatIsNotFiniteIsIgnored) {
  for (const bool observer : {false, true}) {
    Truth truth("steer.toml");
    model::EstimatorOptions options;
    options.observer = observer;
    Estimator estimator(truth.world.model, truth.world.step, options);
    estimator.Start(truth.state);
    for (int i = 0; i < 5; ++i) {
      truth.Advance(truth.NoBias());
      ReducedState bad = truth.state;
      switch (i) {
        case 0:
          bad.q(3) = std::numeric_limits<double>::quiet_NaN();
          break;
        case 1:
          bad.v(0) = std::numeric_limits<double>::infinity();
          break;
        case 2:
          bad.root.position.z() = std::numeric_limits<double>::quiet_NaN();
          break;
        default:
          bad.root.rotation.coeffs().setConstant(std::numeric_limits<double>::quiet_NaN());
      }
      estimator.Update(truth.state.time_s, truth.u, &bad);
      EXPECT_NEAR(estimator.age_s(), (i + 1) * kPeriod_s, 1e-9);
    }
    // The model goes on in its place.
    EXPECT_LT(Error(truth.state, estimator.state()), 1e-9) << observer;
  }
}

class BiasOf : public testing::TestWithParam<int> {};
INSTANTIATE_TEST_SUITE_P(Motors, BiasOf, testing::Values(0, 1, 3));

TEST_P(BiasOf, AMotorIsFoundWithinSomeTimeConstants) {
  Truth truth("steer.toml");
  const model::EstimatorOptions options = truth.world.scene.control->estimator;
  BiasEstimator estimator(truth.world.model, truth.world.step, options,
                          truth.world.scene.control->motors);
  estimator.Start(truth.state);
  VectorX bias = truth.NoBias();
  bias(GetParam()) = 0.05;
  constexpr double kControl_s = 0.1;
  // After eight time constants exp(-8) of the error is left. The motors on opposite cables share
  // what only stretches the arm, and regularisation keeps a trace of that.
  const int periods = static_cast<int>(std::lround(8 * options.disturbance_time_s / kControl_s));
  for (int i = 0; i < periods; ++i) {
    truth.Advance(bias, kControl_s);
    estimator.Update(truth.state, truth.u);
  }
  constexpr double kNear_n = 5e-3;
  EXPECT_LT((estimator.bias() - bias).cwiseAbs().maxCoeff(), kNear_n)
      << estimator.bias().transpose();
}

TEST(BiasEstimator, FindsNothingWhereNothingIs) {
  Truth truth("steer.toml");
  BiasEstimator estimator(truth.world.model, truth.world.step, {},
                          truth.world.scene.control->motors);
  estimator.Start(truth.state);
  for (int i = 0; i < 20; ++i) {
    truth.Advance(truth.NoBias(), 0.1);
    estimator.Update(truth.state, truth.u);
  }
  EXPECT_LT(estimator.bias().cwiseAbs().maxCoeff(), 1e-6);  // N: steps are solved to 1e-10
}

TEST(BiasEstimator, StaysWithinHalfAMotorsRangeAndOffWhereItIsNotWanted) {
  Truth truth("steer.toml");
  const auto& motors = truth.world.scene.control->motors;
  model::EstimatorOptions off;
  off.disturbance = false;
  BiasEstimator estimator(truth.world.model, truth.world.step, {}, motors);
  BiasEstimator none(truth.world.model, truth.world.step, off, motors);
  estimator.Start(truth.state);
  none.Start(truth.state);
  VectorX bias = truth.NoBias();
  bias(1) = 1.0;
  for (int i = 0; i < 30; ++i) {
    truth.Advance(bias, 0.1);
    estimator.Update(truth.state, truth.u);
    none.Update(truth.state, truth.u);
  }
  EXPECT_NEAR(estimator.bias()(1), 0.5 * motors[1].max_tension_n, 1e-12);
  for (Eigen::Index i = 0; i < bias.size(); ++i) {
    EXPECT_LE(std::abs(estimator.bias()(i)), 0.5 * motors[i].max_tension_n);
  }
  EXPECT_EQ(none.bias(), truth.NoBias());
}

}  // namespace
}  // namespace mantle::controller
