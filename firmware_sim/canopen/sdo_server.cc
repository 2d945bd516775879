#include "firmware_sim/canopen/sdo_server.h"

#include "firmware_sim/bus/wire.h"

namespace mantle::firmware_sim {
namespace {

constexpr std::uint8_t kClassMask = 0xE0;
constexpr std::uint8_t kDownloadClass = 0x20;
constexpr std::uint8_t kReservedBit = 0x10;
constexpr std::uint8_t kExpeditedBit = 0x02;
constexpr std::uint8_t kSizeBit = 0x01;

CanFrame Reply(NodeId node, std::uint8_t command, const CanFrame& request, std::uint32_t data) {
  CanFrame frame;
  frame.id = CobSdoReply(node);
  frame.size = 8;
  frame.data = request.data;
  frame.data[0] = command;
  StoreLe(&frame.data[4], 4, data);
  return frame;
}

SdoOutcome Abort(NodeId node, const CanFrame& request, SdoAbort code) {
  return {true, false, 0, Reply(node, kSdoAbortCommand, request, static_cast<std::uint32_t>(code))};
}

SdoOutcome Upload(const CanFrame& request, std::size_t slot, const ObjectDictionary& objects) {
  const ObjectEntry& row = kObjectTable[slot];
  if (row.access == Access::kWriteOnly) {
    return Abort(objects.node(), request, SdoAbort::kWriteOnly);
  }
  const unsigned n = ByteSize(row.type);
  const std::uint32_t mask = n == 4 ? 0xFFFFFFFFU : (1U << 8U * n) - 1U;
  return {true, false, slot,
          Reply(objects.node(), SdoUploadReply(n), request, objects.Raw(slot) & mask)};
}

SdoOutcome Download(const CanFrame& request, std::size_t slot, ObjectDictionary& objects,
                    bool enabled) {
  const NodeId node = objects.node();
  const std::uint8_t command = request.data[0];
  const unsigned n = ByteSize(kObjectTable[slot].type);
  const Access access = kObjectTable[slot].access;
  if (access == Access::kConst || access == Access::kReadOnly) {
    return Abort(node, request, SdoAbort::kReadOnly);
  }
  if ((command & kSizeBit) != 0) {
    const unsigned told = 4U - (command >> 2U & 3U);
    if (told > n) return Abort(node, request, SdoAbort::kTooLong);
    if (told < n) return Abort(node, request, SdoAbort::kTooShort);
  }
  const std::uint32_t raw = LoadLe(&request.data[4], n);
  const SdoAbort abort = CheckWrite(objects, slot, raw, enabled);
  if (abort != SdoAbort::kNone) return Abort(node, request, abort);
  objects.Store(slot, raw);
  return {true, true, slot, Reply(node, kSdoDownloadReply, request, 0)};
}

}  // namespace

SdoOutcome ServeSdo(const CanFrame& request, ObjectDictionary& objects, bool enabled) {
  if (request.size != 8 || request.data[0] == kSdoAbortCommand) return {};
  const std::uint8_t command = request.data[0];
  const bool upload = command == kSdoUploadRequest;
  const bool download = (command & kClassMask) == kDownloadClass && (command & kReservedBit) == 0 &&
                        (command & kExpeditedBit) != 0;
  if (!upload && !download) return Abort(objects.node(), request, SdoAbort::kCommandUnknown);
  const auto index = static_cast<std::uint16_t>(LoadLe(&request.data[1], 2));
  const FoundObject found = FindObject(index, request.data[3]);
  if (found.abort != SdoAbort::kNone) return Abort(objects.node(), request, found.abort);
  return upload ? Upload(request, found.slot, objects)
                : Download(request, found.slot, objects, enabled);
}

}  // namespace mantle::firmware_sim
