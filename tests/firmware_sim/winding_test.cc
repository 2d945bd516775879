#include "firmware_sim/drive/winding.h"

#include <gtest/gtest.h>

#include <cmath>

namespace mantle::firmware_sim {
namespace {

constexpr MotorData kMotor;
/// Relative round-off of a few hundred steps of exact exponentials.
constexpr double kRoundOff = 1e-12;

TEST(Winding, LockedRotorCurrentIsTheStepResponseOfRL) {
  constexpr double kStep_s = 5e-6;
  constexpr double kVoltage_v = 6.0;
  Winding winding(kMotor, kStep_s);
  const double tau_s = kMotor.inductance_h / kMotor.resistance_ohm;
  for (int i = 1; i <= 40; ++i) {
    winding.Advance(kVoltage_v, 0.0);
    const double exact_a =
        kVoltage_v / kMotor.resistance_ohm * (1.0 - std::exp(-i * kStep_s / tau_s));
    EXPECT_NEAR(winding.current_a(), exact_a, kRoundOff);
  }
}

TEST(Winding, CoarseStepLandsOnTheFineOnes) {
  Winding fine(kMotor, 1e-6);
  Winding coarse(kMotor, 1e-4);
  for (int i = 0; i < 100; ++i) fine.Advance(9.0, 300.0);
  coarse.Advance(9.0, 300.0);
  EXPECT_NEAR(fine.current_a(), coarse.current_a(), kRoundOff);
}

TEST(Winding, MeanCurrentIsTheIntegralOfTheCurrent) {
  constexpr int kParts = 20000;
  Winding coarse(kMotor, 1e-4);
  Winding fine(kMotor, 1e-4 / kParts);
  coarse.Advance(12.0, 0.0);  // both start from the same current, off its steady value
  for (int i = 0; i < kParts; ++i) fine.Advance(12.0, 0.0);
  const MeanCurrent mean = coarse.Mean(-3.0);
  constexpr double kSpeed_rad_s = 200.0;
  double sum_a = 0.0;
  for (int i = 0; i < kParts; ++i) {
    const double before_a = fine.current_a();
    fine.Advance(-3.0, kSpeed_rad_s);
    sum_a += 0.5 * (before_a + fine.current_a());
  }
  // The trapezoidal rule over 20000 parts of five time constants.
  constexpr double kQuadrature = 1e-8;
  EXPECT_NEAR(mean.at_rest_a - mean.slope_a_s * kSpeed_rad_s, sum_a / kParts, kQuadrature);
}

TEST(Winding, ElectricalEnergyBalances) {
  constexpr double kStep_s = 1e-4;
  Winding winding(kMotor, kStep_s);
  double supplied_j = 0.0;
  double lost_j = 0.0;
  double mechanical_j = 0.0;
  for (int i = 0; i < 500; ++i) {
    const double voltage_v = 12.0 * std::sin(0.37 * i);
    const double speed_rad_s = 400.0 * std::cos(0.05 * i);
    const MeanCurrent mean = winding.Mean(voltage_v);
    const double mean_a = mean.at_rest_a - mean.slope_a_s * speed_rad_s;
    lost_j += winding.Advance(voltage_v, speed_rad_s);
    supplied_j += voltage_v * mean_a * kStep_s;
    mechanical_j += kMotor.torque_constant_nm_a * mean_a * speed_rad_s * kStep_s;
  }
  EXPECT_GT(lost_j, 1e-3);
  EXPECT_NEAR(supplied_j, lost_j + mechanical_j + winding.magnetic_energy_j(),
              kRoundOff * lost_j * 100);
}

TEST(Winding, ResistanceFollowsCopper) {
  Winding winding(kMotor, 1e-4);
  winding.SetTemperature(122.0, 1.0);
  EXPECT_NEAR(winding.resistance_ohm(), 19.8 * 1.39, 1e-9);
  winding.SetTemperature(22.0, 0.1);
  EXPECT_NEAR(winding.resistance_ohm(), 1.98, 1e-9);
}

TEST(ThermalModel, HeatsAlongTheTwoExponentialsOfTheDataSheet) {
  constexpr double kPower_w = 1.5;
  constexpr double kAmbient_c = 15.0;
  constexpr double kStep_s = 1e-3;
  const double cw = kMotor.winding_time_constant_s / kMotor.winding_to_housing_k_w;
  const double ch = kMotor.housing_time_constant_s / kMotor.housing_to_ambient_k_w;
  const double r1 = kMotor.winding_to_housing_k_w;
  const double r2 = kMotor.housing_to_ambient_k_w;
  // d/dt (w, h) = A (w, h) + b about the steady state; eigenvalues of the 2 x 2 matrix.
  const double a11 = -1.0 / (r1 * cw);
  const double a12 = 1.0 / (r1 * cw);
  const double a21 = 1.0 / (r1 * ch);
  const double a22 = -(1.0 / r1 + 1.0 / r2) / ch;
  const double half = 0.5 * (a11 + a22);
  const double root = std::sqrt(half * half - (a11 * a22 - a12 * a21));
  const double l1 = half + root;
  const double l2 = half - root;
  const double steady_h = kAmbient_c + kPower_w * r2;
  const double steady_w = steady_h + kPower_w * r1;
  const double w0 = kAmbient_c - steady_w;
  const double h0 = kAmbient_c - steady_h;
  // Coefficients of the winding's two exponentials from its value and slope at t = 0.
  const double slope0 = a11 * w0 + a12 * h0;
  const double c1 = (slope0 - l2 * w0) / (l1 - l2);
  const double c2 = w0 - c1;
  ThermalModel model{kAmbient_c, kAmbient_c};
  // Explicit Euler at 1 ms against 5.6 s: 1e-4 of the rise of 58 K.
  constexpr double kStepError_k = 6e-3;
  for (int ms = 1; ms <= 600'000; ++ms) {
    model.Advance(kMotor, kPower_w, kAmbient_c, kStep_s);
    if (ms % 1000 != 0) continue;
    const double t = ms * kStep_s;
    const double exact = steady_w + c1 * std::exp(l1 * t) + c2 * std::exp(l2 * t);
    ASSERT_NEAR(model.winding_c, exact, kStepError_k) << t << " s";
  }
}

TEST(ThermalModel, WindingTimeConstantIsRow18) {
  // Housing held: the winding alone reaches 1 - 1/e of its rise after tau_w1.
  ThermalModel model{22.0, 22.0};
  for (int ms = 0; ms < 5600; ++ms) {
    model.Advance(kMotor, 1.0, 22.0, 1e-3);
    model.housing_c = 22.0;
  }
  constexpr double kStepError = 1e-3;
  EXPECT_NEAR((model.winding_c - 22.0) / 10.0, 1.0 - std::exp(-1.0), kStepError);
}

}  // namespace
}  // namespace mantle::firmware_sim
