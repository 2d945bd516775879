#include "firmware_sim/bus/udp_multicast_bus.h"

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <string>

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
  const int fd = socket(AF_INET, SOCK_DGRAM, 0);
  sockaddr_in to{};
  to.sin_family = AF_INET;
  to.sin_port = htons(Address().port);
  inet_pton(AF_INET, Address().group.c_str(), &to.sin_addr);
  in_addr loopback{htonl(INADDR_LOOPBACK)};
  ASSERT_EQ(setsockopt(fd, IPPROTO_IP, IP_MULTICAST_IF, &loopback, sizeof(loopback)), 0);
  for (const std::string& text :
       {std::string(), std::string("hello"), std::string(4000, '\xFF'), std::string("\x81\xA3")}) {
    ASSERT_EQ(sendto(fd, text.data(), text.size(), 0, reinterpret_cast<sockaddr*>(&to), sizeof(to)),
              static_cast<ssize_t>(text.size()));
  }
  close(fd);
  const CanFrame frame = DataFrame(0x7, {});
  good->Send({&frame, 1});
  EXPECT_EQ(Ids(DrainUntil(*bus, 1)), (std::vector<std::uint32_t>{0x7}));
  EXPECT_EQ(bus->counters().malformed, 4U);
}

}  // namespace
}  // namespace mantle::firmware_sim
