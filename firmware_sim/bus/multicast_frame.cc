#include "firmware_sim/bus/multicast_frame.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <string_view>

namespace mantle::firmware_sim {

namespace {

constexpr std::uint32_t kMostPairs = 64;

class Writer {
 public:
  explicit Writer(std::span<std::uint8_t> out) : out_(out) {}

  void Byte(std::uint8_t byte) { out_[size_++] = byte; }
  void BigEndian(std::uint64_t value, int bytes) {
    for (int i = bytes - 1; i >= 0; --i) Byte(static_cast<std::uint8_t>(value >> (8 * i)));
  }
  // Keys are shorter than 32 characters: fixstr.
  void Key(std::string_view key) {
    Byte(static_cast<std::uint8_t>(0xA0 | key.size()));
    for (const char c : key) Byte(static_cast<std::uint8_t>(c));
  }
  void Bool(std::string_view key, bool value) {
    Key(key);
    Byte(value ? 0xC3 : 0xC2);
  }
  void Unsigned(std::uint32_t value) {
    if (value < 0x80) {
      Byte(static_cast<std::uint8_t>(value));
    } else if (value <= 0xFF) {
      Byte(0xCC);
      BigEndian(value, 1);
    } else if (value <= 0xFFFF) {
      Byte(0xCD);
      BigEndian(value, 2);
    } else {
      Byte(0xCE);
      BigEndian(value, 4);
    }
  }
  std::size_t size() const { return size_; }

 private:
  std::span<std::uint8_t> out_;
  std::size_t size_{0};
};

struct Value {
  enum class Kind : std::uint8_t { kNil, kBool, kInteger, kFloat, kText, kBinary, kOther };
  Kind kind{Kind::kNil};
  std::uint64_t integer{0};  // of kBool and kInteger
  bool negative{false};
  double real{0};
  std::span<const std::uint8_t> bytes;  // of kText and kBinary
  std::uint64_t children{0};            // of arrays and maps (kOther)
};

class Reader {
 public:
  explicit Reader(std::span<const std::uint8_t> in) : in_(in) {}

  bool good() const { return good_; }
  bool done() const { return in_.empty(); }

  std::uint64_t BigEndian(std::size_t bytes) {
    std::uint64_t value = 0;
    for (const std::uint8_t byte : Take(bytes)) value = (value << 8) | byte;
    return value;
  }

  // The head of the next value; the children of an array or map follow it.
  Value Next() {
    Value value;
    const auto type = static_cast<std::uint8_t>(BigEndian(1));
    using Kind = Value::Kind;
    const auto integer = [&](std::size_t bytes, bool is_signed) {
      value.kind = Kind::kInteger;
      value.integer = BigEndian(bytes);
      value.negative = is_signed && ((value.integer >> (8 * bytes - 1)) & 1) != 0;
    };
    const auto block = [&](Kind kind, std::uint64_t size) {
      value.kind = kind;
      value.bytes = Take(size);
    };
    const auto nest = [&](std::uint64_t children) {
      value.kind = Kind::kOther;
      value.children = children;
    };
    if (type < 0x80) {
      value.kind = Kind::kInteger;
      value.integer = type;
    } else if (type < 0x90) {
      nest(2ULL * (type & 0x0FU));
    } else if (type < 0xA0) {
      nest(type & 0x0FU);
    } else if (type < 0xC0) {
      block(Kind::kText, type & 0x1FU);
    } else if (type >= 0xE0) {
      value.kind = Kind::kInteger;
      value.negative = true;
    } else {
      switch (type) {
        case 0xC0:
          break;
        case 0xC2:
        case 0xC3:
          value.kind = Kind::kBool;
          value.integer = type & 1U;
          break;
        case 0xC4:
        case 0xC5:
        case 0xC6:
          block(Kind::kBinary, BigEndian(std::size_t{1} << (type - 0xC4)));
          break;
        case 0xC7:
        case 0xC8:
        case 0xC9:
          block(Kind::kOther, BigEndian(std::size_t{1} << (type - 0xC7)) + 1);
          break;
        case 0xCA:
          value.kind = Kind::kFloat;
          value.real = std::bit_cast<float>(static_cast<std::uint32_t>(BigEndian(4)));
          break;
        case 0xCB:
          value.kind = Kind::kFloat;
          value.real = std::bit_cast<double>(BigEndian(8));
          break;
        case 0xCC:
        case 0xCD:
        case 0xCE:
        case 0xCF:
          integer(std::size_t{1} << (type - 0xCC), false);
          break;
        case 0xD0:
        case 0xD1:
        case 0xD2:
        case 0xD3:
          integer(std::size_t{1} << (type - 0xD0), true);
          break;
        case 0xD4:
        case 0xD5:
        case 0xD6:
        case 0xD7:
        case 0xD8:
          block(Kind::kOther, (std::size_t{1} << (type - 0xD4)) + 1);
          break;
        case 0xD9:
        case 0xDA:
        case 0xDB:
          block(Kind::kText, BigEndian(std::size_t{1} << (type - 0xD9)));
          break;
        case 0xDC:
        case 0xDD:
          nest(BigEndian(std::size_t{2} << (type - 0xDC)));
          break;
        case 0xDE:
        case 0xDF:
          nest(2 * BigEndian(std::size_t{2} << (type - 0xDE)));
          break;
        default:  // 0xC1 is never used
          good_ = false;
      }
    }
    return value;
  }

  // Each child takes a byte at least, so that a claimed count ends with the datagram.
  void Skip(std::uint64_t children) {
    while (children > 0 && good_) {
      const std::uint64_t more = Next().children;
      children = children - 1 + more;
    }
  }

