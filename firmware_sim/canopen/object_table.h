#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>

#include "firmware_sim/canopen/canopen.h"
#include "firmware_sim/canopen/motor_data.h"
#include "firmware_sim/canopen/object_entry.h"

/// @file
/// The object dictionary of the drive as one constant table, ordered by index and sub-index: type,
/// access, PDO mapping, default and range of every object. Dictionary, SDO server, PDOs and EDS
/// read this table; nothing repeats it.

namespace mantle::firmware_sim {

inline constexpr std::size_t kMaxMapped = 8;
inline constexpr std::size_t kErrorHistoryDepth = 8;

namespace table {

inline constexpr auto kRo = Access::kReadOnly;
inline constexpr auto kRw = Access::kReadWrite;
inline constexpr auto kConst = Access::kConst;

inline constexpr std::int64_t kU8Max = std::numeric_limits<std::uint8_t>::max();
inline constexpr std::int64_t kU16Max = std::numeric_limits<std::uint16_t>::max();
inline constexpr std::int64_t kU32Max = std::numeric_limits<std::uint32_t>::max();
inline constexpr std::int64_t kI32Max = std::numeric_limits<std::int32_t>::max();
inline constexpr std::int64_t kI32Min = std::numeric_limits<std::int32_t>::min();
inline constexpr std::int64_t kI16Max = std::numeric_limits<std::int16_t>::max();
inline constexpr std::int64_t kI16Min = std::numeric_limits<std::int16_t>::min();

/// A row with explicit range.
constexpr ObjectEntry Row(std::uint16_t index, std::uint8_t sub, DataType type, Access access,
                          std::int64_t initial, std::int64_t low, std::int64_t high,
                          const char* name, Mappable mappable = Mappable::kNo) {
  return {index, sub, type, access, mappable, false, initial, low, high, name};
}

/// A row whose range is that of its type.
constexpr ObjectEntry Full(std::uint16_t index, std::uint8_t sub, DataType type, Access access,
                           std::int64_t initial, const char* name,
                           Mappable mappable = Mappable::kNo) {
  const unsigned bits = 8 * ByteSize(type);
  const std::int64_t span = std::int64_t{1} << bits;
  const std::int64_t low = IsSigned(type) ? -span / 2 : 0;
  return {index, sub, type, access, mappable, false, initial, low, low + span - 1, name};
}

constexpr ObjectEntry Count(std::uint16_t index, std::uint8_t highest) {
  return Full(index, 0, DataType::kU8, Access::kConst, highest, "Highest sub-index supported");
}

constexpr ObjectEntry PlusNode(ObjectEntry row) {
  row.plus_node = true;
  return row;
}

constexpr std::uint32_t Map(std::uint16_t index, DataType type) {
  return static_cast<std::uint32_t>(index) << 16U | 8U * ByteSize(type);
}

using enum DataType;
using enum Mappable;
namespace o = object;

inline constexpr auto kHead = std::to_array<ObjectEntry>({
    Full(0x1000, 0, kU32, kConst, kDeviceType, "Device type"),
    Full(0x1001, 0, kU8, kRo, 0, "Error register", kTransmit),
    Row(0x1003, 0, kU8, kRw, 0, 0, 0, "Number of errors"),
    Full(0x1003, 1, kU32, kRo, 0, "Standard error field 1"),
    Full(0x1003, 2, kU32, kRo, 0, "Standard error field 2"),
    Full(0x1003, 3, kU32, kRo, 0, "Standard error field 3"),
    Full(0x1003, 4, kU32, kRo, 0, "Standard error field 4"),
    Full(0x1003, 5, kU32, kRo, 0, "Standard error field 5"),
    Full(0x1003, 6, kU32, kRo, 0, "Standard error field 6"),
    Full(0x1003, 7, kU32, kRo, 0, "Standard error field 7"),
    Full(0x1003, 8, kU32, kRo, 0, "Standard error field 8"),
    Row(0x1005, 0, kU32, kRw, kCobSync, kCobSync, kCobSync, "COB-ID SYNC"),
    Full(0x1008, 0, kString, kConst, 0x5652444D, "Manufacturer device name"),  // "MDRV"
    PlusNode(Full(0x1014, 0, kU32, kRo, 0x80, "COB-ID EMCY")),
    Full(0x1015, 0, kU16, kRw, 100, "Inhibit time EMCY"),  // 10 ms
    Count(0x1016, 1),
    Row(0x1016, 1, kU32, kRw, kMasterNode << 16U | 200U, 0, 0x7FFFFF, "Consumer heartbeat time"),
    Full(0x1017, 0, kU16, kRw, 100, "Producer heartbeat time"),
    Count(0x1018, 4),
    Full(0x1018, 1, kU32, kConst, 0, "Vendor-ID"),
    Full(0x1018, 2, kU32, kConst, 0x402, "Product code"),
    Full(0x1018, 3, kU32, kConst, 0x00010000, "Revision number"),
    PlusNode(Full(0x1018, 4, kU32, kRo, 0, "Serial number")),
    Count(0x1029, 1),
    Row(0x1029, 1, kU8, kRw, 0, 0, 2, "Communication error behaviour"),
    Count(0x1400, 5),
    PlusNode(Full(0x1400, 1, kU32, kRw, 0x200, "COB-ID used by RPDO1")),
    Full(0x1400, 2, kU8, kRw, 1, "Transmission type"),
    Full(0x1400, 5, kU16, kRw, 100, "Event timer"),
    Count(0x1401, 5),
    PlusNode(Full(0x1401, 1, kU32, kRw, 0x300, "COB-ID used by RPDO2")),
    Full(0x1401, 2, kU8, kRw, 1, "Transmission type"),
    Full(0x1401, 5, kU16, kRw, 0, "Event timer"),
});

/// The nine rows of a mapping record with up to three objects mapped.
constexpr std::array<ObjectEntry, 1 + kMaxMapped> Mapping(std::uint16_t index,
                                                          std::array<std::uint32_t, 4> mapped) {
  constexpr std::array<const char*, kMaxMapped> kNames = {
      "Mapped object 1", "Mapped object 2", "Mapped object 3", "Mapped object 4",
      "Mapped object 5", "Mapped object 6", "Mapped object 7", "Mapped object 8"};
  std::array<ObjectEntry, 1 + kMaxMapped> rows{};
  std::int64_t count = 0;
  for (std::size_t i = 0; i < kMaxMapped; ++i) {
    const std::uint32_t value = i < mapped.size() ? mapped[i] : 0;
    if (value != 0) ++count;
    rows[i + 1] =
        Full(index, static_cast<std::uint8_t>(i + 1), DataType::kU32, kRw, value, kNames[i]);
  }
  rows[0] = Row(index, 0, DataType::kU8, kRw, count, 0, kU8Max, "Number of mapped objects");
  return rows;
}

inline constexpr auto kRpdo1Map = Mapping(
    o::kRpdo1Mapping,
    {Map(o::kControlword, kU16), Map(o::kTargetTorque, kI16), Map(o::kTargetPosition, kI32)});
inline constexpr auto kRpdo2Map =
    Mapping(o::kRpdo2Mapping,
            {Map(o::kTargetVelocity, kI32), Map(o::kTorqueOffset, kI16), Map(o::kMode, kI8)});
inline constexpr auto kTpdo1Map = Mapping(
    o::kTpdo1Mapping,
    {Map(o::kStatusword, kU16), Map(o::kTorqueActual, kI16), Map(o::kPositionActual, kI32)});
inline constexpr auto kTpdo2Map =
    Mapping(o::kTpdo2Mapping, {Map(o::kVelocityActual, kI32), Map(o::kCurrentActual, kI16),
                               Map(o::kModeDisplay, kI8), Map(o::kTemperature, kI8)});

inline constexpr auto kTpdos = std::to_array<ObjectEntry>({
    Count(0x1800, 5),
    PlusNode(Full(0x1800, 1, kU32, kRw, kPdoNoRtr | 0x180, "COB-ID used by TPDO1")),
    Full(0x1800, 2, kU8, kRw, 1, "Transmission type"),
    Full(0x1800, 3, kU16, kRw, 0, "Inhibit time"),
    Full(0x1800, 5, kU16, kRw, 0, "Event timer"),
    Count(0x1801, 5),
    PlusNode(Full(0x1801, 1, kU32, kRw, kPdoNoRtr | 0x280, "COB-ID used by TPDO2")),
    Full(0x1801, 2, kU8, kRw, 1, "Transmission type"),
    Full(0x1801, 3, kU16, kRw, 0, "Inhibit time"),
    Full(0x1801, 5, kU16, kRw, 0, "Event timer"),
});

inline constexpr int kFeed_um = static_cast<int>(WinchData{}.feed_um_per_turn);

inline constexpr auto kDevice = std::to_array<ObjectEntry>({
    Full(0x2200, 0, kI8, kRo, 0, "Winding temperature", kTransmit),
    Row(0x2201, 0, kU8, Access::kWriteOnly, 0, 0, 6, "Simulated disturbance"),
    Row(0x6007, 0, kI16, kRw, 1, 1, 1, "Abort connection option code"),
    Full(0x603F, 0, kU16, kRo, 0, "Error code", kTransmit),
    Full(0x6040, 0, kU16, kRw, 0, "Controlword", kReceive),
    Full(0x6041, 0, kU16, kRo, 0, "Statusword", kTransmit),
    Row(0x605A, 0, kI16, kRw, 2, 0, 8, "Quick stop option code"),
    Row(0x605D, 0, kI16, kRw, 1, 1, 4, "Halt option code"),
    Row(0x605E, 0, kI16, kRw, 1, 0, 2, "Fault reaction option code"),
    Row(0x6060, 0, kI8, kRw, 10, 8, 10, "Modes of operation", kReceive),
    Full(0x6061, 0, kI8, kRo, 10, "Modes of operation display", kTransmit),
    Full(0x6064, 0, kI32, kRo, 0, "Position actual value", kTransmit),
    Full(0x6065, 0, kU32, kRw, 2000, "Following error window"),
    Full(0x606C, 0, kI32, kRo, 0, "Velocity actual value", kTransmit),
    Full(0x6071, 0, kI16, kRw, 0, "Target torque", kReceive),
    Row(0x6072, 0, kU16, kRw, 1000, 0, 2000, "Max torque", kReceive),
    Full(0x6075, 0, kU32, kConst, kRatedCurrent_ma, "Motor rated current"),
    Full(0x6076, 0, kU32, kConst, kRatedTorque_mnm, "Motor rated torque"),
    Full(0x6077, 0, kI16, kRo, 0, "Torque actual value", kTransmit),
    Full(0x6078, 0, kI16, kRo, 0, "Current actual value", kTransmit),
    Full(0x607A, 0, kI32, kRw, 0, "Target position", kReceive),
    Count(0x607D, 2),
    Full(0x607D, 1, kI32, kRw, kI32Min, "Min position limit"),
    Full(0x607D, 2, kI32, kRw, kI32Max, "Max position limit"),
    Row(0x6084, 0, kU32, kRw, 200000, 1, kU32Max, "Profile deceleration"),
    Row(0x6085, 0, kU32, kRw, 400000, 1, kU32Max, "Quick stop deceleration"),
    Row(0x6087, 0, kU32, kRw, 10000, 1, kU32Max, "Torque slope"),
    Count(0x608F, 2),
    Full(0x608F, 1, kU32, kConst, WinchData{}.counts_per_turn, "Encoder increments"),
    Full(0x608F, 2, kU32, kConst, 1, "Motor revolutions"),
    Count(0x6091, 2),
    Full(0x6091, 1, kU32, kConst, static_cast<int>(WinchData{}.gear_ratio), "Motor revolutions"),
    Full(0x6091, 2, kU32, kConst, 1, "Shaft revolutions"),
    Count(0x6092, 2),
    Full(0x6092, 1, kU32, kConst, kFeed_um, "Feed"),
    Full(0x6092, 2, kU32, kConst, 1, "Shaft revolutions"),
    Full(0x60B2, 0, kI16, kRw, 0, "Torque offset", kReceive),
    Count(0x60C2, 2),
    Row(0x60C2, 1, kU8, kRw, 10, 1, kU8Max, "Interpolation time period value"),
    Row(0x60C2, 2, kI8, kRw, -3, -4, 0, "Interpolation time index"),
    Full(0x60FF, 0, kI32, kRw, 0, "Target velocity", kReceive),
    Full(0x6502, 0, kU32, kConst, 0x380, "Supported drive modes"),
});

template <std::size_t... N>
constexpr auto Join(const std::array<ObjectEntry, N>&... parts) {
  std::array<ObjectEntry, (N + ...)> all{};
  std::size_t at = 0;
  const auto append = [&](const auto& part) {
    for (const ObjectEntry& row : part) all[at++] = row;
  };
  (append(parts), ...);
  return all;
}

}  // namespace table

inline constexpr auto kObjectTable =
    table::Join(table::kHead, table::kRpdo1Map, table::kRpdo2Map, table::kTpdos, table::kTpdo1Map,
                table::kTpdo2Map, table::kDevice);

/// Row of an object that the code names; does not compile where there is none.
consteval std::size_t Slot(std::uint16_t index, std::uint8_t sub = 0) {
  for (std::size_t i = 0; i < kObjectTable.size(); ++i) {
    if (kObjectTable[i].index == index && kObjectTable[i].sub == sub) return i;
  }
  throw "no such object";
}

}  // namespace mantle::firmware_sim
