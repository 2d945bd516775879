#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <vector>

#include "tests/loop/vehicle.h"
#include "tests/loop/vehicles.h"

/// Drives and plant advance by turns: what that costs, and that it falls with the step.

namespace mantle::loop {
namespace {

using tests::CableMotor;
using tests::ClampedArm;
using tests::FiveMotors;
using tests::LoopRun;
using tests::SwimmingRobot;
using tests::Triangle;

MotorCommand Pull(const Vehicle& vehicle, double tension_n, double sigma) {
  return {static_cast<std::int16_t>(
      std::lround(TensionToTorque(vehicle.winch_map(), tension_n, sigma)))};
}

/// Part of the winch's work that neither the plant, nor the cable's stretch, nor its damping got.
double MissingShare(const Vehicle& vehicle, int motor) {
  const CouplingWork w = vehicle.coupling_work(motor);
  return std::abs(w.winch_j - w.plant_j - w.stored_j - w.dissipated_j) / w.winch_j;
}

/// The swimming robot, its mantle squeezed by a triangle of 0.5 N, for `time_s`.
struct Swim {
  Swim(const model::Plant& plant, double stiffness_n_m, int coupling_steps, double time_s)
      : vehicle(plant, LoopRun(), FiveMotors(), {.cable_stiffness_n_m = stiffness_n_m},
                {.coupling_steps = coupling_steps}) {
    EXPECT_TRUE(vehicle.BringUp().ok);
    for (int k = 0; k < std::lround(time_s / 0.01) && status.ok; ++k) {
      const double t = 0.01 * k + 0.005;
      const double up = Triangle(t + 1e-3, 0.66, 0.5) > Triangle(t, 0.66, 0.5) ? 1.0 : -1.0;
      MotorCommand commands[5] = {};
      commands[4] = Pull(vehicle, Triangle(t, 0.66, 0.5), up);
      status = vehicle.Cycle(commands);
      tension_n.push_back(vehicle.drum_tension_n(4));
    }
    EXPECT_TRUE(status.ok) << status.reason;
  }
  Vehicle vehicle;
  Status status;
  std::vector<double> tension_n;
};

double Distance(const std::vector<double>& a, const std::vector<double>& b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += (a[i] - b[i]) * (a[i] - b[i]);
  return std::sqrt(sum / static_cast<double>(a.size()));
}

TEST(Coupling, WorkBalancesAndWhatIsMissingFallsWithTheStep) {
  const model::Plant plant(SwimmingRobot());
  std::vector<double> missing;
  for (const int steps : {1, 2, 4, 10}) {
    const Swim swim(plant, 500.0, steps, 1.32);
    missing.push_back(MissingShare(swim.vehicle, 4));
    std::printf("coupling steps %d: %.2e of %.4f J missing\n", steps, missing.back(),
                swim.vehicle.coupling_work(4).winch_j);
    // The drum's load runs on linearly: off by k l_ddot h^2 / 2 at the step's end.
    if (missing.size() > 1) {
      EXPECT_LT(missing.back(), 0.5 * missing[missing.size() - 2]);
    }
  }
  // Order two but where the cable goes slack or the reel sticks within a step, which is of order
  // one: one and a half over the decade.
  EXPECT_LT(missing.back(), missing.front() * std::pow(10.0, -1.5));
  // With drum on cable turning by 0.12 rad a step, squared and halved, in a tension that varies by
  // a fifth of itself over it.
  EXPECT_LT(missing.back(), 2e-3);
}

TEST(Coupling, TheDefaultStepsCostLessThanOnePercentOfTheTension) {
  const model::Plant plant(SwimmingRobot());
  for (const double stiffness : {500.0, 5000.0}) {
    const Swim chosen(plant, stiffness, 0, 0.66);
    const Swim fine(plant, stiffness, 100, 0.66);
    const double error_n = Distance(chosen.tension_n, fine.tension_n);
    std::printf("%g N/m: %d steps, tension off by %.2e N rms\n", stiffness,
                chosen.vehicle.coupling_steps(), error_n);
    EXPECT_LT(error_n, 0.01 * 0.5);
  }
}

TEST(Coupling, AStiffCableStaysAtRestWhereItWasPulled) {
  const model::Plant plant(ClampedArm());
  Vehicle vehicle(plant, LoopRun(), {CableMotor("a", 0)}, {.cable_stiffness_n_m = 5000});
  ASSERT_TRUE(vehicle.BringUp().ok);
  for (int k = 0; k < 500; ++k) {
    const MotorCommand command = Pull(vehicle, std::min(0.005 * k, 0.5), k < 100 ? 1.0 : 0.0);
    const Status status = vehicle.Cycle({&command, 1});
    ASSERT_TRUE(status.ok) << status.reason;
  }
  // The arm's own swing lasts; drum and cable must not feed it.
  const double reeled_m = vehicle.winch(0).reeled_m;
  double lowest = 1, highest = 0;
  for (int k = 0; k < 100; ++k) {
    const MotorCommand command = Pull(vehicle, 0.5, 0.0);
    ASSERT_TRUE(vehicle.Cycle({&command, 1}).ok);
    lowest = std::min(lowest, vehicle.drum_tension_n(0));
    highest = std::max(highest, vehicle.drum_tension_n(0));
  }
  EXPECT_EQ(vehicle.winch(0).reeled_m, reeled_m);  // stuck, exactly
  EXPECT_LT(highest - lowest, 0.05);
  EXPECT_GT(lowest, 0.3);
}

TEST(Coupling, GangedCablesShareTheDrumByTheirGains) {
  const model::Plant plant(ClampedArm());
  using Kind = reduced::ActuatorTarget::Kind;
  // Two neighbouring cables, one on a smaller drum.
  const reduced::Actuator both{"both", {{Kind::kCable, 0, 1.0}, {Kind::kCable, 1, 0.8}}};
  const DriveOptions drives{.cable_stiffness_n_m = 500};
  Vehicle vehicle(plant, LoopRun(), {both}, drives);
  ASSERT_TRUE(vehicle.BringUp().ok);
  for (int k = 0; k < 60; ++k) {
    const MotorCommand command = Pull(vehicle, 0.01 * k, 1.0);
    ASSERT_TRUE(vehicle.Cycle({&command, 1}).ok);
  }
  const Reel& reel = vehicle.reel(0);
  EXPECT_DOUBLE_EQ(reel.gain_square, 1.64);
  const model::Sample sample = vehicle.Observe();
  double stiffness = 0, load = 0;
  for (const ReeledCable& cable : reel.cables) {
    stiffness += cable.gain * cable.gain * cable.stiffness_n_m;
    load += cable.gain * sample.cable_tension_n[cable.index];
    EXPECT_GT(sample.cable_tension_n[cable.index], 0.0);
  }
  constexpr double kRoundOff = 1e-12;
  EXPECT_NEAR(stiffness, drives.cable_stiffness_n_m, kRoundOff * stiffness);
  // Observe evaluates the state anew, one negligible Newton correction later.
  constexpr double kNewton_n = 1e-5;
  EXPECT_NEAR(load, vehicle.drum_tension_n(0), kNewton_n);
  // All taut: T = K e + D e_dot with the motor's own length.
  const double e = vehicle.length_m(0) - reel.rest_length_m + reel.end.reeled_m;
  const double e_dot = vehicle.length_rate_m_s(0) + reel.end.rate_m_s;
  EXPECT_NEAR(load, 500.0 * e + drives.cable_damping_n_s_m * e_dot, kNewton_n);
  EXPECT_NEAR(vehicle.winch(0).tension_n, load, 0.05 * load);
  EXPECT_LT(MissingShare(vehicle, 0), 0.02);
}

TEST(Coupling, TheSameRunGivesTheSameBits) {
  const model::Plant plant(SwimmingRobot());
  const Swim a(plant, 500.0, 0, 0.3), b(plant, 500.0, 0, 0.3);
  EXPECT_EQ(a.tension_n, b.tension_n);
  EXPECT_TRUE(a.vehicle.state().velocity == b.vehicle.state().velocity);
}

}  // namespace
}  // namespace mantle::loop
