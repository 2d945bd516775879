#include <gtest/gtest.h>
#include <unistd.h>

#include <stdexcept>
#include <string>
#include <system_error>

#include "firmware_sim/bus/open_bus.h"
#include "tests/loop/bus_runs.h"

// Multicast on the loopback interface of this machine: nothing leaves it.

namespace mantle::loop {
namespace {

// A port of this process, so that runs side by side do not hear each other.
std::string Udp() { return "udp:239.74.163.2:" + std::to_string(20000 + getpid() % 20000) + "@lo"; }

TEST(Bus, MulticastGivesTheInProcessFramesToTheLastBit) { ExpectSameAsInProcess(RunOn(Udp())); }

TEST(Bus, FramesOfOthersDoNotChangeTheRun) {
  const std::string bus = Udp();
  // A bystander that answers for a node nobody has, all the time.
  auto bystander = firmware_sim::OpenBus(bus);
  const model::Plant plant(tests::ClampedArm());
  Vehicle vehicle(plant, tests::LoopRun(), {tests::CableMotor("a", 0)}, {.bus = bus});
  ASSERT_TRUE(vehicle.BringUp().ok);
  firmware_sim::CanFrame noise;
  noise.id = firmware_sim::CobTpdo1(99);
  noise.size = 8;
  for (int k = 0; k < 20; ++k) {
    bystander->Send({&noise, 1});
    const MotorCommand command{40};
    const Status status = vehicle.Cycle({&command, 1});
    ASSERT_TRUE(status.ok) << status.reason;
  }
  EXPECT_EQ(vehicle.report(0).tpdo1_late, 0U);
}

TEST(Bus, ABusThatDoesNotExistIsRefused) {
  const model::Plant plant(tests::ClampedArm());
  for (const char* bus : {"can:no_such_bus", "carrier pigeon"}) {
    EXPECT_ANY_THROW(Vehicle(plant, tests::LoopRun(), {tests::CableMotor("a", 0)}, {.bus = bus}))
        << bus;
  }
}

}  // namespace
}  // namespace mantle::loop
