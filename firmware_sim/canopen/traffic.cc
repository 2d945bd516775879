#include "firmware_sim/canopen/traffic.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "firmware_sim/bus/wire.h"
#include "firmware_sim/canopen/canopen.h"
#include "firmware_sim/canopen/cia402.h"
#include "firmware_sim/canopen/object_dictionary.h"

namespace mantle::firmware_sim {

namespace {

constexpr std::uint32_t kFunctionMask = 0x780;

std::uint16_t U16(const CanFrame& frame, std::size_t at) {
  return static_cast<std::uint16_t>(LoadLe(&frame.data[at], 2));
}
std::int16_t I16(const CanFrame& frame, std::size_t at) {
  return static_cast<std::int16_t>(U16(frame, at));
}
std::int32_t I32(const CanFrame& frame, std::size_t at) {
  return static_cast<std::int32_t>(LoadLe(&frame.data[at], 4));
}

std::string_view CommandName(std::uint8_t command) {
  switch (static_cast<NmtCommand>(command)) {
    case NmtCommand::kStart:
      return "start";
    case NmtCommand::kStop:
      return "stop";
    case NmtCommand::kPreOperational:
      return "enter pre-operational";
    case NmtCommand::kResetNode:
      return "reset node";
    case NmtCommand::kResetCommunication:
      return "reset communication";
  }
  return "unknown command";
}

std::string_view ModeName(int mode) {
  switch (static_cast<OperationMode>(mode)) {
    case OperationMode::kNone:
      return "no mode";
    case OperationMode::kCyclicPosition:
      return "cyclic position";
    case OperationMode::kCyclicVelocity:
      return "cyclic velocity";
    case OperationMode::kCyclicTorque:
      return "cyclic torque";
  }
  return "unknown mode";
}

// What the word asks of a drive without a fault, as DecodeCommand reads it.
std::string ControlwordText(std::uint16_t word) {
  std::string text = (word & controlword::kFaultReset) != 0 ? "fault reset"
                     : (word & 0x02U) == 0                  ? "disable voltage"
                     : (word & 0x04U) == 0                  ? "quick stop"
                     : (word & 0x01U) == 0                  ? "shutdown"
                     : (word & 0x08U) == 0                  ? "switch on"
                                                            : "enable operation";
  if ((word & controlword::kHalt) != 0) text += " + halt";
  return text;
}

void DecodeTooShort(const CanFrame& frame, int least, DecodedFrame& out) {
  out.fields.push_back({"too_short", std::int64_t{frame.size}});
  out.text = fmt::format("too short: {} of {} bytes", frame.size, least);
}

void DecodeNmt(const CanFrame& frame, DecodedFrame& out) {
  out.node = frame.data[1];
  const std::string_view command = CommandName(frame.data[0]);
  out.fields.push_back({"command", std::string(command)});
  out.text = frame.data[1] == 0 ? fmt::format("{} (all nodes)", command) : std::string(command);
}

void DecodeEmcy(const CanFrame& frame, DecodedFrame& out) {
  const std::uint16_t code = U16(frame, 0);
  const char* meaning = Name(static_cast<EmcyCode>(code));
  out.fields = {{"code", std::int64_t{code}},
                {"meaning", std::string(meaning)},
                {"error_register", std::int64_t{frame.data[2]}}};
  out.text = fmt::format("0x{:04X} {}, error register 0x{:02X}", code, meaning, frame.data[2]);
}

void DecodeTpdo1(const CanFrame& frame, DecodedFrame& out) {
  const std::uint16_t word = U16(frame, 0);
  const double torque_percent = I16(frame, 2) / 10.0;
  const std::int32_t position_counts = I32(frame, 4);
  const char* state = Name(DecodeState(word));
  out.fields = {{"state", std::string(state)},
                {"statusword", std::int64_t{word}},
                {"torque_percent", torque_percent},
                {"position_counts", std::int64_t{position_counts}}};
  out.text = fmt::format("{}, torque {:.1f} %, {} counts", state, torque_percent, position_counts);
  if ((word & statusword::kWarning) != 0) out.text += ", warning";
  if ((word & statusword::kInternalLimit) != 0) out.text += ", internal limit";
  if ((word & statusword::kFollowingError) != 0) out.text += ", following error";
}

void DecodeTpdo2(const CanFrame& frame, DecodedFrame& out) {
  const auto mode = static_cast<std::int8_t>(frame.data[6]);
  const auto temperature = static_cast<std::int8_t>(frame.data[7]);
  const double current_percent = I16(frame, 4) / 10.0;
  out.fields = {{"velocity_counts_s", std::int64_t{I32(frame, 0)}},
                {"current_percent", current_percent},
                {"mode", std::string(ModeName(mode))},
                {"temperature_celsius", std::int64_t{temperature}}};
  out.text = fmt::format("{} counts/s, current {:.1f} %, {}, {} deg C", I32(frame, 0),
                         current_percent, ModeName(mode), temperature);
}

void DecodeRpdo1(const CanFrame& frame, DecodedFrame& out) {
  const std::uint16_t word = U16(frame, 0);
  const double torque_percent = I16(frame, 2) / 10.0;
  out.fields = {{"command", ControlwordText(word)},
                {"controlword", std::int64_t{word}},
                {"target_torque_percent", torque_percent},
                {"target_position_counts", std::int64_t{I32(frame, 4)}}};
  out.text = fmt::format("{}, target torque {:.1f} %, {} counts", ControlwordText(word),
                         torque_percent, I32(frame, 4));
}

void DecodeRpdo2(const CanFrame& frame, DecodedFrame& out) {
  const auto mode = static_cast<std::int8_t>(frame.data[6]);
  const double offset_percent = I16(frame, 4) / 10.0;
  out.fields = {{"target_velocity_counts_s", std::int64_t{I32(frame, 0)}},
                {"torque_offset_percent", offset_percent},
                {"mode", std::string(ModeName(mode))}};
  out.text = fmt::format("target {} counts/s, torque offset {:.1f} %, {}", I32(frame, 0),
                         offset_percent, ModeName(mode));
}

void DecodeHeartbeat(const CanFrame& frame, DecodedFrame& out) {
  const char* state = Name(static_cast<NmtState>(frame.data[0] & 0x7FU));
  out.fields.push_back({"nmt_state", std::string(state)});
  out.text = state;
}

std::string ObjectName(std::uint16_t index, std::uint8_t sub) {
  const FoundObject found = FindObject(index, sub);
  return found.abort == SdoAbort::kNone ? kObjectTable[found.slot].name : "unknown object";
}

void DecodeSdo(const CanFrame& frame, bool reply, DecodedFrame& out) {
  const std::uint8_t command = frame.data[0];
  const std::uint16_t index = U16(frame, 1);
  const std::uint8_t sub = frame.data[3];
  const std::uint32_t value = LoadLe(&frame.data[4], 4);
  const std::string name = ObjectName(index, sub);
  const std::string object = fmt::format("{:04X}:{:02X} {}", index, sub, name);
  out.fields = {{"index", std::int64_t{index}}, {"sub", std::int64_t{sub}}, {"object", name}};
  const unsigned specifier = command >> 5U;
  const bool carries_data = reply ? specifier == 2 : specifier == 1;
  if (command == kSdoAbortCommand) {
    const char* meaning = Name(static_cast<SdoAbort>(value));
    out.fields.push_back({"abort_code", std::int64_t{value}});
    out.fields.push_back({"meaning", std::string(meaning)});
    out.text = fmt::format("abort {}: 0x{:08X} {}", object, value, meaning);
  } else if (carries_data) {
    const bool has_size = (command & 0x03U) == 0x03U;
    const unsigned bytes = has_size ? 4U - ((command >> 2U) & 3U) : 4U;
    const std::uint32_t carried = LoadLe(&frame.data[4], bytes);
    out.fields.push_back({"value", std::int64_t{carried}});
    out.text = fmt::format("{} {} = {} (0x{:0{}X})", reply ? "read" : "write", object, carried,
                           carried, 2 * bytes);
  } else if (!reply && command == kSdoUploadRequest) {
    out.text = "read " + object;
  } else if (reply && command == kSdoDownloadReply) {
    out.text = "written " + object;
  } else {
    out.text = fmt::format("command 0x{:02X} {}", command, object);
  }
}

struct Service {
  std::uint32_t base;
  std::string_view name;
  int least_bytes;
  void (*decode)(const CanFrame&, DecodedFrame&);
};

constexpr Service kServices[] = {
    {CobEmcy(0), "EMCY", 3, DecodeEmcy},
    {CobTpdo1(0), "TPDO1", 8, DecodeTpdo1},
    {CobRpdo1(0), "RPDO1", 8, DecodeRpdo1},
    {CobTpdo2(0), "TPDO2", 8, DecodeTpdo2},
    {CobRpdo2(0), "RPDO2", 7, DecodeRpdo2},
    {CobSdoReply(0), "SDO reply", 8,
     [](const CanFrame& frame, DecodedFrame& out) { DecodeSdo(frame, true, out); }},
    {CobSdoRequest(0), "SDO request", 8,
     [](const CanFrame& frame, DecodedFrame& out) { DecodeSdo(frame, false, out); }},
    {CobHeartbeat(0), "heartbeat", 1, DecodeHeartbeat},
};

std::string Bytes(const CanFrame& frame) {
  if (frame.remote) return fmt::format("remote, {} bytes", frame.size);
  std::string text;
  for (int i = 0; i < std::min<int>(frame.size, 8); ++i) {
    text += fmt::format("{}{:02X}", i > 0 ? " " : "", frame.data[i]);
  }
  return text;
}

}  // namespace

DecodedFrame Decode(const CanFrame& frame) {
  DecodedFrame out;
  out.service = "unknown";
  if (frame.error) {
    out.service = "error frame";
    out.fields.push_back({"error_class", std::int64_t{frame.id}});
    out.text = fmt::format("class 0x{:X}", frame.id);
    return out;
  }
  if (frame.extended || frame.remote) return out;
  if (frame.id == kCobNmt) {
    out.service = "NMT";
    frame.size < 2 ? DecodeTooShort(frame, 2, out) : DecodeNmt(frame, out);
    return out;
  }
  if (frame.id == kCobSync) {
    out.service = "SYNC";
    return out;
  }
  for (const Service& service : kServices) {
    const std::uint32_t node = frame.id & ~kFunctionMask;
    if ((frame.id & kFunctionMask) != service.base || node == 0) continue;
    out.service = service.name;
    out.node = static_cast<int>(node);
    if (frame.size < service.least_bytes) {
      DecodeTooShort(frame, service.least_bytes, out);
    } else {
      service.decode(frame, out);
    }
  }
  return out;
}

std::string Describe(const CanFrame& frame) {
  const DecodedFrame decoded = Decode(frame);
  std::string line =
      frame.extended ? fmt::format("{:08X}", frame.id) : fmt::format("{:03X}", frame.id);
  line = fmt::format("{:<8}  {:<23}  {}", line, Bytes(frame), decoded.service);
  if (decoded.node > 0) line += fmt::format(" node {}", decoded.node);
  if (!decoded.text.empty()) line += ": " + decoded.text;
  return line;
}

}  // namespace mantle::firmware_sim
