#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <string>

#include "firmware_sim/bus/bus.h"
#include "firmware_sim/bus/can_filter.h"

/// @file
/// SocketCAN (Linux, Documentation/networking/can.rst): a raw socket on one interface.
///
/// - Frames are filtered in the kernel (CAN_RAW_FILTER), moved in batches (recvmmsg, sendmmsg), and
///   stamped by the kernel (SO_TIMESTAMPNS: time_us is CLOCK_REALTIME, as in a candump log).
/// - Error frames of every class are received (CAN_RAW_ERR_FILTER).
/// - What a slow reader lost is counted from SO_RXQ_OVFL: a vcan drops silently.
/// - Link down: the pending ENETDOWN is taken off the socket, status kDown; the same socket works
///   again once the interface flags say up (counted in `recoveries`).
/// - Interface deleted: status kGone; when an interface of that name is up again, a new socket is
///   bound to it (counted in `recoveries`).

namespace mantle::firmware_sim {

inline constexpr std::size_t kMaxInterfaceName = 15;  // IFNAMSIZ - 1

/// Throws std::system_error where there is no such interface or the system refuses the socket. An
/// interface that is down is accepted: status kDown until it comes up.
std::unique_ptr<Bus> OpenSocketCanBus(const std::string& interface,
                                      std::span<const CanFilter> filters = {});

}  // namespace mantle::firmware_sim
