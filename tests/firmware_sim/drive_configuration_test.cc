#include "firmware_sim/master/drive_configuration.h"

#include <gtest/gtest.h>

#include <map>
#include <stdexcept>
#include <string>
#include <vector>

#include "firmware_sim/canopen/object_dictionary.h"

namespace mantle::firmware_sim {
namespace {

std::vector<SdoWrite> AllSteps(const DriveSettings& settings, NodeId node) {
  std::vector<SdoWrite> steps;
  while (const auto write = ConfigurationStep(settings, node, steps.size())) {
    steps.push_back(*write);
  }
  return steps;
}

TEST(DriveConfiguration, WritesTheMappingOfTheProfileByteForByte) {
  std::map<unsigned, std::uint32_t> values;  // index << 8 | sub -> the last value written
  for (const SdoWrite& write : AllSteps({}, 3)) {
    values[unsigned{write.object.index} << 8U | write.object.sub] = write.value;
  }
  const std::map<unsigned, std::uint32_t> profile = {
      {0x140001, 0x203},      {0x140002, 1},          {0x140005, 100},
      {0x160000, 3},          {0x160001, 0x60400010}, {0x160002, 0x60710010},
      {0x160003, 0x607A0020}, {0x140101, 0x303},      {0x140102, 1},
      {0x160100, 3},          {0x160101, 0x60FF0020}, {0x160102, 0x60B20010},
      {0x160103, 0x60600008}, {0x180001, 0x40000183},      {0x180002, 1},
      {0x1A0000, 3},          {0x1A0001, 0x60410010}, {0x1A0002, 0x60770010},
      {0x1A0003, 0x60640020}, {0x180101, 0x40000283},      {0x180102, 1},
      {0x1A0100, 4},          {0x1A0101, 0x606C0020}, {0x1A0102, 0x60780010},
      {0x1A0103, 0x60610008}, {0x1A0104, 0x22000008}, {0x101601, 0x7F00C8},
      {0x101700, 100},        {0x60C201, 10},         {0x60C202, 0xFD},
      {0x608700, 10000},      {0x606000, 10}};
  for (const auto& [object, value] : profile) {
    ASSERT_TRUE(values.count(object)) << std::hex << object;
    EXPECT_EQ(values[object], value) << std::hex << object;
  }
}

TEST(DriveConfiguration, EverySizeIsThatOfTheObject) {
  for (const SdoWrite& write : AllSteps({}, 1)) {
    const FoundObject found = FindObject(write.object.index, write.object.sub);
    ASSERT_EQ(found.abort, SdoAbort::kNone) << std::hex << write.object.index;
    EXPECT_EQ(write.size, ByteSize(kObjectTable[found.slot].type))
        << std::hex << write.object.index;
  }
}

TEST(DriveConfiguration, MapsOnlyWhileThePdoIsInvalid) {
  std::map<unsigned, bool> valid{{0x1400, true}, {0x1401, true}, {0x1800, true}, {0x1801, true}};
  for (const SdoWrite& write : AllSteps({}, 1)) {
    const unsigned index = write.object.index;
    if (valid.count(index) && write.object.sub == 1) {
      valid[index] = (write.value & kPdoInvalid) == 0;
    }
    if (valid.count(index - 0x200)) {
      EXPECT_FALSE(valid[index - 0x200]) << std::hex << index;
    }
  }
  for (const auto& [index, is_valid] : valid) EXPECT_TRUE(is_valid) << std::hex << index;
}

TEST(DriveConfiguration, WithoutTheSecondPdosTheyAreSwitchedOff) {
  for (const SdoWrite& write : AllSteps({.second_pdos = false}, 1)) {
    if (write.object.index == 0x1401 || write.object.index == 0x1801) {
      EXPECT_EQ(write.value & kPdoInvalid, kPdoInvalid);
    }
    EXPECT_NE(write.object.index, 0x1601);
  }
}

TEST(DriveConfiguration, RefusesWhatCannotWork) {
  EXPECT_NO_THROW(CheckSettings({}));
  EXPECT_THROW(CheckSettings({.period_us = 500}), std::invalid_argument);
  EXPECT_THROW(CheckSettings({.period_us = 300'000}), std::invalid_argument);
  EXPECT_THROW(CheckSettings({.rpdo_timeout_us = 0}), std::invalid_argument);
  EXPECT_THROW(CheckSettings({.torque_slope_permille_s = 0}), std::invalid_argument);
  EXPECT_THROW(CheckSettings({.max_torque_permille = 3000}), std::invalid_argument);
  EXPECT_THROW(CheckSettings({.min_position_counts = 5, .max_position_counts = 4}),
               std::invalid_argument);
}

}  // namespace
}  // namespace mantle::firmware_sim
