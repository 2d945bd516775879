#include "firmware_sim/bus/recording_bus.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <string>

#include "firmware_sim/bus/loop_bus.h"
#include "tests/firmware_sim/frames.h"

namespace mantle::firmware_sim {
namespace {

TEST(RecordingBus, WritesBothDirectionsInOrderAndOnlyWhatTheBusTook) {
  const std::string path = ::testing::TempDir() + "mantle_recording_bus_test.log";
  {
    LoopMedium medium;
    auto inner = medium.MakeStation();
    auto other = medium.MakeStation();
    CandumpWriter writer(path, "loop0");
    RecordingBus bus(*inner, writer);
    medium.AdvanceTo(10);
    bus.AdvanceTo(10);
    const CanFrame request = DataFrame(0x601, {0x40, 0x00, 0x10, 0});
    EXPECT_EQ(bus.Send({&request, 1}), BusStatus::kOk);
    medium.AdvanceTo(20);
    bus.AdvanceTo(20);
    const CanFrame reply = DataFrame(0x581, {0x43});
    other->Send({&reply, 1});
    EXPECT_EQ(Drain(bus).size(), 1U);
    medium.SetUp(false);
    EXPECT_EQ(bus.Send({&request, 1}), BusStatus::kDown);
    EXPECT_TRUE(writer.Flush());
  }
  std::ifstream in(path);
  std::string line;
  std::getline(in, line);
  EXPECT_EQ(line, "(0000000000.000010) loop0 601#40001000");
  std::getline(in, line);
  EXPECT_EQ(line, "(0000000000.000020) loop0 581#43");
  EXPECT_FALSE(std::getline(in, line));
  std::filesystem::remove(path);
}

}  // namespace
}  // namespace mantle::firmware_sim
