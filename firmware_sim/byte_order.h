#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <type_traits>

/// Little-endian integers in the data of a frame.

namespace mantle::firmware_sim {

/// Reads a T at `offset`; precondition: it fits.
template <typename T>
constexpr T ReadLittleEndian(std::span<const std::uint8_t> data, std::size_t offset) {
  using Bits = std::make_unsigned_t<T>;
  std::uint64_t value = 0;
  for (std::size_t i = 0; i < sizeof(T); ++i) {
    value |= static_cast<std::uint64_t>(data[offset + i]) << (8 * i);
  }
  return static_cast<T>(static_cast<Bits>(value));
}

/// Writes a T at `offset`; precondition: it fits.
template <typename T>
constexpr void WriteLittleEndian(std::span<std::uint8_t> data, std::size_t offset, T value) {
  const auto bits = static_cast<std::uint64_t>(value);
  for (std::size_t i = 0; i < sizeof(T); ++i) {
    data[offset + i] = static_cast<std::uint8_t>(bits >> (8 * i));
  }
}

}  // namespace mantle::firmware_sim
