#include "firmware_sim/bus/udp_multicast_bus.h"

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <ifaddrs.h>
#include <net/if.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <filesystem>
#include <string>
#include <system_error>

#include "firmware_sim/bus/socket_time.h"
#include "tests/firmware_sim/frames.h"

// On the loopback interface of this machine: nothing leaves it.

namespace mantle::firmware_sim {
namespace {

// A port of this process, so that runs side by side do not hear each other.
UdpMulticastAddress Address() {
  return {.group = "239.74.163.2",
          .port = static_cast<std::uint16_t>(20000 + getpid() % 20000),
          .interface = "lo"};
}

/// Sends datagrams to the group that are no frames.
class Flooder {
 public:
  explicit Flooder(const char* interface) : fd_(socket(AF_INET, SOCK_DGRAM, 0)) {
    to_.sin_family = AF_INET;
    to_.sin_port = htons(Address().port);
    inet_pton(AF_INET, Address().group.c_str(), &to_.sin_addr);
    ip_mreqn from{};
    from.imr_ifindex = static_cast<int>(if_nametoindex(interface));
    EXPECT_EQ(setsockopt(fd_, IPPROTO_IP, IP_MULTICAST_IF, &from, sizeof(from)), 0);
  }
  ~Flooder() { close(fd_); }
  void Send(const std::string& text) const {
    EXPECT_EQ(sendto(fd_, text.data(), text.size(), 0, reinterpret_cast<const sockaddr*>(&to_),
                     sizeof(to_)),
              static_cast<ssize_t>(text.size()));
  }

