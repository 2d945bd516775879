#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "firmware_sim/canopen/canopen.h"
#include "firmware_sim/canopen/object_table.h"

namespace mantle::firmware_sim {

/// Result of looking up an index and sub-index: kNone and the slot, kNoObject or kNoSubIndex.
struct FoundObject {
  SdoAbort abort{SdoAbort::kNone};
  std::size_t slot{0};
};

FoundObject FindObject(std::uint16_t index, std::uint8_t sub);

/// First slots of the four PDOs' records: communication (:0) and mapping (:0).
struct PdoSlots {
  std::size_t cob_id;
  std::size_t type;
  std::size_t timer;  ///< event timer; a time-out for RPDOs
  std::size_t count;  ///< number of mapped objects; the entries follow
};
enum class PdoNumber : std::uint8_t { kRpdo1, kRpdo2, kTpdo1, kTpdo2 };
inline constexpr std::size_t kPdoCount = 4;
inline constexpr std::array<PdoSlots, kPdoCount> kPdoSlots = {{
    {Slot(0x1400, 1), Slot(0x1400, 2), Slot(0x1400, 5), Slot(0x1600, 0)},
    {Slot(0x1401, 1), Slot(0x1401, 2), Slot(0x1401, 5), Slot(0x1601, 0)},
    {Slot(0x1800, 1), Slot(0x1800, 2), Slot(0x1800, 5), Slot(0x1A00, 0)},
    {Slot(0x1801, 1), Slot(0x1801, 2), Slot(0x1801, 5), Slot(0x1A01, 0)},
}};

/// The values behind object_table.h. A slot is a row of the table; the compiler finds the slots of
/// objects that the code names (Slot(0x6040)), a client's index and sub-index are found by Find.
class ObjectDictionary {
 public:
  explicit ObjectDictionary(NodeId node);

  NodeId node() const { return node_; }

  std::uint32_t Raw(std::size_t slot) const { return raw_[slot]; }
  std::int64_t Number(std::size_t slot) const {
    return ToNumber(kObjectTable[slot].type, raw_[slot]);
  }
  /// Stores without any check: the device's own writes.
  void Store(std::size_t slot, std::uint32_t raw) { raw_[slot] = raw; }
  /// Stores where the row's range allows; says whether it did. What an RPDO writes.
  bool StoreInRange(std::size_t slot, std::uint32_t raw);

  /// Defaults of all objects, or of 1000..1FFF only (NMT reset communication).
  void Reset();
  void ResetCommunication();

 private:
  NodeId node_;
  std::array<std::uint32_t, kObjectTable.size()> raw_{};
};

/// Checks a client's write of `raw` to `slot` against access, range and the rules that tie objects
/// together (CiA 301 7.5.2.35 to 38 for PDOs); kNone where it may be stored. `enabled`: the drive
/// is in operation enabled, quick stop or fault reaction.
SdoAbort CheckWrite(const ObjectDictionary& objects, std::size_t slot, std::uint32_t raw,
                    bool enabled);

}  // namespace mantle::firmware_sim
