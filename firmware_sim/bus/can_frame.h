#pragma once

#include <array>
#include <cstdint>

namespace mantle::firmware_sim {

/// A classic CAN 2.0 frame as every part of firmware_sim passes it on.
struct CanFrame {
  std::uint32_t id{0};   ///< 11 bits, or 29 where `extended`
  std::uint8_t size{0};  ///< data length code, 0..8
  bool extended{false};
  bool remote{false};
  bool error{false};  ///< a controller's error frame; `id` then holds the error class
  std::array<std::uint8_t, 8> data{};
  std::int64_t time_us{0};  ///< when it was on the bus: set by the transport on receipt
};

}  // namespace mantle::firmware_sim
