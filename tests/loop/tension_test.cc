#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <random>
#include <vector>

#include "controller/tension_loop.h"
#include "tests/loop/vehicle.h"
#include "tests/loop/vehicles.h"

/// The tension that cables really have under TensionLoop, on the free-swimming robot of the control
/// scenes: the mantle's spokes follow a triangle of 0.5 N and 0.66 s, three arm cables ramps of
/// 1 N/s up to 0.5 N, the fourth rests.

namespace mantle::loop {
namespace {

using controller::TensionLoop;
using tests::FiveMotors;
using tests::LoopRun;
using tests::SwimmingRobot;
using tests::Triangle;

constexpr double kRest_n = 0.02;
constexpr double kPeriod_s = 0.01;

double Ramp(double t_s, double hold_s) {
  if (t_s < 0.5) return std::max(t_s, 0.0);
  return t_s < 0.5 + hold_s ? 0.5 : std::max(0.0, 1.0 + hold_s - t_s);
}

double Wanted(int motor, double t_s) {
  const double pulled = motor == 0   ? Ramp(t_s - 0.3, 0.5)
                        : motor == 1 ? Ramp(t_s - 2.0, 0.3)
                        : motor == 2 ? Ramp(t_s - 3.0, 1.0)
                        : motor == 4 ? Triangle(std::max(0.0, t_s - 0.2), 0.66, 0.5)
                                     : 0.0;
  return std::max(kRest_n, pulled);
}

/// Root mean square of the tension's error per motor over 6 s [N].
std::vector<double> TrackingError(double stiffness_n_m, double noise_m) {
  const model::Plant plant(SwimmingRobot());
  const DriveOptions drives{.cable_stiffness_n_m = stiffness_n_m};
  model::RunSettings run = LoopRun();
  run.account_energy = false;
  Vehicle vehicle(plant, run, FiveMotors(), drives);
  const Status up = vehicle.BringUp();
  EXPECT_TRUE(up.ok) << up.reason;
  const int motors = vehicle.motor_count();
  std::vector<TensionLoop> loops(
      motors,
      TensionLoop(vehicle.winch_map(), {kPeriod_s, stiffness_n_m, drives.cable_damping_n_s_m}));
  std::mt19937 random(1);
  std::normal_distribution<double> normal;
  std::vector<double> square(motors);
  std::vector<MotorCommand> commands(motors);
  constexpr int kCycles = 600;
  for (int k = 0; k < kCycles; ++k) {
    const double t = kPeriod_s * k;
    for (int i = 0; i < motors; ++i) {
      // A noisy length has a noisy rate: as if differentiated over 50 ms.
      const double torque = loops[i].Update(
          {Wanted(i, t), (Wanted(i, t + kPeriod_s) - Wanted(i, t)) / kPeriod_s,
           vehicle.length_m(i) - vehicle.reel(i).rest_length_m + noise_m * normal(random),
           vehicle.length_rate_m_s(i) + noise_m / 0.05 * normal(random), vehicle.ReportedReel_m(i),
           vehicle.ReportedRate_m_s(i)});
      commands[i].torque_permille = static_cast<std::int16_t>(std::lround(torque));
    }
    const Status status = vehicle.Cycle(commands);
    EXPECT_TRUE(status.ok) << status.reason;
    if (!status.ok) break;
    for (int i = 0; i < motors; ++i) {
      const double error = vehicle.drum_tension_n(i) - Wanted(i, t + kPeriod_s);
      square[i] += error * error / kCycles;
    }
  }
  for (double& x : square) x = std::sqrt(x);
  std::printf(
      "%5g N/m, noise %g mm: rms error [mN] arm %.1f %.1f %.1f, at rest %.1f, mantle %.1f\n",
      stiffness_n_m, 1e3 * noise_m, 1e3 * square[0], 1e3 * square[1], 1e3 * square[2],
      1e3 * square[3], 1e3 * square[4]);
  return square;
}

TEST(Tension, IsTrackedWithinThreePercentOfTheLargestOne) {
  // 3 % of 0.8 N: below what the friction is uncertain by, 64 mN and 10 % of the tension.
  for (const double error : TrackingError(500.0, 0.0)) EXPECT_LT(error, 0.03 * 0.8);
}

TEST(Tension, SurvivesNoiseOnTheEstimatedLength) {
  // 0.2 mm are 100 mN of this cable: a third of that may pass.
  for (const double error : TrackingError(500.0, 2e-4)) EXPECT_LT(error, 0.033);
}

TEST(Tension, OfAStiffCableIsTrackedByFeedForward) {
  // One count of the encoder is 19 mN, and the drum's 59 Hz cannot be damped at 100 Hz.
  for (const double error : TrackingError(5000.0, 0.0)) EXPECT_LT(error, 0.08);
}

}  // namespace
}  // namespace mantle::loop