 private:
  int fd_;
  sockaddr_in to_{};
};

/// One that is up and carries multicast, but for loopback; empty where there is none.
std::string AnotherInterface() {
  std::string found;
  ifaddrs* first = nullptr;
  if (getifaddrs(&first) != 0) return found;
  constexpr unsigned kWanted = IFF_UP | IFF_RUNNING | IFF_MULTICAST;
  for (const ifaddrs* at = first; at != nullptr; at = at->ifa_next) {
    const bool usable = (at->ifa_flags & kWanted) == kWanted && (at->ifa_flags & IFF_LOOPBACK) == 0;
    if (usable && at->ifa_addr != nullptr && at->ifa_addr->sa_family == AF_INET)
      found = at->ifa_name;
  }
  freeifaddrs(first);
  return found;
}

// How far the kernel's stamp may be from ours: it is taken between the two calls.
constexpr std::int64_t kStampTolerance_us = 1'000'000;

TEST(UdpMulticastBus, StationsHearEachOtherAndNotThemselves) {
  auto a = OpenUdpMulticastBus(Address());
  auto b = OpenUdpMulticastBus(Address());
  const CanFrame frames[] = {DataFrame(0x181, {1, 2}), ExtendedFrame(0x1ABCDEF, {3}),
                             RemoteFrame(0x701, 0)};
  EXPECT_EQ(a->Send(frames), BusStatus::kOk);
  const auto got = DrainUntil(*b, 3);
  ASSERT_EQ(got.size(), 3U);
  for (int i = 0; i < 3; ++i) ExpectSameFrame(got[i], frames[i]);
  EXPECT_NEAR(static_cast<double>(got[0].time_us), static_cast<double>(RealTime_us()),
              static_cast<double>(kStampTolerance_us));
  const CanFrame reply = DataFrame(0x201, {});
  b->Send({&reply, 1});
  EXPECT_EQ(Ids(DrainUntil(*a, 1)), (std::vector<std::uint32_t>{0x201}));
  EXPECT_EQ(a->counters().sent, 3U);
  EXPECT_EQ(a->counters().received, 1U);
}

TEST(UdpMulticastBus, ABurstArrivesWholeAndInOrder) {
  auto a = OpenUdpMulticastBus(Address());
  auto b = OpenUdpMulticastBus(Address());
  std::vector<CanFrame> burst;
  for (int i = 0; i < 500; ++i) burst.push_back(DataFrame(0x100, {i & 0xFF, i >> 8}));
  EXPECT_EQ(a->Send(burst), BusStatus::kOk);
  const auto got = DrainUntil(*b, burst.size());
  ASSERT_EQ(got.size() + b->counters().receive_dropped, burst.size());
  for (std::size_t i = 0; i < got.size(); ++i) EXPECT_EQ(got[i].data, burst[i].data);
}

TEST(UdpMulticastBus, FiltersBeforeItHandsOut) {
  auto a = OpenUdpMulticastBus(Address());
  const CanFilter only_sync[] = {{0x080, 0x7FF}};
  auto b = OpenUdpMulticastBus(Address(), only_sync);
  const CanFrame frames[] = {DataFrame(0x181, {}), DataFrame(0x080, {})};
  a->Send(frames);
  EXPECT_EQ(Ids(DrainUntil(*b, 1)), (std::vector<std::uint32_t>{0x080}));
}

TEST(UdpMulticastBus, ForeignDatagramsAreCountedAndSurvived) {
  auto bus = OpenUdpMulticastBus(Address());
  auto good = OpenUdpMulticastBus(Address());
  const Flooder flooder("lo");
  for (const std::string& text :
       {std::string(), std::string("hello"), std::string(4000, '\xFF'), std::string("\x81\xA3")}) {
    flooder.Send(text);
  }
  const CanFrame frame = DataFrame(0x7, {});
  good->Send({&frame, 1});
  EXPECT_EQ(Ids(DrainUntil(*bus, 1)), (std::vector<std::uint32_t>{0x7}));
  EXPECT_EQ(bus->counters().malformed, 4U);
}

TEST(UdpMulticastBus, AFloodOfRubbishDoesNotHoldUpTheCaller) {
  auto bus = OpenUdpMulticastBus(Address());
  auto good = OpenUdpMulticastBus(Address());
  const Flooder flooder("lo");
  constexpr std::size_t kFlood = 400;
  for (std::size_t i = 0; i < kFlood; ++i) flooder.Send("rubbish");
  const CanFrame frame = DataFrame(0x7, {});
  good->Send({&frame, 1});
  std::array<CanFrame, 50> batch;
  std::size_t calls = 0, got = 0;
  for (; got == 0 && calls < 100; ++calls) {
    got = bus->Receive(batch);
    EXPECT_LE(bus->counters().malformed, (calls + 1) * batch.size())
        << "looks at no more than asked";
  }
  EXPECT_EQ(got, 1U);
  EXPECT_EQ(calls, kFlood / batch.size() + 1);
  EXPECT_EQ(bus->counters().malformed, kFlood);
}

int OpenFiles() {
  int count = 0;
  for ([[maybe_unused]] const auto& entry : std::filesystem::directory_iterator("/proc/self/fd"))
    ++count;
  return count;
}

TEST(UdpMulticastBus, ARefusalLeavesNoSocketOpen) {
  UdpMulticastAddress unicast = Address();
  unicast.group = "10.0.0.1";  // refused when the group is joined: both sockets are open by then
  UdpMulticastAddress nowhere = Address();
  nowhere.interface = "no-such-interface";
  const int before = OpenFiles();
  for (const UdpMulticastAddress& address : {unicast, nowhere}) {
    EXPECT_THROW(OpenUdpMulticastBus(address), std::system_error);
  }
  EXPECT_EQ(OpenFiles(), before);
}

// Another program on this machine has joined the same group where the network is.
TEST(UdpMulticastBus, OnLoopbackItIsClosedToOtherInterfaces) {
  const std::string other = AnotherInterface();
  if (other.empty()) GTEST_SKIP() << "no second interface with multicast here";
  auto bus = OpenUdpMulticastBus(Address());
  UdpMulticastAddress outside = Address();
  outside.interface = other;
  auto neighbour = OpenUdpMulticastBus(outside);
  auto stranger = OpenUdpMulticastBus(outside);
  const CanFrame frame = DataFrame(0x7, {});
  ASSERT_EQ(stranger->Send({&frame, 1}), BusStatus::kOk);
  EXPECT_EQ(DrainUntil(*neighbour, 1).size(), 1U);
  EXPECT_TRUE(Drain(*bus).empty());
}

}  // namespace
}  // namespace mantle::firmware_sim
