#include "firmware_sim/bus/bus_load.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <stdexcept>

namespace mantle::firmware_sim {

namespace {

constexpr int kUnstuffedTail = 3 + 7 + 3;  // delimiters and acknowledge, end of frame, interframe
constexpr int kErrorFrameBits = 6 + 8 + 3;

// Counts stuff bits and runs the CRC while the bits of a frame pass by.
class BitStream {
 public:
  void Put(std::uint32_t value, int bits) {
    for (int i = bits - 1; i >= 0; --i) {
      const int bit = static_cast<int>((value >> i) & 1U);
      const bool invert = (bit != 0) != ((crc_ & 0x4000U) != 0);
      crc_ = static_cast<std::uint16_t>((crc_ << 1) & 0x7FFFU);
      if (invert) crc_ ^= 0x4599U;
      Stuff(bit);
    }
  }

  void PutCrc() {
    const std::uint16_t crc = crc_;
    for (int i = 14; i >= 0; --i) Stuff((crc >> i) & 1);
  }

  int bits() const { return bits_; }

 private:
  void Stuff(int bit) {
    ++bits_;
    run_ = bit == last_ ? run_ + 1 : 1;
    last_ = bit;
    if (run_ == 5) {
      ++bits_;
      last_ = 1 - bit;
      run_ = 1;
    }
  }

  std::uint16_t crc_{0};
  int bits_{0};
  int run_{0};
  int last_{-1};
};

int StuffedPart(int size, bool extended) { return (extended ? 54 : 34) + 8 * size; }

void Check(bool good, std::string_view what, std::int64_t value, std::string_view bound) {
  if (!good) throw std::invalid_argument(fmt::format("{} is {}, must be {}", what, value, bound));
}

}  // namespace

int ActualFrameBits(const CanFrame& frame) {
  if (frame.error) return kErrorFrameBits;
  BitStream stream;
  stream.Put(0, 1);  // start of frame
  const std::uint32_t remote = frame.remote ? 1 : 0;
  if (frame.extended) {
    stream.Put((frame.id >> 18) & 0x7FFU, 11);
    stream.Put(3, 2);  // substitute remote request, identifier extension: both recessive
    stream.Put(frame.id & 0x3FFFFU, 18);
    stream.Put(remote, 1);
    stream.Put(0, 2);  // reserved
  } else {
    stream.Put(frame.id & 0x7FFU, 11);
    stream.Put(remote, 1);
    stream.Put(0, 2);  // identifier extension, reserved
  }
  stream.Put(frame.size, 4);
  if (!frame.remote) {
    for (int i = 0; i < std::min<int>(frame.size, 8); ++i) stream.Put(frame.data[i], 8);
  }
  stream.PutCrc();
  return stream.bits() + kUnstuffedTail;
}

int WorstFrameBits(int size, bool extended) {
  const int stuffed = StuffedPart(size, extended);
  return stuffed + (stuffed - 1) / 4 + kUnstuffedTail;
}

int LeastFrameBits(int size, bool extended) { return StuffedPart(size, extended) + kUnstuffedTail; }

std::uint32_t ArbitrationField(const CanFrame& frame) {
  const std::uint32_t remote = frame.remote ? 1 : 0;
  if (frame.extended) {
    const std::uint32_t base = (frame.id >> 18) & 0x7FFU;
    return (base << 21) | (3U << 19) | ((frame.id & 0x3FFFFU) << 1) | remote;
  }
  return ((frame.id & 0x7FFU) << 21) | (remote << 20);
}

double LoadPercent(double bits, std::int64_t duration_us, std::int64_t bit_rate) {
  if (duration_us <= 0 || bit_rate <= 0) return 0;
  return 100.0 * bits * 1e6 / (static_cast<double>(duration_us) * static_cast<double>(bit_rate));
}

BusLoad LoadOfScene(const CyclicTraffic& traffic) {
  Check(traffic.drives >= 1 && traffic.drives <= 126, "number of drives", traffic.drives,
        "1 to 126");
  Check(traffic.rpdos >= 0 && traffic.rpdos <= 2, "RPDOs per drive", traffic.rpdos, "0 to 2");
  Check(traffic.tpdos >= 0 && traffic.tpdos <= 2, "TPDOs per drive", traffic.tpdos, "0 to 2");
  Check(traffic.period_us >= 100 && traffic.period_us <= 10'000'000, "period in us",
        traffic.period_us, "100 to 10000000");
  Check(traffic.heartbeat_us >= 0, "heartbeat in us", traffic.heartbeat_us, "0 or more");

  BusLoad load;
  const auto add = [&](std::string name, std::string cob_id, int size, double count) {
    load.rows.push_back(
        {std::move(name), std::move(cob_id), size, count, WorstFrameBits(size, false)});
    load.frames += count;
    load.least_bits += count * LeastFrameBits(size, false);
    load.worst_bits += count * WorstFrameBits(size, false);
  };
  const auto range = [&](int base) {
    return traffic.drives == 1 ? fmt::format("0x{:03X}", base + 1)
                               : fmt::format("0x{:03X}..0x{:03X}", base + 1, base + traffic.drives);
  };
  add("SYNC", "0x080", 0, 1);
  // Data bytes of the profile's mappings.
  constexpr std::array<int, 2> kRpdoSize{8, 7};
  constexpr std::array<int, 2> kTpdoSize{8, 8};
  for (int i = 0; i < traffic.rpdos; ++i) {
    add(fmt::format("RPDO{}", i + 1), range(0x200 + 0x100 * i), kRpdoSize[i], traffic.drives);
  }
  for (int i = 0; i < traffic.tpdos; ++i) {
    add(fmt::format("TPDO{}", i + 1), range(0x180 + 0x100 * i), kTpdoSize[i], traffic.drives);
  }
  if (traffic.heartbeat_us > 0) {
    const double per_cycle =
        static_cast<double>(traffic.period_us) / static_cast<double>(traffic.heartbeat_us);
    add("heartbeat", range(0x700) + ", 0x77F", 1, per_cycle * (traffic.drives + 1));
  }
  load.least_percent = LoadPercent(load.least_bits, traffic.period_us);
  load.worst_percent = LoadPercent(load.worst_bits, traffic.period_us);
  load.warn = load.worst_percent > kBusLoadWarningPercent;
  return load;
}

}  // namespace mantle::firmware_sim
