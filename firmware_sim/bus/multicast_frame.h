#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "firmware_sim/bus/can_frame.h"

/// @file
/// The wire format of python-can's `udp_multicast` interface: one msgpack map a datagram,
///
/// | key                   | value                                   |
/// |-----------------------|-----------------------------------------|
/// | timestamp             | float64, s                              |
/// | arbitration_id        | unsigned integer, 11 or 29 bits         |
/// | is_extended_id        | bool                                    |
/// | is_remote_frame       | bool                                    |
/// | is_error_frame        | bool                                    |
/// | channel               | nil or str; ignored                     |
/// | dlc                   | unsigned integer, 0..8                  |
/// | data                  | bin of dlc bytes, empty where remote    |
/// | is_fd                 | bool; FD frames are not for us          |
/// | bitrate_switch        | bool; of FD frames                      |
/// | error_state_indicator | bool; of FD frames                      |
///
/// written in this order, read in any; unknown keys are skipped, and a missing one has the default
/// of python-can's Message. msgpack (spec.md of msgpack/msgpack) is read here by hand: the C
/// library sizes an allocation by the length a datagram claims, which a cyclic path cannot afford.

namespace mantle::firmware_sim {

/// No frame needs more bytes than this.
inline constexpr std::size_t kMulticastFrameBytes = 256;

/// Writes `frame`, with time_us as its timestamp, and returns the number of bytes.
std::size_t EncodeMulticastFrame(const CanFrame& frame,
                                 std::span<std::uint8_t, kMulticastFrameBytes> datagram);

enum class MulticastDecode : std::uint8_t { kFrame, kFdFrame, kMalformed };

/// Reads a datagram into `frame`; anything but kFrame leaves it as it was. Takes any bytes.
MulticastDecode DecodeMulticastFrame(std::span<const std::uint8_t> datagram, CanFrame& frame);

}  // namespace mantle::firmware_sim
