#include <fmt/format.h>
#include <gtest/gtest.h>

#include "loop/control_side/simulated_winch.h"
#include "tests/loop/vehicle.h"
#include "tests/loop/vehicles.h"

// A master enables the drives that its scene's winches are made of, and no others.

namespace mantle::loop {
namespace {

Status BringUpWith(const std::vector<firmware_sim::ExpectedObject>& expected, bool* enabled) {
  const model::Plant plant(tests::ClampedArm(4));
  VehicleOptions options;
  options.supervisor.expected = expected;
  Vehicle vehicle(plant, tests::LoopRun(), {tests::CableMotor("a", 0)}, {}, options);
  const Status status = vehicle.BringUp();
  *enabled = vehicle.drive(0).state() == firmware_sim::DriveState::kOperationEnabled;
  return status;
}

TEST(Identity, TheSimulatedDrivesAreWhatTheMapOfTheirWinchExpects) {
  bool enabled = false;
  const Status status = BringUpWith(ExpectedOfWinch(), &enabled);
  EXPECT_TRUE(status.ok) << status.reason;
  EXPECT_TRUE(enabled);
}

TEST(Identity, AnyOtherValueIsRefusedWithNodeObjectValueAndWhatItMustBe) {
  for (std::size_t i = 0; i < ExpectedOfWinch().size(); ++i) {
    std::vector<firmware_sim::ExpectedObject> expected = ExpectedOfWinch();
    expected[i].value += 2;
    bool enabled = true;
    const Status status = BringUpWith(expected, &enabled);
    EXPECT_FALSE(status.ok);
    EXPECT_FALSE(enabled);
    const std::string object =
        fmt::format("object {:04X}:{:02X} is 0x{:X}, must be 0x{:X}", expected[i].object.index,
                    expected[i].object.sub, expected[i].value - 2, expected[i].value);
    EXPECT_NE(status.reason.find(object), std::string::npos) << status.reason;
    EXPECT_NE(status.reason.find("node 1"), std::string::npos) << status.reason;
  }
}

}  // namespace
}  // namespace mantle::loop
