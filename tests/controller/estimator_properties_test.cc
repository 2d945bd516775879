#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "controller/registry.h"
#include "reduced/outputs.h"
#include "tests/controller/reduced_truth.h"

// What every Estimator promises (controller/estimator.h): the same suite over all that are
// registered, each as it takes measurements and as it filters them, on a free and a clamped robot.

namespace mantle::controller {
namespace {

using tests::kPeriod_s;
using tests::Truth;

struct Variant {
  std::string type, scene;
  bool observer;
};
void PrintTo(const Variant& v, std::ostream* out) {
  *out << v.type << (v.observer ? "_observer_" : "_") << v.scene;
}

std::vector<Variant> Variants() {
  std::vector<Variant> all;
  for (const std::string& type : EstimatorNames()) {
    for (const char* scene : {"steer", "reach"}) {
      for (const bool observer : {false, true}) all.push_back({type, scene, observer});
    }
  }
  return all;
}

class EstimatorProperties : public ::testing::TestWithParam<Variant> {
 protected:
  EstimatorProperties() : truth_(GetParam().scene + ".toml") {
    options_.type = GetParam().type;
    options_.observer = GetParam().observer;
  }
  std::unique_ptr<Estimator> Make() const {
    return MakeEstimator({truth_.world.model, truth_.world.step, options_, sensors_,
                          truth_.world.scene.control->motors});
  }
  static double Error(const ReducedState& a, const ReducedState& b) {
    VectorX d(2 * a.v.size());
    StateDifference(a, b, d);
    return d.cwiseAbs().maxCoeff();
  }
  static void ExpectSameBits(const Estimator& a, const Estimator& b) {
    EXPECT_EQ(a.state().q, b.state().q);
    EXPECT_EQ(a.state().v, b.state().v);
    EXPECT_EQ(a.state().root.position, b.state().root.position);
    EXPECT_EQ(a.state().root.rotation.coeffs(), b.state().root.rotation.coeffs());
    EXPECT_EQ(a.disturbance().bias_n, b.disturbance().bias_n);
    EXPECT_EQ(a.disturbance().acceleration_m_s2, b.disturbance().acceleration_m_s2);
  }
  void Advance() { truth_.Advance(truth_.NoBias()); }

  Truth truth_;
  EstimatorOptions options_;
  SensorOptions sensors_;
};

TEST_P(EstimatorProperties, BeginsWhereItIsTold) {
  const auto estimator = Make();
  estimator->Start(truth_.state);
  EXPECT_EQ(Error(truth_.state, estimator->state()), 0);
  EXPECT_EQ(estimator->disturbance().bias_n, truth_.NoBias());
  EXPECT_EQ(estimator->disturbance().acceleration_m_s2, model::Vector3::Zero());
}

TEST_P(EstimatorProperties, TheStateIsOfNowMeasurementOrNot) {
  const auto estimator = Make();
  estimator->Start(truth_.state);
  ReducedState late = truth_.state;
  for (int i = 0; i < 30; ++i) {
    if (i % 3 == 0) late = truth_.state;
    Advance();
    estimator->Update(truth_.state.time_s, truth_.u, i % 4 == 0 ? nullptr : &late);
    EXPECT_NEAR(estimator->state().time_s, truth_.state.time_s, 1e-12) << i;
    EXPECT_NEAR(estimator->state().root.rotation.norm(), 1.0, 1e-12) << i;
  }
}

TEST_P(EstimatorProperties, WhereModelAndMeasurementsAreExactSoIsTheEstimate) {
  // A filter that may explain what it sees by a disturbance leaves the round-off of its gains,
  // of coordinates up to 10.
  constexpr double kExact = 1e-4;
  const auto estimator = Make();
  estimator->Start(truth_.state);
  for (int i = 0; i < 60; ++i) {
    Advance();
    estimator->Update(truth_.state.time_s, truth_.u, &truth_.state);
    EXPECT_LT(Error(truth_.state, estimator->state()), kExact) << i;
  }
  EXPECT_LT(estimator->disturbance().bias_n.cwiseAbs().maxCoeff(), kExact);
}

TEST_P(EstimatorProperties, FindsItsWayFromAWrongStart) {
  // Within a second, but for a hundredth of where it began.
  constexpr double kLeft = 0.01;
  const auto estimator = Make();
  ReducedState wrong = InitialState(truth_.world.model);
  wrong.time_s = truth_.state.time_s;
  estimator->Start(wrong);
  const double began = Error(truth_.state, wrong);
  ASSERT_GT(began, 1e-2);
  for (int i = 0; i < 100; ++i) {
    Advance();
    estimator->Update(truth_.state.time_s, truth_.u, &truth_.state);
  }
  EXPECT_LT(Error(truth_.state, estimator->state()), kLeft * began);
}

TEST_P(EstimatorProperties, WhatIsNotFiniteOrTooOldCountsAsNothing) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const auto with = Make(), without = Make();
  with->Start(truth_.state);
  without->Start(truth_.state);
  const ReducedState old = truth_.state;
  for (int i = 0; i < 24; ++i) {
    Advance();
    if (i % 4 == 0) {  // both get a good one now and then
      with->Update(truth_.state.time_s, truth_.u, &truth_.state);
      without->Update(truth_.state.time_s, truth_.u, &truth_.state);
      continue;
    }
    ReducedState bad = truth_.state;
    if (i % 4 == 1) bad.v(bad.v.size() - 1) = nan;
    if (i % 4 == 2) bad.root.rotation.coeffs().setConstant(nan);
    if (i % 4 == 3) bad = old;
    with->Update(truth_.state.time_s, truth_.u, &bad);
    without->Update(truth_.state.time_s, truth_.u, nullptr);
  }
  EXPECT_TRUE(with->state().q.allFinite() && with->state().v.allFinite());
  ExpectSameBits(*with, *without);
}

TEST_P(EstimatorProperties, TheSameMeasurementsGiveTheSameBits) {
  const auto one = Make(), two = Make();
  one->Start(truth_.state);
  two->Start(truth_.state);
  for (int i = 0; i < 20; ++i) {
    truth_.Advance(VectorX::Constant(truth_.u.size(), 0.02));
    const ReducedState* measured = i % 3 == 0 ? nullptr : &truth_.state;
    one->Update(truth_.state.time_s, truth_.u, measured);
    two->Update(truth_.state.time_s, truth_.u, measured);
  }
  ExpectSameBits(*one, *two);
}

TEST_P(EstimatorProperties, ASecondStartForgetsTheFirst) {
  const auto used = Make(), fresh = Make();
  used->Start(truth_.state);
  for (int i = 0; i < 20; ++i) {
    truth_.Advance(VectorX::Constant(truth_.u.size(), 0.05));
    used->Update(truth_.state.time_s, truth_.u, &truth_.state);
  }
  used->Start(truth_.state);
  fresh->Start(truth_.state);
  for (int i = 0; i < 10; ++i) {
    Advance();
    used->Update(truth_.state.time_s, truth_.u, &truth_.state);
    fresh->Update(truth_.state.time_s, truth_.u, &truth_.state);
  }
  ExpectSameBits(*used, *fresh);
}

INSTANTIATE_TEST_SUITE_P(Estimators, EstimatorProperties, ::testing::ValuesIn(Variants()),
                         [](const auto& v) {
                           return v.param.type + (v.param.observer ? "_observer_" : "_direct_") +
                                  v.param.scene;
                         });

}  // namespace
}  // namespace mantle::controller
