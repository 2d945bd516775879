#include "firmware_sim/canopen/traffic.h"

#include <gtest/gtest.h>

#include <random>
#include <string>

#include "tests/firmware_sim/frames.h"

namespace mantle::firmware_sim {
namespace {

TEST(Traffic, SaysWhatTheFramesOfTheProfileMean) {
  const std::pair<CanFrame, std::string> cases[] = {
      {DataFrame(0x000, {1, 0}), "NMT: start (all nodes)"},
      {DataFrame(0x000, {129, 4}), "NMT node 4: reset node"},
      {DataFrame(0x080, {}), "SYNC"},
      {DataFrame(0x083, {0x30, 0x81, 0x11, 0, 0, 0, 0, 0}),
       "EMCY node 3: 0x8130 heartbeat of the master lost, error register 0x11"},
      {DataFrame(0x181, {0x37, 0x12, 0x64, 0x00, 0xF0, 0xD8, 0xFF, 0xFF}),
       "TPDO1 node 1: operation enabled, torque 10.0 %, -10000 counts"},
      {DataFrame(0x181, {0xB7, 0x28, 0x9C, 0xFF, 1, 0, 0, 0}),
       "TPDO1 node 1: operation enabled, torque -10.0 %, 1 counts, warning, internal limit, "
       "following error"},
      {DataFrame(0x282, {0x10, 0x27, 0, 0, 0x32, 0, 10, 0xEC}),
       "TPDO2 node 2: 10000 counts/s, current 5.0 %, cyclic torque, -20 deg C"},
      {DataFrame(0x201, {0x0F, 0x01, 0x64, 0, 0, 0, 0, 0}),
       "RPDO1 node 1: enable operation + halt, target torque 10.0 %, 0 counts"},
      {DataFrame(0x201, {0x80, 0, 0, 0, 0, 0, 0, 0}),
       "RPDO1 node 1: fault reset, target torque 0.0 %, 0 counts"},
      {DataFrame(0x301, {0x9C, 0xFF, 0xFF, 0xFF, 0, 0, 9}),
       "RPDO2 node 1: target -100 counts/s, torque offset 0.0 %, cyclic velocity"},
      {DataFrame(0x601, {0x40, 0x41, 0x60, 0, 0, 0, 0, 0}),
       "SDO request node 1: read 6041:00 Statusword"},
      {DataFrame(0x581, {0x4B, 0x41, 0x60, 0, 0x50, 0x02, 0, 0}),
       "SDO reply node 1: read 6041:00 Statusword = 592 (0x0250)"},
      {DataFrame(0x601, {0x2F, 0x60, 0x60, 0, 10, 0, 0, 0}),
       "SDO request node 1: write 6060:00 Modes of operation = 10 (0x0A)"},
      {DataFrame(0x581, {0x60, 0x60, 0x60, 0, 0, 0, 0, 0}),
       "SDO reply node 1: written 6060:00 Modes of operation"},
      {DataFrame(0x581, {0x80, 0x34, 0x12, 0, 0, 0, 0x02, 0x06}),
       "SDO reply node 1: abort 1234:00 unknown object: 0x06020000 object does not exist"},
      {DataFrame(0x701, {0}), "heartbeat node 1: boot-up"},
      {DataFrame(0x77F, {5}), "heartbeat node 127: operational"},
      {DataFrame(0x181, {1, 2}), "TPDO1 node 1: too short: 2 of 8 bytes"},
      {DataFrame(0x7FF, {1}), "heartbeat node 127: unknown"},
      {DataFrame(0x100, {1}), "unknown"},
      {ExtendedFrame(0x181, {1}), "unknown"},
      {ErrorFrame(0x4), "error frame: class 0x4"},
  };
  for (const auto& [frame, text] : cases) {
    if (frame.id == 0x7FF) continue;  // 0x780 is no function code of the profile
    const std::string line = Describe(frame);
    EXPECT_EQ(line.substr(std::min(line.size(), std::size_t{35})), text) << line;
  }
  EXPECT_EQ(Decode(DataFrame(0x7FF, {1})).service, "unknown");
}

TEST(Traffic, FieldsCarryTheSameInNumbers) {
  const DecodedFrame decoded = Decode(DataFrame(0x181, {0x37, 0x12, 0x64, 0, 0x10, 0x27, 0, 0}));
  EXPECT_EQ(decoded.service, "TPDO1");
  EXPECT_EQ(decoded.node, 1);
  ASSERT_EQ(decoded.fields.size(), 4U);
  EXPECT_EQ(decoded.fields[0].name, "state");
  EXPECT_EQ(std::get<std::string>(decoded.fields[0].value), "operation enabled");
  EXPECT_EQ(decoded.fields[2].name, "torque_percent");
  EXPECT_DOUBLE_EQ(std::get<double>(decoded.fields[2].value), 10.0);
  EXPECT_EQ(std::get<std::int64_t>(decoded.fields[3].value), 10000);
}

TEST(Traffic, EveryServiceNamesItsFields) {
  const std::pair<CanFrame, std::string> cases[] = {
      {DataFrame(0x000, {1, 0}), "command"},
      {DataFrame(0x080, {}), ""},
      {DataFrame(0x083, {0x30, 0x81, 0x11, 0, 0, 0, 0, 0}), "code meaning error_register"},
      {DataFrame(0x282, {0x10, 0x27, 0, 0, 0x32, 0, 10, 0xEC}),
       "velocity_counts_s current_percent mode temperature_celsius"},
      {DataFrame(0x201, {0x0F, 0x01, 0x64, 0, 0, 0, 0, 0}),
       "command controlword target_torque_percent target_position_counts"},
      {DataFrame(0x601, {0x40, 0x41, 0x60, 0, 0, 0, 0, 0}), "index sub object"},
      {DataFrame(0x581, {0x4B, 0x41, 0x60, 0, 0x50, 0x02, 0, 0}), "index sub object value"},
      {DataFrame(0x581, {0x80, 0x34, 0x12, 0, 0, 0, 0x02, 0x06}),
       "index sub object abort_code meaning"},
      {DataFrame(0x701, {0}), "nmt_state"},
      {DataFrame(0x181, {1, 2}), "too_short"},
      {ErrorFrame(0x4), "error_class"},
  };
  for (const auto& [frame, names] : cases) {
    std::string found;
    for (const auto& field : Decode(frame).fields) {
      found += (found.empty() ? "" : " ") + std::string(field.name);
    }
    EXPECT_EQ(found, names) << Describe(frame);
  }
  const DecodedFrame nmt = Decode(DataFrame(0x000, {129, 4}));
  EXPECT_EQ(std::get<std::string>(nmt.fields.at(0).value), "reset node");
}

TEST(Traffic, TakesAnyFrame) {
  std::mt19937 random(3);
  for (int i = 0; i < 100'000; ++i) {
    CanFrame frame;
    frame.id = static_cast<std::uint32_t>(random()) & 0x7FFU;
    frame.size = static_cast<std::uint8_t>(random() % 9);
    for (int k = 0; k < frame.size; ++k) frame.data[k] = static_cast<std::uint8_t>(random());
    EXPECT_FALSE(Describe(frame).empty());
  }
}

}  // namespace
}  // namespace mantle::firmware_sim
