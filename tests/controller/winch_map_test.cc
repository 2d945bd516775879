#include "controller/winch_map.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <stdexcept>

#include "tests/controller/winches.h"

namespace mantle::controller {
namespace {

constexpr double kRoundOff = 1e-12;

TEST(WinchMap, HaulingAndPayingOutAreTheGearsTwoEfficiencies) {
  WinchMap map = SmallWinch();
  map.friction_torque_nm = 0.0;
  const double lossless = map.metres_per_rad * 0.5 / map.permille_nm;
  EXPECT_NEAR(TensionToTorque(map, 0.5, 1.0), lossless / 0.9, kRoundOff * lossless);
  EXPECT_NEAR(TensionToTorque(map, 0.5, -1.0), lossless * 0.9, kRoundOff * lossless);
}

TEST(WinchMap, DryFrictionAloneIs64MillinewtonsAtTheCable) {
  EXPECT_NEAR(FrictionForce(SmallWinch(), 0.0), 0.064, kRoundOff);
  EXPECT_EQ(FrictionForce(SmallWinch(), -1.0), FrictionForce(SmallWinch(), 0.0));
}

TEST(WinchMap, TorqueToTensionInvertsTensionToTorque) {
  const WinchMap map = SmallWinch();
  for (const double tension_n : {0.0, 0.02, 0.3, 0.8}) {
    for (const double sigma : {-1.0, -0.3, 0.0, 0.7, 1.0}) {
      for (const double acceleration : {-2.0, 0.0, 1.0}) {
        const double torque = TensionToTorque(map, tension_n, sigma, acceleration);
        EXPECT_NEAR(TorqueToTension(map, torque, sigma, acceleration), tension_n, kRoundOff);
      }
    }
  }
}

TEST(WinchMap, ACableDoesNotPush) { EXPECT_EQ(TorqueToTension(SmallWinch(), -500.0, 0.0), 0.0); }

TEST(WinchMap, RefusesImpossibleFiguresByName) {
  WinchMap map = SmallWinch();
  map.gear_efficiency = 1.2;
  EXPECT_THROW(CheckWinchMap(map), std::invalid_argument);
  map = SmallWinch();
  map.inertia_kgm2 = std::numeric_limits<double>::quiet_NaN();
  try {
    CheckWinchMap(map);
    FAIL() << "not refused";
  } catch (const std::invalid_argument& error) {
    EXPECT_NE(std::string(error.what()).find("inertia"), std::string::npos) << error.what();
  }
}

}  // namespace
}  // namespace mantle::controller