 private:
  std::span<const std::uint8_t> Take(std::uint64_t bytes) {
    if (!good_ || bytes > in_.size()) {
      good_ = false;
      return {};
    }
    const auto taken = in_.first(static_cast<std::size_t>(bytes));
    in_ = in_.subspan(static_cast<std::size_t>(bytes));
    return taken;
  }

  std::span<const std::uint8_t> in_;
  bool good_{true};
};

std::string_view Text(std::span<const std::uint8_t> bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

bool TakeFlag(const Value& value, bool& flag) {
  if (value.kind != Value::Kind::kBool) return false;
  flag = value.integer != 0;
  return true;
}

bool TakeUnsigned(const Value& value, std::uint64_t bound, std::uint64_t& out) {
  if (value.kind != Value::Kind::kInteger || value.negative || value.integer > bound) return false;
  out = value.integer;
  return true;
}

struct Fields {
  bool has_id{false}, has_dlc{false};
  bool extended{true}, remote{false}, error{false}, fd{false};
  std::uint64_t id{0}, dlc{0};
  std::span<const std::uint8_t> data;
  double timestamp_s{0};
};

// False where the value is not what the key demands.
bool TakeField(std::string_view key, const Value& value, Fields& fields) {
  if (key == "arbitration_id") return fields.has_id = TakeUnsigned(value, 0x1FFFFFFF, fields.id);
  if (key == "dlc") return fields.has_dlc = TakeUnsigned(value, 64, fields.dlc);
  if (key == "is_extended_id") return TakeFlag(value, fields.extended);
  if (key == "is_remote_frame") return TakeFlag(value, fields.remote);
  if (key == "is_error_frame") return TakeFlag(value, fields.error);
  if (key == "is_fd") return TakeFlag(value, fields.fd);
  if (key == "data") {
    fields.data = value.bytes;
    return value.kind == Value::Kind::kBinary;
  }
  if (key == "timestamp") {
    fields.timestamp_s =
        value.kind == Value::Kind::kFloat ? value.real : static_cast<double>(value.integer);
    return value.kind == Value::Kind::kFloat || value.kind == Value::Kind::kInteger;
  }
  return true;
}

}  // namespace

std::size_t EncodeMulticastFrame(const CanFrame& frame,
                                 std::span<std::uint8_t, kMulticastFrameBytes> datagram) {
  Writer out(datagram);
  const std::uint8_t size = std::min<std::uint8_t>(frame.size, 8);
  out.Byte(0x8B);  // fixmap of eleven pairs
  out.Key("timestamp");
  out.Byte(0xCB);
  out.BigEndian(std::bit_cast<std::uint64_t>(static_cast<double>(frame.time_us) * 1e-6), 8);
  out.Key("arbitration_id");
  out.Unsigned(frame.id);
  out.Bool("is_extended_id", frame.extended || frame.error);
  out.Bool("is_remote_frame", frame.remote);
  out.Bool("is_error_frame", frame.error);
  out.Key("channel");
  out.Byte(0xC0);
  out.Key("dlc");
  out.Unsigned(size);
  out.Key("data");
  out.Byte(0xC4);
  const std::uint8_t carried = frame.remote ? 0 : size;
  out.Byte(carried);
  for (int i = 0; i < carried; ++i) out.Byte(frame.data[i]);
  out.Bool("is_fd", false);
  out.Bool("bitrate_switch", false);
  out.Bool("error_state_indicator", false);
  return out.size();
}

MulticastDecode DecodeMulticastFrame(std::span<const std::uint8_t> datagram, CanFrame& frame) {
  if (datagram.empty()) return MulticastDecode::kMalformed;
  const bool is_map = (datagram[0] & 0xF0U) == 0x80 || datagram[0] == 0xDE || datagram[0] == 0xDF;
  Reader in(datagram);
  const std::uint64_t pairs = in.Next().children / 2;
  if (!is_map || !in.good() || pairs > kMostPairs) return MulticastDecode::kMalformed;
  Fields fields;
  for (std::uint64_t i = 0; i < pairs; ++i) {
    const Value key = in.Next();
    const Value value = in.Next();
    in.Skip(value.children);
    if (!in.good() || key.kind != Value::Kind::kText ||
        !TakeField(Text(key.bytes), value, fields)) {
      return MulticastDecode::kMalformed;
    }
  }
  if (!in.done() || !fields.has_id) return MulticastDecode::kMalformed;
  if (fields.fd) return MulticastDecode::kFdFrame;
  const std::uint64_t size = fields.has_dlc ? fields.dlc : fields.data.size();
  const bool sizes_agree = fields.remote ? fields.data.empty() : fields.data.size() == size;
  const bool id_fits = fields.extended || fields.error || fields.id <= 0x7FF;
  const bool time_fits = std::abs(fields.timestamp_s) < 1e12;  // also false for NaN
  if (size > 8 || !sizes_agree || !id_fits || !time_fits || (fields.remote && fields.error)) {
    return MulticastDecode::kMalformed;
  }
  CanFrame out;
  out.id = static_cast<std::uint32_t>(fields.id);
  out.size = static_cast<std::uint8_t>(size);
  out.extended = fields.extended && !fields.error;
  out.remote = fields.remote;
  out.error = fields.error;
  std::copy(fields.data.begin(), fields.data.end(), out.data.begin());
  out.time_us = std::llround(fields.timestamp_s * 1e6);
  frame = out;
  return MulticastDecode::kFrame;
}

}  // namespace mantle::firmware_sim
