#pragma once

#include <cstdint>

namespace mantle::firmware_sim {

/// CiA 301 table 44; the values stand in the EDS.
enum class DataType : std::uint8_t {
  kI8 = 0x02,
  kI16 = 0x03,
  kI32 = 0x04,
  kU8 = 0x05,
  kU16 = 0x06,
  kU32 = 0x07,
  kString = 0x09,  ///< visible string of exactly four characters
};

constexpr unsigned ByteSize(DataType type) {
  switch (type) {
    case DataType::kI8:
    case DataType::kU8:
      return 1;
    case DataType::kI16:
    case DataType::kU16:
      return 2;
    default:
      return 4;
  }
}

constexpr bool IsSigned(DataType type) {
  return type == DataType::kI8 || type == DataType::kI16 || type == DataType::kI32;
}

/// The number that the little-endian bytes in `raw` stand for.
constexpr std::int64_t ToNumber(DataType type, std::uint32_t raw) {
  switch (type) {
    case DataType::kI8:
      return static_cast<std::int8_t>(raw);
    case DataType::kI16:
      return static_cast<std::int16_t>(raw);
    case DataType::kI32:
      return static_cast<std::int32_t>(raw);
    case DataType::kU8:
      return static_cast<std::uint8_t>(raw);
    case DataType::kU16:
      return static_cast<std::uint16_t>(raw);
    default:
      return raw;
  }
}

enum class Access : std::uint8_t { kConst, kReadOnly, kWriteOnly, kReadWrite };

/// Which PDOs may carry the object.
enum class Mappable : std::uint8_t { kNo, kReceive, kTransmit };

/// One row of the object dictionary: what CiA 301 (7.4) says about an object, as a constant.
struct ObjectEntry {
  std::uint16_t index;
  std::uint8_t sub;
  DataType type;
  Access access;
  Mappable mappable;
  bool plus_node;  ///< the default is `initial` + node id
  std::int64_t initial;
  std::int64_t low;
  std::int64_t high;
  const char* name;
};

}  // namespace mantle::firmware_sim
