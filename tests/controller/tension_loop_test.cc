#include "controller/tension_loop.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>
#include <stdexcept>

#include "tests/controller/winches.h"

namespace mantle::controller {
namespace {

constexpr double kPeriod_s = 0.01;

/// The loop's own equation with a body that moves as it likes: rotor and drum with set-valued
/// friction on a cable whose other end is at -lambda(t). Reports are a period old.
struct Bench {
  explicit Bench(TensionLoopOptions o = {}) : options(o), loop(map, o) {}

  double Tension(double t_s) const {
    return std::max(0.0, options.stiffness_n_m * (reeled_m + Length(t_s)) +
                             options.damping_n_s_m * (rate_m_s + LengthRate(t_s)));
  }
  double Length(double t_s) const { return amplitude_m * std::cos(omega * t_s) - amplitude_m; }
  double LengthRate(double t_s) const { return -amplitude_m * omega * std::sin(omega * t_s); }

  void Period(double wanted_n, double wanted_rate) {
    TensionLoopInput in{wanted_n,           wanted_rate, Length(time_s) + noise_m * normal(random),
                        LengthRate(time_s), reported_m,  reported_rate_m_s};
    const double torque = loop.Update(in);
    travel += std::abs(torque - last_torque);
    last_torque = torque;
    reported_m = reeled_m;
    reported_rate_m_s = rate_m_s;
    constexpr int kSteps = 200;
    const double h = kPeriod_s / kSteps;
    const double mass = real.mass_kg();
    for (int i = 0; i < kSteps; ++i) {
      const double tension = Tension(time_s);
      const double impulse =
          mass * rate_m_s +
          h * (torque * real.permille_nm / real.metres_per_rad - real.mean_load() * tension);
      const double sliding = h * FrictionForce(real, tension);
      const double holding = rate_m_s == 0.0 ? real.stiction_ratio * sliding : sliding;
      rate_m_s =
          std::abs(impulse) <= holding ? 0.0 : (impulse - std::copysign(sliding, impulse)) / mass;
      reeled_m += h * rate_m_s;
      time_s += h;
    }
  }

