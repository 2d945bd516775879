#include "firmware_sim/drive/power_stage.h"

#include <gtest/gtest.h>

#include <cmath>

#include "firmware_sim/drive/winch.h"

namespace mantle::firmware_sim {
namespace {

constexpr MotorData kMotor;
constexpr double kSupply_v = 12.0;

struct Response {
  double final_a{0.0};
  double peak_a{0.0};
};

/// The stage drives a winch for `steps` sub-steps; the estimate of the speed is `speed_share` of
/// it.
Response Drive(double reference_a, int steps, double speed_share, bool locked, double winding_c) {
  Winch winch;
  winch.SetTemperatures(winding_c, winding_c);
  winch.AdvanceThermal({}, 1e-6);
  CurrentRegulator regulator;
  Response response;
  for (int i = 0; i < steps; ++i) {
    WinchCommand command{true, 0.0, locked};
    command.voltage_v = regulator.Voltage(kMotor, reference_a, winch.current_a(),
                                          speed_share * winch.speed_rad_s(), kSupply_v);
    EXPECT_LE(std::abs(command.voltage_v), kSupply_v);
    winch.Step(command, {});
    response.peak_a = std::max(response.peak_a, std::abs(winch.current_a()));
  }
  response.final_a = winch.current_a();
  return response;
}

TEST(PowerStage, CurrentStandsWithinOneSubStepOnALockedRotor) {
  // exp(-100 us / 21 us) of the step is left.
  EXPECT_NEAR(Drive(0.2, 1, 1.0, true, 22.0).final_a, 0.2, 0.01 * 0.2);
}

TEST(PowerStage, AHotWindingIsMadeUpForByTheIntegral) {
  const Response first = Drive(0.2, 1, 1.0, true, 100.0);
  EXPECT_LT(first.final_a, 0.17);
  EXPECT_NEAR(Drive(0.2, 200, 1.0, true, 100.0).final_a, 0.2, 1e-6);
}

TEST(PowerStage, NeverOvershootsTheTripLevel) {
  for (const double reference_a : {0.1, 0.3, 0.52, -0.52}) {
    const Response response = Drive(reference_a, 400, 1.0, false, 22.0);
    EXPECT_LT(response.peak_a, PowerStageData{}.over_current_a);
  }
}

TEST(PowerStage, SaturatesAtTheSupplyWithoutWindingUp) {
  // No-load speed takes all the voltage; the reference cannot be reached.
  Winch winch;
  CurrentRegulator regulator;
  for (int i = 0; i < 5000; ++i) {
    const double voltage_v =
        regulator.Voltage(kMotor, 0.3, winch.current_a(), winch.speed_rad_s(), kSupply_v);
    winch.Step({true, voltage_v, false}, {});
  }
  EXPECT_NEAR(winch.speed_rad_s() / kMotor.no_load_speed_rad_s, 1.0, 0.01);
  // Asked for nothing, the current is gone within a few sub-steps.
  for (int i = 0; i < 30; ++i) {
    const double voltage_v =
        regulator.Voltage(kMotor, 0.0, winch.current_a(), winch.speed_rad_s(), kSupply_v);
    winch.Step({true, voltage_v, false}, {});
  }
  EXPECT_NEAR(winch.current_a(), 0.0, 0.003);
}

}  // namespace
}  // namespace mantle::firmware_sim
