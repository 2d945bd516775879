#include "loop/plant_side/sensor_model.h"

#include <gtest/gtest.h>

#include <cmath>

#include "reduced/outputs.h"
#include "tests/controller/control_scene.h"

namespace mantle::controller {
namespace {

using tests::ControlScene;

constexpr int kDraws = 2000;
// Five standard errors: of a mean 1 / sqrt(n), of a standard deviation 1 / sqrt(2 n), of its sigma.
const double kMean = 5 / std::sqrt(kDraws), kDeviation = 5 / std::sqrt(2.0 * kDraws);

SensorOptions Noisy() {
  SensorOptions o;
  o.position_m = 2e-3;
  o.attitude_rad = 3e-3;
  o.velocity_m_s = 4e-3;
  o.angular_velocity_rad_s = 5e-3;
  o.strain = 6e-2;
  o.strain_rate = 7e-2;
  o.mantle = 8e-3;
  o.mantle_rate = 9e-3;
  o.seed = 7;
  return o;
}

/// What every coordinate of (zeta, dq, dv) should scatter by.
VectorX Deviations(const ReducedModel& model, const SensorOptions& o) {
  const int n = model.velocity_count();
  VectorX d(2 * n);
  d.segment<3>(0).setConstant(o.attitude_rad);
  d.segment<3>(3).setConstant(o.position_m);
  d.segment<3>(n).setConstant(o.angular_velocity_rad_s);
  d.segment<3>(n + 3).setConstant(o.velocity_m_s);
  for (int a = 0; a < static_cast<int>(model.arms.size()); ++a) {
    const int arm = 6 + model.arm_first(a), size = model.arms[a].size();
    d.segment(arm, size).setConstant(o.strain);
    d.segment(n + arm, size).setConstant(o.strain_rate);
  }
  const int mantle = 6 + model.mantle_first();
  d.segment(mantle, model.mantle->size) = o.mantle * model.mantle->basis.scale;
  d.segment(n + mantle, model.mantle->size) = o.mantle_rate * model.mantle->basis.scale;
  return d;
}

/// Mean and standard deviation of kDraws measurements' errors, over their nominal deviation.
struct Statistics {
  Statistics(ControlScene* world, const SensorOptions& o) {
    const ReducedState truth = world->Start();
    const VectorX nominal = Deviations(world->model, o);
    loop::SensorModel sensors(world->model, o);
    VectorX error(nominal.size());
    mean = square = VectorX::Zero(nominal.size());
    for (int i = 0; i < kDraws; ++i) {
      const auto measured = sensors.Measure(truth);
      EXPECT_TRUE(measured.has_value());
      StateDifference(truth, *measured, error);
      const VectorX share = error.cwiseQuotient(nominal);
      mean += share / kDraws;
      square += share.cwiseAbs2() / kDraws;
    }
    deviation = (square - mean.cwiseAbs2()).cwiseSqrt();
  }
  VectorX mean, square, deviation;
};

TEST(SensorModel, NoiseHasTheDeviationsOfTheOptionsAndNoMean) {
  for (const char* scene : {"steer.toml", "octopus_swim.toml"}) {  // one arm, eight
    ControlScene world(scene);
    const Statistics s(&world, Noisy());
    EXPECT_LT(s.mean.cwiseAbs().maxCoeff(), kMean) << scene;
    EXPECT_LT((s.deviation.array() - 1.0).abs().maxCoeff(), kDeviation) << scene;
  }
}

TEST(SensorModel, BiasIsDrawnOnceAndStaysApartFromTheNoise) {
  ControlScene world("steer.toml");
  SensorOptions o = Noisy();
  o.bias = 3;
  const Statistics s(&world, o);
  EXPECT_LT((s.deviation.array() - 1.0).abs().maxCoeff(), kDeviation);
  // Means scatter by the bias's deviation, over some forty coordinates.
  const double spread = std::sqrt(s.mean.squaredNorm() / static_cast<double>(s.mean.size()));
  EXPECT_NEAR(spread, o.bias, 5 * o.bias / std::sqrt(2.0 * static_cast<double>(s.mean.size())));
}

TEST(SensorModel, PerfectOnesGiveTheTruth) {
  ControlScene world("steer.toml");
  const ReducedState truth = world.Start();
  loop::SensorModel sensors(world.model, {});
  const auto measured = sensors.Measure(truth);
  ASSERT_TRUE(measured.has_value());
  EXPECT_EQ(measured->q, truth.q);
  EXPECT_EQ(measured->v, truth.v);
  EXPECT_EQ(measured->time_s, truth.time_s);
  EXPECT_EQ(measured->root.position, truth.root.position);
  EXPECT_EQ(sensors.MeasureCable(0.4), 0.4);
  EXPECT_EQ(sensors.MeasureCableRate(-0.1), -0.1);
}

TEST(SensorModel, ADelayedMeasurementIsTheTruthOfThen) {
  ControlScene world("steer.toml");
  SensorOptions o;
  o.delay_s = 0.03;
  loop::SensorModel sensors(world.model, o);
  ReducedState truth = world.Start(0.0);
  for (int i = 0; i < 20; ++i) {
    truth.time_s = 0.01 * i;
    truth.root.position.x() = 0.5 * i;
    const auto measured = sensors.Measure(truth);
    ASSERT_EQ(measured.has_value(), i >= 3) << i;
    if (!measured) continue;
    EXPECT_NEAR(measured->time_s, truth.time_s - o.delay_s, 1e-12);
    EXPECT_NEAR(measured->root.position.x(), 0.5 * (i - 3), 1e-12);
  }
}

TEST(SensorModel, LosesItsShareOfMeasurements) {
  ControlScene world("steer.toml");
  SensorOptions o;
  o.loss = 0.3;
  loop::SensorModel sensors(world.model, o);
  ReducedState truth = world.Start(0.0);
  int lost = 0;
  for (int i = 0; i < kDraws; ++i) {
    truth.time_s = 0.01 * i;
    const auto measured = sensors.Measure(truth);
    lost += !measured;
    if (measured) {
      EXPECT_EQ(measured->time_s, truth.time_s) << "a lost one is not made up for";
    }
  }
  const double share = static_cast<double>(lost) / kDraws;
  EXPECT_NEAR(share, o.loss, 5 * std::sqrt(o.loss * (1 - o.loss) / kDraws));
}

TEST(SensorModel, TheSeedDecidesEveryBit) {
  ControlScene world("steer.toml");
  const ReducedState truth = world.Start();
  SensorOptions o = Noisy();
  o.bias = 1;
  loop::SensorModel a(world.model, o), b(world.model, o);
  o.seed = 8;
  loop::SensorModel c(world.model, o);
  for (int i = 0; i < 5; ++i) {
    const auto x = a.Measure(truth), y = b.Measure(truth), z = c.Measure(truth);
    EXPECT_EQ(x->q, y->q);
    EXPECT_EQ(x->v, y->v);
    EXPECT_NE(x->q, z->q);
  }
}

TEST(SensorModel, AClampedRootIsNotDisplaced) {
  ControlScene world("reach.toml");
  SensorOptions o = Noisy();
  const ReducedState truth = world.Start();
  loop::SensorModel sensors(world.model, o);
  const auto measured = sensors.Measure(truth);
  ASSERT_TRUE(measured.has_value());
  EXPECT_LT((measured->root.position - truth.root.position).norm(), 1e-15);
  EXPECT_EQ(measured->v.head<6>(), truth.v.head<6>());
  EXPECT_NE(measured->q, truth.q);
}

TEST(SensorModel, CableNoiseHasItsDeviation) {
  ControlScene world("reach.toml");
  SensorOptions o;
  o.cable_m = 2e-4;
  o.cable_rate_m_s = 3e-3;
  loop::SensorModel sensors(world.model, o);
  double length = 0, rate = 0;
  for (int i = 0; i < kDraws; ++i) {
    length += std::pow((sensors.MeasureCable(0.4) - 0.4) / o.cable_m, 2) / kDraws;
    rate += std::pow((sensors.MeasureCableRate(0.1) - 0.1) / o.cable_rate_m_s, 2) / kDraws;
  }
  EXPECT_NEAR(std::sqrt(length), 1.0, kDeviation);
  EXPECT_NEAR(std::sqrt(rate), 1.0, kDeviation);
}

}  // namespace
}  // namespace mantle::controller
