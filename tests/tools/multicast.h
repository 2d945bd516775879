#pragma once

#include <arpa/inet.h>
#include <fmt/format.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cstdint>
#include <string>

/// The network of tests that speak LCM: ttl=0, so that nothing leaves this machine.

namespace mantle::testing_tools {

inline constexpr const char* kGroup = "239.255.76.67";

// A port of this process and its children, so that runs side by side do not hear each other.
inline const int kPort = 20'000 + getpid() % 20'000;

inline std::string Url() { return fmt::format("udpm://{}:{}?ttl=0", kGroup, kPort); }

inline constexpr const char* kNoMulticast =
    "this machine does not hear its own multicast (a route? ip route add 224.0.0.0/4 dev lo)";

// Whether this machine takes its own multicast back, asked of the kernel alone.
inline bool MulticastWorks() {
  const int fd = socket(AF_INET, SOCK_DGRAM, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<std::uint16_t>(kPort));
  inet_pton(AF_INET, kGroup, &address.sin_addr);
  ip_mreq membership{address.sin_addr, {htonl(INADDR_ANY)}};
  const unsigned char ttl = 0;
  const char text[] = "mantle";
  const auto* to = reinterpret_cast<const sockaddr*>(&address);
  pollfd waits{fd, POLLIN, 0};
  constexpr int kWait_ms = 2'000;
  const bool works =
      bind(fd, to, sizeof address) == 0 &&
      setsockopt(fd, IPPROTO_IP, IP_ADD_MEMBERSHIP, &membership, sizeof membership) == 0 &&
      setsockopt(fd, IPPROTO_IP, IP_MULTICAST_TTL, &ttl, sizeof ttl) == 0 &&
      sendto(fd, text, sizeof text, 0, to, sizeof address) == sizeof text &&
      poll(&waits, 1, kWait_ms) == 1;
  close(fd);
  return works;
}

}  // namespace mantle::testing_tools
