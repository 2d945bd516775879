#include "firmware_sim/bus/open_bus.h"

#include <gtest/gtest.h>

#include <stdexcept>
#include <string>
#include <system_error>

#include "tests/firmware_sim/frames.h"

namespace mantle::firmware_sim {
namespace {

std::string Refusal(std::string_view spec) {
  try {
    OpenBus(spec);
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "not refused";
}

TEST(OpenBus, LoopGivesStationsOfOneMedium) {
  LoopMedium medium;
  auto a = OpenBus("loop", &medium);
  auto b = OpenBus("loop", &medium);
  const CanFrame frame = DataFrame(1, {});
  a->Send({&frame, 1});
  EXPECT_EQ(Drain(*b).size(), 1U);
}

TEST(OpenBus, ABadSpecSaysWhatIsWrong) {
  for (const auto& [spec, why] : {
           std::pair{"loop", "one process"},
           {"", "unknown transport"},
           {"vcan0", "unknown transport"},
           {"can:", "interface name ''"},
           {"can:a_name_that_is_too_long", "1 to 15 characters"},
           {"udp:239.74.163.2", "no port"},
           {"udp:192.168.0.1:43113", "no IPv4 multicast address"},
           {"udp:group:43113", "no IPv4 multicast address"},
           {"udp:239.74.163.2:0", "port '0' is not 1 to 65535"},
           {"udp:239.74.163.2:65536", "not 1 to 65535"},
           {"udp:239.74.163.2:x", "port 'x'"},
           {"udp:239.74.163.2:43113@", "no interface"},
       }) {
    EXPECT_NE(Refusal(spec).find(why), std::string::npos) << spec << ": " << Refusal(spec);
  }
}

TEST(OpenBus, AMissingInterfaceIsASystemError) {
  EXPECT_THROW(OpenBus("can:nosuchif0"), std::system_error);
  EXPECT_THROW(OpenBus("udp:239.74.163.2:43113@nosuchif0"), std::system_error);
}

}  // namespace
}  // namespace mantle::firmware_sim
