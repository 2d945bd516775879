#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>

#include "firmware_sim/bus/bus.h"
#include "firmware_sim/bus/can_filter.h"

/// @file
/// A CAN bus over IPv4 multicast, in the wire format of python-can's `udp_multicast`
/// (multicast_frame.h), for machines without SocketCAN. There is no arbitration and no delivery
/// guarantee: datagrams that the socket had no room for are counted in `receive_dropped`
/// (SO_RXQ_OVFL), what is no frame in `malformed`.
///
/// Frames leave from a socket of their own, so that the source address and port tell our own
/// frames, which the kernel loops back, from those of other programs on this machine. Time to live
/// is 1: nothing passes a router. time_us of a received frame is the kernel's time stamp
/// (CLOCK_REALTIME).

namespace mantle::firmware_sim {

/// Where frames are sent and heard.
struct UdpMulticastAddress {
  std::string group{"239.74.163.2"};
  std::uint16_t port{43113};
  std::string interface;  ///< empty: the one the routing table chooses
};

/// Throws std::system_error where the system refuses (no route, no such interface, port taken by a
/// program that does not share it).
std::unique_ptr<Bus> OpenUdpMulticastBus(const UdpMulticastAddress& address,
                                         std::span<const CanFilter> filters = {});

}  // namespace mantle::firmware_sim
