#include "controller/gait.h"

#include <gtest/gtest.h>

#include <cmath>

namespace mantle::controller {
namespace {

constexpr double kRoundOff = 1e-12;
constexpr double kPeriod_s = 0.8;

GaitPulse Pulse() {
  GaitPulse p;
  p.low_n = 0.1;
  p.high_n = 0.6;
  p.rise = 0.25;
  p.hold = 0.125;
  p.fall = 0.5;
  p.phase = 0.0;
  return p;
}

Gait TwoMotors() {
  Gait gait;
  gait.period_s = kPeriod_s;
  gait.motors = {Pulse(), Pulse()};
  gait.motors[1].phase = 0.5;
  gait.motors[1].high_n = 0.1;  // never pulls more than its low tension
  return gait;
}

TEST(Gait, PulseHasItsCorners) {
  const auto at = [](double share) { return PulseTension(Pulse(), kPeriod_s, share * kPeriod_s); };
  EXPECT_NEAR(at(0.0), 0.1, kRoundOff);
  EXPECT_NEAR(at(0.125), 0.35, kRoundOff);  // half way up
  EXPECT_NEAR(at(0.25), 0.6, kRoundOff);
  EXPECT_NEAR(at(0.3), 0.6, kRoundOff);
  EXPECT_NEAR(at(0.375), 0.6, kRoundOff);
  EXPECT_NEAR(at(0.625), 0.35, kRoundOff);  // half way down
  EXPECT_NEAR(at(0.875), 0.1, kRoundOff);
  EXPECT_NEAR(at(0.95), 0.1, kRoundOff);
}

TEST(Gait, IsPeriodicBeforeAndAfterZeroAndShiftedByThePhase) {
  GaitPulse late = Pulse();
  late.phase = 0.3;
  for (int i = 0; i < 50; ++i) {
    const double t = 0.013 + 0.0371 * i, now = PulseTension(Pulse(), kPeriod_s, t);
    EXPECT_NEAR(PulseTension(Pulse(), kPeriod_s, t + 3 * kPeriod_s), now, 1e-11);
    EXPECT_NEAR(PulseTension(Pulse(), kPeriod_s, t - 5 * kPeriod_s), now, 1e-11);
    EXPECT_NEAR(PulseTension(late, kPeriod_s, t + 0.3 * kPeriod_s), now, 1e-11);
  }
}

TEST(Gait, TensionIsContinuousWithTheSlopesOfItsRamps) {
  const GaitPulse p = Pulse();
  const double up = (p.high_n - p.low_n) / (p.rise * kPeriod_s);
  constexpr double kStep_s = 1e-4;
  double steepest = 0;
  for (int i = 0; i < 16000; ++i) {
    const double t = kStep_s * i;
    const double change = PulseTension(p, kPeriod_s, t + kStep_s) - PulseTension(p, kPeriod_s, t);
    steepest = std::max(steepest, std::abs(change) / kStep_s);
  }
  EXPECT_NEAR(steepest, up, 1e-8 * up);  // round-off of a difference over the step
}

TEST(Gait, APulseWithoutRampsIsARectangle) {
  GaitPulse p = Pulse();
  p.rise = p.fall = 0;
  p.hold = 0.5;
  EXPECT_EQ(PulseTension(p, kPeriod_s, 0.0), p.high_n);
  EXPECT_EQ(PulseTension(p, kPeriod_s, 0.49 * kPeriod_s), p.high_n);
  EXPECT_EQ(PulseTension(p, kPeriod_s, 0.51 * kPeriod_s), p.low_n);
}

TEST(Gait, EveryMotorHasItsPulse) {
  const Gait gait = TwoMotors();
  Eigen::VectorXd u(2);
  for (double t : {0.0, 0.07, 0.2, 0.29, 0.55, 0.79}) {
    GaitTensions(gait, t, u);
    EXPECT_EQ(u(0), PulseTension(gait.motors[0], gait.period_s, t));
    EXPECT_EQ(u(1), PulseTension(gait.motors[1], gait.period_s, t));
  }
}

TEST(Gait, ScalingActsOnWhatIsAboveTheLowTension) {
  const Gait gait = TwoMotors(), scaled = Scaled(gait, 0.4, 1.5);
  Eigen::VectorXd u(2), v(2);
  for (double t : {0.0, 0.07, 0.2, 0.29, 0.55, 0.79}) {
    GaitTensions(gait, t, u);
    GaitTensions(scaled, 1.5 * t, v);
    EXPECT_NEAR(v(0) - 0.1, 0.4 * (u(0) - 0.1), kRoundOff);
    EXPECT_NEAR(v(1), u(1), kRoundOff);
  }
}

TEST(Gait, TheLargestScaleJustMeetsALimit) {
  const Gait gait = TwoMotors();
  std::vector<MotorLimits> motors(2);
  for (const auto& [most_n, rate_n_s] : {std::pair{0.5, 100.0}, {100.0, 1.0}}) {
    motors[0].max_tension_n = motors[1].max_tension_n = most_n;
    motors[0].max_rate_n_s = motors[1].max_rate_n_s = rate_n_s;
    const GaitPulse p = Scaled(gait, LargestScale(gait, motors), 1.0).motors[0];
    const double height = p.high_n - p.low_n;
    const double steepest = height / (std::min(p.rise, p.fall) * kPeriod_s);
    EXPECT_NEAR(std::max(p.high_n / most_n, steepest / rate_n_s), 1.0, kRoundOff);
  }
}

}  // namespace
}  // namespace mantle::controller
