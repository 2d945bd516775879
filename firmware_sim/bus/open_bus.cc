#include "firmware_sim/bus/open_bus.h"

#include <arpa/inet.h>
#include <fmt/format.h>

#include <charconv>
#include <stdexcept>
#include <string>

#include "firmware_sim/bus/socket_can_bus.h"
#include "firmware_sim/bus/udp_multicast_bus.h"

namespace mantle::firmware_sim {

namespace {

[[noreturn]] void Refuse(std::string_view spec, std::string_view why) {
  throw std::invalid_argument(fmt::format("bus '{}': {}; a bus is {}", spec, why, kBusSpecHelp));
}

UdpMulticastAddress ParseUdp(std::string_view spec, std::string_view rest) {
  UdpMulticastAddress address;
  if (const auto at = rest.find('@'); at != std::string_view::npos) {
    address.interface = rest.substr(at + 1);
    if (address.interface.empty()) Refuse(spec, "no interface after '@'");
    rest = rest.substr(0, at);
  }
  const auto colon = rest.find(':');
  if (colon == std::string_view::npos) Refuse(spec, "no port after the group");
  address.group = rest.substr(0, colon);
  in_addr parsed{};
  if (inet_pton(AF_INET, address.group.c_str(), &parsed) != 1 ||
      (ntohl(parsed.s_addr) >> 28) != 0xE) {
    Refuse(spec, fmt::format("group '{}' is no IPv4 multicast address (224.0.0.0 to "
                             "239.255.255.255)",
                             address.group));
  }
  const std::string_view port = rest.substr(colon + 1);
  int value = 0;
  const auto [end, error] = std::from_chars(port.data(), port.data() + port.size(), value);
  if (error != std::errc{} || end != port.data() + port.size() || value < 1 || value > 65535) {
    Refuse(spec, fmt::format("port '{}' is not 1 to 65535", port));
  }
  address.port = static_cast<std::uint16_t>(value);
  return address;
}

}  // namespace

std::unique_ptr<Bus> OpenBus(std::string_view spec, LoopMedium* medium,
                             std::span<const CanFilter> filters) {
  if (spec == "loop") {
    if (!medium) Refuse(spec, "loop exists within one process and has no other station here");
    return medium->MakeStation(filters);
  }
  if (spec.starts_with("can:")) {
    const std::string_view name = spec.substr(4);
    if (name.empty() || name.size() > kMaxInterfaceName) {
      Refuse(spec,
             fmt::format("interface name '{}' is not 1 to {} characters", name, kMaxInterfaceName));
    }
    return OpenSocketCanBus(std::string(name), filters);
  }
  if (spec.starts_with("udp:")) {
    return OpenUdpMulticastBus(ParseUdp(spec, spec.substr(4)), filters);
  }
  Refuse(spec, "unknown transport");
}

}  // namespace mantle::firmware_sim
