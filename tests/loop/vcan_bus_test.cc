#include <gtest/gtest.h>

#include "tests/firmware_sim/vcan.h"
#include "tests/loop/bus_runs.h"

// Runs where vcan0 exists, through tools/vcan_run.

namespace mantle::loop {
namespace {

TEST(VcanBus, ARealVcanGivesTheInProcessFramesToTheLastBit) {
  ASSERT_TRUE(firmware_sim::HasVcan());
  ExpectSameAsInProcess(RunOn("can:vcan0"));
}

TEST(VcanBus, ALinkThatGoesDownIsAnErrorThatNamesTheBus) {
  ASSERT_TRUE(firmware_sim::HasVcan());
  const model::Plant plant(tests::ClampedArm());
  Vehicle vehicle(plant, tests::LoopRun(), {tests::CableMotor("a", 0)}, {.bus = "can:vcan0"},
                  {.bus_timeout_us = 100'000});
  ASSERT_TRUE(vehicle.BringUp().ok);
  firmware_sim::Shell("ip link set vcan0 down");
  const MotorCommand command{40};
  Status status;
  for (int k = 0; k < 10 && status.ok; ++k) status = vehicle.Cycle({&command, 1});
  firmware_sim::Shell("ip link set vcan0 up");
  EXPECT_FALSE(status.ok);
  EXPECT_NE(status.reason.find("can:vcan0"), std::string::npos) << status.reason;
}

}  // namespace
}  // namespace mantle::loop
