#pragma once

#include <memory>
#include <span>
#include <string_view>

#include "firmware_sim/bus/bus.h"
#include "firmware_sim/bus/can_filter.h"
#include "firmware_sim/bus/loop_bus.h"

/// @file
/// Opens a station on the bus that a user names:
///
/// | spec                     | transport                                                        |
/// |--------------------------|------------------------------------------------------------------|
/// | `loop`                   | in process: a station of the medium that the caller passes       |
/// | `can:NAME`               | SocketCAN interface, e.g. `can:vcan0`                            |
/// | `udp:GROUP:PORT[@IFACE]` | python-can's udp_multicast, e.g. `udp:239.74.163.2:43113`;       |
/// |                          | `@lo` keeps it on this machine                                   |

namespace mantle::firmware_sim {

/// What a `--bus` option can teach its reader: any bus, and those that processes share.
inline constexpr std::string_view kBusSpecHelp =
    "loop (in process), can:NAME (SocketCAN, e.g. can:vcan0) or udp:GROUP:PORT[@IFACE] "
    "(python-can's udp_multicast, e.g. udp:239.74.163.2:43113)";
inline constexpr std::string_view kSharedBusSpecHelp =
    "can:NAME (SocketCAN, e.g. can:vcan0) or udp:GROUP:PORT[@IFACE] (python-can's udp_multicast, "
    "e.g. udp:239.74.163.2:43113)";

/// Throws std::invalid_argument for a bad spec (what, value, bound) and std::system_error where the
/// system refuses (no such interface, no permission). `loop` needs `medium`, which must outlive the
/// station; it is refused without one, since nobody else could be on that bus. Only frames that
/// pass `filters` are received (all where it is empty).
std::unique_ptr<Bus> OpenBus(std::string_view spec, LoopMedium* medium = nullptr,
                             std::span<const CanFilter> filters = {});

}  // namespace mantle::firmware_sim
