#include "firmware_sim/canopen/object_dictionary.h"

#include <algorithm>

namespace mantle::firmware_sim {
namespace {

constexpr bool IsOrdered() {
  for (std::size_t i = 1; i < kObjectTable.size(); ++i) {
    const ObjectEntry& a = kObjectTable[i - 1];
    const ObjectEntry& b = kObjectTable[i];
    if (a.index > b.index || (a.index == b.index && a.sub >= b.sub)) return false;
  }
  return true;
}
static_assert(IsOrdered(), "FindObject searches by halves");

std::uint32_t Initial(const ObjectEntry& row, NodeId node) {
  return static_cast<std::uint32_t>(row.initial + (row.plus_node ? node : 0));
}

/// Identifiers that CiA 301 (table 41) keeps for other services.
bool IsReservedCobId(std::uint32_t id) {
  return id <= 0x07F || id == kCobSync || (id >= 0x101 && id <= 0x180) ||
         (id >= 0x581 && id <= 0x5FF) || (id >= 0x601 && id <= 0x67F) ||
         (id >= 0x6E0 && id <= 0x6FF) || id >= 0x701;
}

SdoAbort CheckCobId(std::uint32_t old, std::uint32_t value, bool transmit) {
  if ((value & kCobExtended) != 0 || (!transmit && (value & kPdoNoRtr) != 0)) {
    return SdoAbort::kValueRange;
  }
  const bool exists = (old & kPdoInvalid) == 0;
  const bool will_exist = (value & kPdoInvalid) == 0;
  const bool same_id = (old & kCobIdMask) == (value & kCobIdMask);
  if (will_exist && (value & ~(kPdoNoRtr | kCobIdMask)) != 0) return SdoAbort::kValueRange;
  if (will_exist && IsReservedCobId(value & kCobIdMask)) return SdoAbort::kValueRange;
  if (exists && will_exist && !same_id) return SdoAbort::kWrongDeviceState;
  return SdoAbort::kNone;
}

/// The mapped object of a mapping entry, or why it cannot be mapped.
SdoAbort CheckMappedObject(std::uint32_t entry, Mappable direction) {
  const FoundObject found =
      FindObject(static_cast<std::uint16_t>(entry >> 16U), static_cast<std::uint8_t>(entry >> 8U));
  if (found.abort != SdoAbort::kNone) return found.abort;
  const ObjectEntry& row = kObjectTable[found.slot];
  const bool right_size = (entry & 0xFFU) == 8U * ByteSize(row.type);
  return row.mappable == direction && right_size ? SdoAbort::kNone : SdoAbort::kCannotBeMapped;
}

SdoAbort CheckMapping(const ObjectDictionary& objects, const PdoSlots& pdo, std::size_t slot,
                      std::uint32_t raw, Mappable direction) {
  if ((objects.Raw(pdo.cob_id) & kPdoInvalid) == 0) return SdoAbort::kWrongDeviceState;
  if (slot != pdo.count) {
    if (objects.Raw(pdo.count) != 0) return SdoAbort::kWrongDeviceState;
    return raw == 0 ? SdoAbort::kNone : CheckMappedObject(raw, direction);
  }
  if (raw > kMaxMapped) return SdoAbort::kMappingTooLong;
  unsigned bits = 0;
  for (std::size_t i = 1; i <= raw; ++i) {
    const std::uint32_t entry = objects.Raw(pdo.count + i);
    const SdoAbort abort = CheckMappedObject(entry, direction);
    if (abort != SdoAbort::kNone) return abort;
    bits += entry & 0xFFU;
  }
  return bits <= 64 ? SdoAbort::kNone : SdoAbort::kMappingTooLong;
}

SdoAbort CheckPdo(const ObjectDictionary& objects, std::size_t slot, std::uint32_t raw,
                  bool enabled) {
  for (std::size_t i = 0; i < kPdoCount; ++i) {
    const PdoSlots& pdo = kPdoSlots[i];
    const bool transmit = i >= static_cast<std::size_t>(PdoNumber::kTpdo1);
    const Mappable direction = transmit ? Mappable::kTransmit : Mappable::kReceive;
    if (slot == pdo.cob_id) return CheckCobId(objects.Raw(slot), raw, transmit);
    // 241 to 251 are reserved; 252 and 253 are for remote requests, which no PDO here answers.
    if (slot == pdo.type && raw > 240 && raw < 254) return SdoAbort::kValueRange;
    if (slot >= pdo.count && slot <= pdo.count + kMaxMapped) {
      return CheckMapping(objects, pdo, slot, raw, direction);
    }
  }
  // The time-out of RPDO1 guards the cable against a controlword that no longer comes.
  if (slot == Slot(0x1400, 5) && raw == 0 && enabled) return SdoAbort::kWrongDeviceState;
  return SdoAbort::kNone;
}

}  // namespace

FoundObject FindObject(std::uint16_t index, std::uint8_t sub) {
  const auto first = std::lower_bound(
      kObjectTable.begin(), kObjectTable.end(), index,
      [](const ObjectEntry& row, std::uint16_t sought) { return row.index < sought; });
  if (first == kObjectTable.end() || first->index != index) return {SdoAbort::kNoObject, 0};
  for (auto row = first; row != kObjectTable.end() && row->index == index; ++row) {
    if (row->sub == sub) {
      return {SdoAbort::kNone, static_cast<std::size_t>(row - kObjectTable.begin())};
    }
  }
  return {SdoAbort::kNoSubIndex, 0};
}

ObjectDictionary::ObjectDictionary(NodeId node) : node_(node) { Reset(); }

bool ObjectDictionary::StoreInRange(std::size_t slot, std::uint32_t raw) {
  const ObjectEntry& row = kObjectTable[slot];
  const std::int64_t number = ToNumber(row.type, raw);
  if (number < row.low || number > row.high) return false;
  raw_[slot] = raw;
  return true;
}

void ObjectDictionary::Reset() {
  for (std::size_t i = 0; i < kObjectTable.size(); ++i) raw_[i] = Initial(kObjectTable[i], node_);
}

void ObjectDictionary::ResetCommunication() {
  for (std::size_t i = 0; i < kObjectTable.size() && kObjectTable[i].index < 0x2000; ++i) {
    raw_[i] = Initial(kObjectTable[i], node_);
  }
}

SdoAbort CheckWrite(const ObjectDictionary& objects, std::size_t slot, std::uint32_t raw,
                    bool enabled) {
  const ObjectEntry& row = kObjectTable[slot];
  if (row.access == Access::kConst || row.access == Access::kReadOnly) return SdoAbort::kReadOnly;
  const std::int64_t number = ToNumber(row.type, raw);
  if (number < row.low || number > row.high) return SdoAbort::kValueRange;
  // Option code 4 (voltage limit) is none of the profile's: 0 to 3 and 5 to 8.
  if (slot == Slot(object::kQuickStopOption) && number == 4) return SdoAbort::kValueRange;
  return CheckPdo(objects, slot, raw, enabled);
}

}  // namespace mantle::firmware_sim
