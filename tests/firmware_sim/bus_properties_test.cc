#include "tests/firmware_sim/bus_properties.h"

#include <unistd.h>

#include <string>

#include "firmware_sim/bus/fault_injecting_bus.h"
#include "firmware_sim/bus/loop_bus.h"
#include "firmware_sim/bus/recording_bus.h"
#include "firmware_sim/bus/udp_multicast_bus.h"

// Every transport that needs no interface of the kernel's (socket_can_bus_test.cc has that one),
// and every decorator that is to change nothing.

namespace mantle::firmware_sim::test {
namespace {

class LoopWire : public Wire {
 public:
  Bus& a() override { return *a_; }
  Bus& b() override { return *b_; }

 protected:
  LoopMedium medium_;
  std::unique_ptr<Bus> a_{medium_.MakeStation()}, b_{medium_.MakeStation()};
};

class MulticastWire : public Wire {
 public:
  Bus& a() override { return *a_; }
  Bus& b() override { return *b_; }

 private:
  // A port of this process, so that runs side by side do not hear each other.
  UdpMulticastAddress address_{.group = "239.74.163.2",
                               .port = static_cast<std::uint16_t>(20000 + getpid() % 20000),
                               .interface = "lo"};
  std::unique_ptr<Bus> a_{OpenUdpMulticastBus(address_)}, b_{OpenUdpMulticastBus(address_)};
};

class RecordedWire : public LoopWire {
 public:
  Bus& a() override { return recorder_; }

 private:
  CandumpWriter log_{::testing::TempDir() + "mantle_bus_properties.log", "vcan0"};
  RecordingBus recorder_{*a_, log_};
};

class SoundCable : public LoopWire {
 public:
  Bus& a() override { return cable_; }

 private:
  FaultInjectingBus cable_{*a_, {}};
};

template <typename Made>
std::unique_ptr<Wire> Make() {
  return std::make_unique<Made>();
}

INSTANTIATE_TEST_SUITE_P(EveryBus, BusProperties,
                         ::testing::Values(BusCase{"Loop", Make<LoopWire>},
                                           BusCase{"Multicast", Make<MulticastWire>},
                                           BusCase{"Recording", Make<RecordedWire>},
                                           BusCase{"SoundCable", Make<SoundCable>}),
                         [](const auto& info) { return std::string(info.param.name); });

}  // namespace
}  // namespace mantle::firmware_sim::test
