#include "controller/estimator.h"

#include <gtest/gtest.h>

#include <cmath>
#include <deque>
#include <limits>

#include "loop/plant_side/sensor_model.h"
#include "reduced/outputs.h"
#include "tests/controller/reduced_truth.h"
#include "tests/support/allocation_counter.h"

namespace mantle::controller {
namespace {

using tests::kPeriod_s;
using tests::Truth;

ModelEstimator Make(const Truth& truth, const EstimatorOptions& options = {},
                    const SensorOptions& sensors = {}) {
  return ModelEstimator(
      {truth.world.model, truth.world.step, options, sensors, truth.world.scene.control->motors});
}

double Error(const ReducedState& a, const ReducedState& b) {
  VectorX d(2 * a.v.size());
  StateDifference(a, b, d);
  return d.cwiseAbs().maxCoeff();
}

TEST(Estimator, DirectWithDelayIsTheTruthWhereTheModelIsExact) {
  Truth truth("steer.toml");
  EstimatorOptions options;
  options.disturbance = false;
  ModelEstimator estimator = Make(truth, options);
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
  EstimatorOptions options;
  options.gate = 0;  // it starts far from where it is found
  ModelEstimator estimator = Make(truth, options);
  estimator.Start(InitialState(truth.world.model));
  truth.Advance(truth.NoBias());
  estimator.Update(truth.state.time_s, truth.u, &truth.state);
  EXPECT_EQ(estimator.state().q, truth.state.q);
  EXPECT_EQ(estimator.state().v, truth.state.v);
  EXPECT_EQ(estimator.age_s(), 0.0);
}

TEST(Estimator, ADelayedMeasurementCorrectsAWrongStart) {
  Truth truth("steer.toml");
  EstimatorOptions options;
  options.disturbance = false;
  ModelEstimator estimator = Make(truth, options);
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
  // What is left of the noise where the model is exact, after two seconds; the filter allows for
  // a model that is not.
  constexpr double kMostShare = 0.5;
  Truth truth("steer.toml");
  const SensorOptions noise = tests::Noise();
  loop::SensorModel sensors(truth.world.model, noise);
  EstimatorOptions options;
  options.observer = true;
  ModelEstimator observer = Make(truth, options, noise);
  observer.Start(truth.state);
  const int n = truth.world.model.velocity_count();
  VectorX d(2 * n), raw = VectorX::Zero(2 * n), filtered = raw;
  for (int i = 0; i < 400; ++i) {
    truth.Advance(truth.NoBias());
    const auto measured = sensors.Measure(truth.state);
    observer.Update(truth.state.time_s, truth.u, &*measured);
    if (i < 200) continue;
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
  EXPECT_LT(share(n, 3), kMostShare) << "turn rate";
}

TEST(Estimator, AMeasurementThatIsNotFiniteIsIgnored) {
  for (const bool observer : {false, true}) {
    Truth truth("steer.toml");
    EstimatorOptions options;
    options.observer = observer;
    ModelEstimator estimator = Make(truth, options);
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

TEST(Estimator, CountsWhatBecameOfEveryMeasurement) {
  for (const bool observer : {false, true}) {
    Truth truth("steer.toml");
    EstimatorOptions options;
    options.observer = observer;
    ModelEstimator estimator = Make(truth, options);
    estimator.Start(truth.state);
    const ReducedState old = truth.state;
    constexpr int kPeriods = 20, kWild = 7, kBad = 9, kOld = 11;
    for (int i = 0; i < kPeriods; ++i) {
      truth.Advance(truth.NoBias());
      ReducedState measured = i == kOld ? old : truth.state;
      if (i == kWild) measured.q.array() += 5.0;
      if (i == kBad) measured.q(0) = std::numeric_limits<double>::infinity();
      estimator.Update(truth.state.time_s, truth.u, &measured);
    }
    const EstimatorCounters c = estimator.counters();
    EXPECT_EQ(c.refused, 1);
    EXPECT_EQ(c.useless, 2);
    EXPECT_EQ(c.taken, kPeriods - 3);
    EXPECT_EQ(c.restarts, 0);
    // The last measurement, or what a filter makes of steps that are solved to a tolerance.
    EXPECT_LT(Error(truth.state, estimator.state()), observer ? 1e-7 : 1e-9) << observer;
  }
}

TEST(Estimator, ObserverWithDelayAndLossesIsTheTruthWhereTheModelIsExact) {
  Truth truth("steer.toml");
  EstimatorOptions options;
  options.observer = true;
  options.disturbance = false;
  ModelEstimator estimator = Make(truth, options);
  estimator.Start(truth.state);
  std::deque<ReducedState> way = {truth.state};
  constexpr int kDelay = 2;
  constexpr double kRoundOff = 1e-5;  // of coordinates up to 10, by steps that are solved to 1e-10
  for (int i = 1; i <= 80; ++i) {
    truth.Advance(truth.NoBias());
    way.push_back(truth.state);
    // Some are lost, and for 0.3 s all are.
    const bool comes = i > kDelay && i % 7 != 0 && (i < 30 || i > 60);
    estimator.Update(truth.state.time_s, truth.u, comes ? &way[way.size() - 1 - kDelay] : nullptr);
    EXPECT_LT(Error(truth.state, estimator.state()), kRoundOff) << i;
    EXPECT_NEAR(estimator.state().time_s, truth.state.time_s, 1e-12);
  }
}

TEST(Estimator, AllocatesNothingAfterTheFirstSeconds) {
  if (!tests::kCountsAllocations) GTEST_SKIP() << "the allocator is a sanitizer's";
  for (const bool observer : {false, true}) {
    Truth truth("steer.toml");
    EstimatorOptions options;
    options.observer = observer;
    ModelEstimator estimator = Make(truth, options);
    estimator.Start(truth.state);
    ReducedState late = truth.state;
    for (int i = 0; i < 160; ++i) {
      late = truth.state;
      truth.Advance(truth.NoBias());
      const long before = tests::allocation_count;
      estimator.Update(truth.state.time_s, truth.u, i % 5 == 0 ? nullptr : &late);
      if (i > 130) {
        EXPECT_EQ(tests::allocation_count - before, 0) << i;
      }
    }
  }
}

TEST(Estimator, HasNoDisturbanceWhereItIsNotWanted) {
  Truth truth("steer.toml");
  EstimatorOptions off;
  off.disturbance = false;
  for (const bool observer : {false, true}) {
    off.observer = observer;
    ModelEstimator estimator = Make(truth, off);
    estimator.Start(truth.state);
    for (int i = 0; i < 20; ++i) {
      truth.Advance(VectorX::Constant(truth.u.size(), 0.05));
      estimator.Update(truth.state.time_s, truth.u, &truth.state);
    }
    EXPECT_EQ(estimator.disturbance().bias_n, truth.NoBias());
    EXPECT_EQ(estimator.disturbance().acceleration_m_s2, model::Vector3::Zero());
  }
}

}  // namespace
}  // namespace mantle::controller
