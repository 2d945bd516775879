#include "firmware_sim/canopen/pdo.h"

#include <algorithm>

#include "firmware_sim/bus/wire.h"

namespace mantle::firmware_sim {
namespace {

constexpr std::size_t kRpdoCount = 2;
constexpr std::uint8_t kLastSynchronousType = 240;
constexpr std::int64_t kInhibitUnit_us = 100;

constexpr std::size_t InhibitSlot(std::size_t tpdo) {
  return tpdo == 0 ? Slot(0x1800, 3) : Slot(0x1801, 3);
}

}  // namespace

void PdoSet::Configure(const ObjectDictionary& objects) {
  for (std::size_t i = 0; i < kPdoCount; ++i) {
    Pdo& pdo = pdos_[i];
    const PdoSlots& slots = kPdoSlots[i];
    const std::uint32_t cob_id = objects.Raw(slots.cob_id);
    if (cob_id != pdo.cob_id) pdo.pending = pdo.ever_sent = false;
    pdo.cob_id = cob_id;
    pdo.type = static_cast<std::uint8_t>(objects.Raw(slots.type));
    pdo.count = static_cast<std::uint8_t>(objects.Raw(slots.count));
    pdo.sync_count = 0;
    unsigned bytes = 0;
    for (std::size_t k = 0; k < pdo.count; ++k) {
      const std::uint32_t entry = objects.Raw(slots.count + 1 + k);
      const FoundObject found = FindObject(static_cast<std::uint16_t>(entry >> 16U),
                                           static_cast<std::uint8_t>(entry >> 8U));
      pdo.slots[k] = static_cast<std::uint8_t>(found.slot);
      bytes += ByteSize(kObjectTable[found.slot].type);
    }
    pdo.bytes = static_cast<std::uint8_t>(bytes);
  }
}

RpdoResult PdoSet::Receive(const CanFrame& frame, std::int64_t time_us, ObjectDictionary& objects,
                           bool& wrote_controlword) {
  RpdoResult result = RpdoResult::kNotMine;
  for (std::size_t i = 0; i < kRpdoCount; ++i) {
    Pdo& pdo = pdos_[i];
    if (pdo.cob_id != frame.id) continue;
    pdo.too_short = frame.size < pdo.bytes;
    if (pdo.too_short) return RpdoResult::kTooShort;
    std::copy_n(frame.data.begin(), 8, pdo.data.begin());
    pdo.last_us = time_us;
    pdo.pending = true;
    result = RpdoResult::kBuffered;
    if (pdo.type > kLastSynchronousType) {
      wrote_controlword = Apply(pdo, objects) || wrote_controlword;
      result = RpdoResult::kApplied;
    }
  }
  return result;
}

bool PdoSet::Apply(Pdo& pdo, ObjectDictionary& objects) {
  bool controlword = false;
  const std::uint8_t* bytes = pdo.data.data();
  for (std::size_t k = 0; k < pdo.count; ++k) {
    const unsigned size = ByteSize(kObjectTable[pdo.slots[k]].type);
    objects.StoreInRange(pdo.slots[k], LoadLe(bytes, size));
    controlword = controlword || pdo.slots[k] == Slot(object::kControlword);
    bytes += size;
  }
  pdo.pending = false;
  return controlword;
}

bool PdoSet::ApplyBuffered(ObjectDictionary& objects) {
  bool controlword = false;
  for (std::size_t i = 0; i < kRpdoCount; ++i) {
    if (pdos_[i].pending) controlword = Apply(pdos_[i], objects) || controlword;
  }
  return controlword;
}

void PdoSet::DropBuffered() {
  for (std::size_t i = 0; i < kRpdoCount; ++i) pdos_[i].pending = false;
}

void PdoSet::Touch(std::int64_t time_us) {
  for (std::size_t i = 0; i < kRpdoCount; ++i) pdos_[i].last_us = time_us;
}

bool PdoSet::NeedsSync() const {
  return std::any_of(pdos_.begin(), pdos_.begin() + kRpdoCount, [](const Pdo& pdo) {
    return (pdo.cob_id & kPdoInvalid) == 0 && pdo.type <= kLastSynchronousType;
  });
}

void PdoSet::Fill(const Pdo& pdo, const ObjectDictionary& objects, CanFrame& frame) {
  frame = CanFrame{};
  frame.id = pdo.cob_id & kCobIdMask;
  frame.size = pdo.bytes;
  std::uint8_t* bytes = frame.data.data();
  for (std::size_t k = 0; k < pdo.count; ++k) {
    const unsigned size = ByteSize(kObjectTable[pdo.slots[k]].type);
    StoreLe(bytes, size, objects.Raw(pdo.slots[k]));
    bytes += size;
  }
}

bool PdoSet::SampleOnSync(std::size_t tpdo, std::int64_t time_us, const ObjectDictionary& objects,
                          CanFrame& frame) {
  Pdo& pdo = pdos_[kRpdoCount + tpdo];
  if ((pdo.cob_id & kPdoInvalid) != 0 || pdo.type > kLastSynchronousType || pdo.count == 0) {
    return false;
  }
  if (pdo.type != 0 && ++pdo.sync_count < pdo.type) return false;
  pdo.sync_count = 0;
  Fill(pdo, objects, frame);
  if (pdo.type == 0 && pdo.ever_sent && frame.data == pdo.data) return false;
  pdo.data = frame.data;
  pdo.ever_sent = true;
  pdo.last_us = time_us;
  return true;
}

bool PdoSet::SampleOnEvent(std::size_t tpdo, std::int64_t time_us, const ObjectDictionary& objects,
                           CanFrame& frame) {
  Pdo& pdo = pdos_[kRpdoCount + tpdo];
  if ((pdo.cob_id & kPdoInvalid) != 0 || pdo.type <= kLastSynchronousType || pdo.count == 0) {
    return false;
  }
  const std::int64_t since_us = time_us - pdo.last_us;
  const std::int64_t timer_us =
      1000 * static_cast<std::int64_t>(objects.Raw(kPdoSlots[kRpdoCount + tpdo].timer));
  const std::int64_t inhibit_us =
      kInhibitUnit_us * static_cast<std::int64_t>(objects.Raw(InhibitSlot(tpdo)));
  const auto word = static_cast<std::uint16_t>(objects.Raw(Slot(object::kStatusword)));
  const bool elapsed = timer_us > 0 && since_us >= timer_us;
  const bool changed = !pdo.ever_sent || word != pdo.last_statusword;
  if (!(elapsed || changed) || (pdo.ever_sent && since_us < inhibit_us)) return false;
  Fill(pdo, objects, frame);
  pdo.last_statusword = word;
  pdo.ever_sent = true;
  pdo.last_us = time_us;
  return true;
}

}  // namespace mantle::firmware_sim
