#include "firmware_sim/drive/winch.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <random>

namespace mantle::firmware_sim {
namespace {

constexpr MotorData kMotor;
constexpr WinchData kWinch;

WinchCommand Volts(double voltage_v) { return {true, voltage_v, false}; }

void Turn(Winch& winch, const WinchCommand& command, const Surroundings& around, double time_s) {
  const auto steps = static_cast<int>(std::lround(time_s / kSubStep_s));
  for (int i = 0; i < steps; ++i) winch.Step(command, around);
}

Surroundings ConstantTension(double tension_n) {
  Surroundings around;
  around.cable = {tension_n, 0.0, 0.0};
  return around;
}

TEST(Winch, NoLoadSpeedAndCurrentAreTheDataSheets) {
  Winch winch;
  Turn(winch, Volts(kMotor.nominal_voltage_v), {}, 0.5);
  // Rows of a data sheet have two digits.
  EXPECT_NEAR(winch.speed_rad_s() / kMotor.no_load_speed_rad_s, 1.0, 0.01);
  EXPECT_NEAR(winch.current_a() / kMotor.no_load_current_a, 1.0, 0.01);
}

TEST(Winch, StallTorqueIsTheDataSheets) {
  Winch winch;
  Turn(winch, {true, kMotor.nominal_voltage_v, true}, {}, 0.01);
  EXPECT_EQ(winch.speed_rad_s(), 0.0);
  EXPECT_NEAR(winch.current_a(), kMotor.nominal_voltage_v / kMotor.resistance_ohm, 1e-9);
  EXPECT_NEAR(winch.current_a() * kMotor.torque_constant_nm_a / kMotor.stall_torque_nm, 1.0, 0.01);
}

TEST(Winch, SpeedsUpWithTheMechanicalTimeConstant) {
  Winch winch;
  const double k = kMotor.torque_constant_nm_a;
  const double tau_s = kMotor.resistance_ohm * winch.inertia_kgm2() / (k * k);
  const double friction_v = kMotor.friction_torque_nm / k * kMotor.resistance_ohm;
  const double steady = (6.0 - friction_v) / k;
  for (int i = 1; i <= 400; ++i) {
    winch.Step(Volts(6.0), {});
    const double exact = steady * (1.0 - std::exp(-i * kSubStep_s / tau_s));
    // The winding's 21 us delay the torque by that much: speed off by steady * 21 us / tau.
    const double delay = steady * kMotor.inductance_h / kMotor.resistance_ohm / tau_s;
    ASSERT_NEAR(winch.speed_rad_s(), exact, 1.2 * delay);
  }
}

TEST(Winch, SteadySpeedUnderLoadIsTheMotorsLine) {
  const double k = kMotor.torque_constant_nm_a;
  for (const double tension_n : {0.0, 0.3, 1.0, 2.0}) {
    Winch winch;
    Turn(winch, Volts(12.0), ConstantTension(tension_n), 1.0);
    const double load_nm =
        winch.metres_per_rad() * tension_n / kWinch.gear_efficiency + kMotor.friction_torque_nm;
    const double exact = (12.0 - kMotor.resistance_ohm * load_nm / k) / k;
    EXPECT_NEAR(winch.speed_rad_s(), exact, 1e-6 * exact) << tension_n;
  }
}

TEST(Winch, PayingOutTheLoadDrivesThroughTheGear) {
  const double k = kMotor.torque_constant_nm_a;
  constexpr double kTension_n = 1.0;
  Winch winch;
  Turn(winch, Volts(0.0), ConstantTension(kTension_n), 1.0);
  const double drive_nm =
      winch.metres_per_rad() * kTension_n * kWinch.gear_efficiency - kMotor.friction_torque_nm;
  const double exact = -drive_nm * kMotor.resistance_ohm / (k * k);
  EXPECT_NEAR(winch.speed_rad_s(), exact, 1e-6 * std::abs(exact));
}

TEST(Winch, SticksExactlyBelowTheStaticFrictionAndSlipsAbove) {
  const double static_nm = kMotor.friction_torque_nm * kMotor.stiction_ratio;
  const double static_v = static_nm / kMotor.torque_constant_nm_a * kMotor.resistance_ohm;
  Winch holds;
  Turn(holds, Volts(0.999 * static_v), {}, 0.5);
  EXPECT_EQ(holds.angle_rad(), 0.0);
  Winch slips;
  Turn(slips, Volts(1.001 * static_v), {}, 0.5);
  EXPECT_GT(slips.speed_rad_s(), 0.0);
  // Once it moves, less than the static level keeps it moving, and the sliding level stops it.
  Turn(slips, Volts(0.9 * static_v), {}, 0.5);
  EXPECT_GT(slips.speed_rad_s(), 0.0);
  Turn(slips, Volts(0.7 * static_v), {}, 0.5);
  EXPECT_EQ(slips.speed_rad_s(), 0.0);
}

TEST(Winch, BrakeHoldsTheRatedTensionWithoutCreep) {
  Winch winch;
  WinchCommand braked;
  Turn(winch, braked, ConstantTension(1.0), 1.0);
  EXPECT_EQ(winch.reeled_m(), 0.0);
}

TEST(Winch, SlackCableHasNoTensionAndTautOneIsASpring) {
  Winch winch;
  Surroundings around;
  around.cable = {0.0, 500.0, 0.01};
  Turn(winch, Volts(2.0), around, 0.02);
  EXPECT_LT(winch.reeled_m(), 0.01);
  EXPECT_EQ(winch.tension_n(), 0.0);
  Turn(winch, Volts(2.0), around, 2.0);
  EXPECT_GT(winch.reeled_m(), 0.01);
  EXPECT_NEAR(winch.tension_n(), 500.0 * (winch.reeled_m() - 0.01), 1e-6);
}

double Imbalance(const Winch& winch) {
  const WinchEnergy& e = winch.energy();
  return e.supply_j - e.ohmic_j - e.friction_j - e.cable_j - winch.stored_energy_j();
}

TEST(Winch, EnergyOfMotorAndWinchBalancesToRoundOff) {
  std::mt19937 random(20240611);
  std::uniform_real_distribution<double> volts(-12.0, 12.0);
  Winch winch;
  Surroundings around;
  around.cable = {0.5, 800.0, 0.0};
  double turned_over_j = 0.0;
  for (int i = 0; i < 20000; ++i) {
    const double voltage_v = volts(random);
    const bool powered = i / 500 % 5 != 4;
    for (int k = 0; k < 5; ++k) {
      winch.Step({powered, voltage_v, i / 700 % 7 == 6}, around);
      turned_over_j += std::abs(voltage_v * winch.current_a()) * kSubStep_s;
    }
  }
  EXPECT_GT(turned_over_j, 1.0);
  // 1e5 sub-steps of round-off, each some 1e-16 of what turns over.
  constexpr double kRoundOff = 1e-11;
  EXPECT_NEAR(Imbalance(winch), 0.0, kRoundOff * turned_over_j);
}

TEST(Winch, WorkOnATautSpringIsItsEnergy) {
  Winch winch;
  Surroundings around;
  around.cable = {0.1, 500.0, 0.0};
  Turn(winch, Volts(3.0), around, 0.7);
  const double x = winch.reeled_m();
  const double spring_j = 0.1 * x + 0.5 * 500.0 * x * x;
  ASSERT_GT(spring_j, 1e-4);
  EXPECT_NEAR(winch.energy().cable_j, spring_j, 1e-12 + 1e-9 * spring_j);
}

TEST(Winch, FrictionOnlyEverTakesEnergy) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> volts(-3.0, 3.0);
  Winch winch;
  Surroundings around;
  around.cable = {0.3, 300.0, 0.0};
  int reversals = 0;
  for (int i = 0; i < 50000; ++i) {
    const double before_j = winch.energy().friction_j;
    const double before_rad_s = winch.speed_rad_s();
    winch.Step(Volts(volts(random)), around);
    const double taken_j = winch.energy().friction_j - before_j;
    const bool reversed = before_rad_s * winch.speed_rad_s() <= 0.0;
    reversals += reversed ? 1 : 0;
    // Friction acts at the mean speed of the sub-step: where the rotor reverses or stops, the mean
    // may point the other way, by less than half the change of speed.
    const double friction_nm =
        kMotor.friction_torque_nm + 0.2 * winch.metres_per_rad() * (winch.tension_n() + 0.3);
    const double within_j =
        reversed ? 0.5 * friction_nm * std::abs(winch.speed_rad_s() - before_rad_s) * kSubStep_s
                 : 1e-18;
    ASSERT_GE(taken_j, -within_j) << i;
  }
  EXPECT_GT(reversals, 100);
  EXPECT_GT(winch.energy().friction_j, 1e-3);
}

TEST(Winch, AnyStiffnessIsStable) {
  for (const double stiffness_n_m : {1e2, 1e4, 1e6, 1e9}) {
    Winch winch;
    Surroundings around;
    around.cable = {0.0, stiffness_n_m, 0.001};
    Turn(winch, Volts(4.0), around, 1.0);
    Turn(winch, Volts(0.0), around, 1.0);
    EXPECT_TRUE(std::isfinite(winch.tension_n()));
    EXPECT_LT(std::abs(winch.rate_m_s()), 1e-3) << stiffness_n_m;
    // Friction holds at most the static torque's worth of tension.
    const double held_n = kMotor.friction_torque_nm * kMotor.stiction_ratio /
                          (winch.metres_per_rad() * kWinch.gear_efficiency * 0.8);
    EXPECT_LE(winch.tension_n(), held_n) << stiffness_n_m;
  }
}

TEST(Winch, SubStepOfTenthMillisecondHasConverged) {
  const auto reeled = [](double step_s) {
    Winch winch(kMotor, kWinch, step_s);
    Surroundings around;
    around.cable = {0.0, 500.0, 0.002};
    const auto steps = static_cast<int>(std::lround(0.1 / step_s));
    for (int i = 0; i < steps; ++i) winch.Step(Volts(3.0), around);
    return winch.reeled_m();
  };
  const double reference_m = reeled(1e-6);
  // 0.1 % of what is reeled in, a tenth of a count's worth of cable at this length.
  EXPECT_NEAR(reeled(1e-4), reference_m, 1e-3 * reference_m);
  EXPECT_LT(std::abs(reeled(1e-5) - reference_m), std::abs(reeled(1e-4) - reference_m));
}

TEST(Winch, EncoderCountsFloorTheAngle) {
  Winch winch;
  Turn(winch, Volts(1.5), {}, 0.2);
  const double counts = winch.angle_rad() / (2.0 * std::numbers::pi) * kWinch.counts_per_turn;
  EXPECT_EQ(winch.encoder_counts(), static_cast<std::int64_t>(std::floor(counts)));
  EXPECT_GT(winch.encoder_counts(), 100);
  // Object 6092: one drum turn is 31416 um and 4 x 2048 counts.
  EXPECT_NEAR(winch.reeled_m(), counts * 31416e-6 / 8192.0, 1e-12);
  Winch back;
  Turn(back, Volts(-1.5), {}, 0.2);
  EXPECT_EQ(back.encoder_counts(), -winch.encoder_counts() - 1);
}

TEST(Winch, StalledMotorHeatsAndItsCurrentFalls) {
  Winch winch;
  Surroundings around;
  for (int ms = 0; ms < 10'000; ++ms) {
    Turn(winch, {true, 12.0, true}, around, 1e-3);
    winch.AdvanceThermal(around, 1e-3);
  }
  EXPECT_GT(winch.winding_c(), 60.0);
  EXPECT_LT(winch.current_a(), 12.0 / kMotor.resistance_ohm / 1.1);
}

TEST(Winch, NeverNan) {
  std::mt19937 random(99);
  std::uniform_real_distribution<double> exponent(-3.0, 9.0);
  std::uniform_real_distribution<double> volts(-1000.0, 1000.0);
  Winch winch;
  Surroundings around;
  for (int i = 0; i < 20000; ++i) {
    around.cable = {std::pow(10.0, exponent(random)), std::pow(10.0, exponent(random)),
                    volts(random) * 1e-3};
    winch.Step({i % 3 != 0, volts(random), i % 11 == 0}, around);
    if (i % 10 == 0) winch.AdvanceThermal(around, 1e-3);
    ASSERT_TRUE(std::isfinite(winch.speed_rad_s() + winch.angle_rad() + winch.current_a() +
                              winch.tension_n() + winch.winding_c()))
        << i;
  }
}

}  // namespace
}  // namespace mantle::firmware_sim
