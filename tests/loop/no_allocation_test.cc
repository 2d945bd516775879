#include <gtest/gtest.h>

#include "tests/loop/vehicle.h"
#include "tests/loop/vehicles.h"
#include "tests/support/allocation_counter.h"

namespace mantle::loop {
namespace {

TEST(NoAllocation, ACycleOfTheVehicleAllocatesNothing) {
  if (!tests::kCountsAllocations) GTEST_SKIP() << "allocations are not counted here";
  const model::Plant plant(tests::SwimmingRobot());
  Vehicle vehicle(plant, tests::LoopRun(), tests::FiveMotors(), {});
  ASSERT_TRUE(vehicle.BringUp().ok);
  const MotorCommand commands[5] = {{60}, {0}, {0}, {0}, {60}};
  ASSERT_TRUE(vehicle.Cycle(commands).ok);
  const long before = tests::allocation_count;
  bool ok = true;
  for (int k = 0; k < 50; ++k) ok = vehicle.Cycle(commands).ok && ok;
  EXPECT_EQ(tests::allocation_count - before, 0);
  EXPECT_TRUE(ok);
}

}  // namespace
}  // namespace mantle::loop
