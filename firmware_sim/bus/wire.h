#pragma once

#include <cstdint>

/// @file
/// Little-endian numbers of 1 to 4 bytes, the size known at run time (mapped objects, SDO
/// data).

namespace mantle::firmware_sim {

inline std::uint32_t LoadLe(const std::uint8_t* bytes, unsigned count) {
  std::uint32_t value = 0;
  for (unsigned i = 0; i < count; ++i) value |= static_cast<std::uint32_t>(bytes[i]) << (8U * i);
  return value;
}

inline void StoreLe(std::uint8_t* bytes, unsigned count, std::uint32_t value) {
  for (unsigned i = 0; i < count; ++i) bytes[i] = static_cast<std::uint8_t>(value >> (8U * i));
}

}  // namespace mantle::firmware_sim