  WinchMap map = SmallWinch();
  WinchMap real = SmallWinch();
  TensionLoopOptions options;
  TensionLoop loop;
  double amplitude_m{0}, omega{0}, noise_m{0};
  std::mt19937 random{1};
  std::normal_distribution<double> normal;
  double reeled_m{0}, rate_m_s{0}, reported_m{0}, reported_rate_m_s{0};
  double time_s{0}, last_torque{0}, travel{0};
};

/// Root mean square of the tension's error over 3 s while a triangle of 0.5 N, 0.66 s is wanted.
double TriangleError(Bench& bench) {
  double square = 0;
  int count = 0;
  for (int k = 0; k < 300; ++k) {
    const auto wanted = [](double t_s) {
      return 0.02 + 0.48 * (1.0 - std::abs(2.0 * std::fmod(t_s / 0.66, 1.0) - 1.0));
    };
    const double now = wanted(bench.time_s);
    bench.Period(now, (wanted(bench.time_s + kPeriod_s) - now) / kPeriod_s);
    if (k < 20) continue;
    const double error = bench.Tension(bench.time_s) - wanted(bench.time_s);
    square += error * error;
    ++count;
  }
  return std::sqrt(square / count);
}

TEST(TensionLoop, TracksAGaitsTriangleOnABodyThatMoves) {
  Bench bench;
  bench.amplitude_m = 0.012;
  bench.omega = 2.0 * std::numbers::pi / 0.66;
  // The target: 3 % of 0.8 N.
  EXPECT_LT(TriangleError(bench), 0.024);
}

TEST(TensionLoop, WithoutFrictionCompensationTheErrorIsTwiceAsLarge) {
  // The same torque map with the friction taken as zero: what the loop is for.
  Bench blind;
  blind.map.friction_torque_nm = 0.0;
  blind.loop = TensionLoop(blind.map, blind.options);
  Bench bench;
  for (Bench* b : {&blind, &bench}) {
    b->amplitude_m = 0.012;
    b->omega = 2.0 * std::numbers::pi / 0.66;
  }
  EXPECT_GT(TriangleError(blind), 2.0 * TriangleError(bench));
}

TEST(TensionLoop, HoldsAConstantTensionWithoutALimitCycle) {
  Bench bench;
  for (int k = 0; k < 200; ++k) bench.Period(0.4, 0.0);
  // Stuck within what sliding friction leaves between the two directions' torque: the feedback
  // moves the reel until less than a third of it is missing.
  constexpr double kStuck_n = 0.03;
  EXPECT_NEAR(bench.Tension(bench.time_s), 0.4, kStuck_n);
  bench.travel = 0;
  const double before_m = bench.reeled_m;
  for (int k = 0; k < 200; ++k) bench.Period(0.4, 0.0);
  EXPECT_NEAR(bench.reeled_m, before_m, 4e-6);  // one count of the encoder
  EXPECT_LT(bench.travel, 1.0);                 // thousandths of torque, over 2 s
}

TEST(TensionLoop, NoiseOnTheLengthIsNotAmplified) {
  Bench bench;
  bench.amplitude_m = 0.012;
  bench.omega = 2.0 * std::numbers::pi / 0.66;
  bench.noise_m = 2e-4;
  // 0.2 mm are 0.1 N of the cable: passed on in full they would be 100 mN rms.
  EXPECT_LT(TriangleError(bench), 0.05);
}

TEST(TensionLoop, WrongFrictionCostsAccuracyNotStability) {
  for (const double factor : {0.7, 1.3}) {
    Bench bench;
    bench.real.friction_torque_nm *= factor;
    bench.amplitude_m = 0.012;
    bench.omega = 2.0 * std::numbers::pi / 0.66;
    EXPECT_LT(TriangleError(bench), 0.05) << factor;
  }
}

TEST(TensionLoop, AStiffCableIsNotShaken) {
  Bench bench({.stiffness_n_m = 5000});
  bench.amplitude_m = 0.012;
  bench.omega = 2.0 * std::numbers::pi / 0.66;
  // 59 Hz of drum on cable are beyond what 100 Hz of samples can damp; 65 mN of ringing under the
  // friction's jumps remain, and do not grow.
  EXPECT_LT(TriangleError(bench), 0.08);
}

TEST(TensionLoop, InputsThatAreNotFiniteGiveTheWantedTensionWithoutFriction) {
  Bench bench;
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(bench.loop.Update({0.3, 0, nan, 0, 0, 0}), TensionToTorque(bench.map, 0.3, 0.0));
  EXPECT_EQ(bench.loop.Update({nan, 0, 0, 0, 0, nan}), 0.0);
  EXPECT_TRUE(std::isfinite(bench.loop.Update({0.3, 0, 0, 0, 0, 0})));
}

TEST(TensionLoop, StaysWithinTheDrivesLimitsAndDoesNotPushTheCable) {
  Bench bench;
  EXPECT_EQ(bench.loop.Update({50.0, 0, 0, 0, 0, 0}), bench.map.max_permille);
  bench.loop.Reset();
  const double push = bench.loop.Update({0.0, 0, 0, 0, 0.1, 0});
  EXPECT_LT(push, 0.0);
  EXPECT_GE(push * bench.map.permille_nm, -4.0 * bench.map.friction_torque_nm - 1e-12);
}

TEST(TensionLoop, RefusesImpossibleOptionsByName) {
  EXPECT_THROW(TensionLoop(SmallWinch(), {.period_s = 0.0}), std::invalid_argument);
  EXPECT_THROW(TensionLoop(SmallWinch(), {.stiffness_n_m = -1.0}), std::invalid_argument);
  EXPECT_THROW(TensionLoop(SmallWinch(), {.damping_n_s_m = -1.0}), std::invalid_argument);
}

}  // namespace
}  // namespace mantle::controller
