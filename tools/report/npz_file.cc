#include "tools/report/npz_file.h"

#include <fmt/format.h>

#include <array>
#include <bit>
#include <cctype>
#include <functional>
#include <numeric>
#include <stdexcept>
#include <string_view>

#include "tools/mantle/bad_input.h"

namespace mantle::tools {
namespace {

constexpr std::uint32_t kLocal = 0x04034b50, kCentral = 0x02014b50, kEnd = 0x06054b50;
constexpr std::uint16_t kVersion = 20, kDate = 0x21;  // 1980-01-01: the same run, the same bytes
constexpr std::size_t kAlign_bytes = 64;              // of an array's data, as NumPy writes it
constexpr std::uint64_t kMost_bytes = 0xFFFF'FFFF;

template <typename Integer>
void Put(Integer value, std::string* to) {
  for (std::size_t i = 0; i < sizeof value; ++i) {
    to->push_back(static_cast<char>(static_cast<std::uint64_t>(value) >> (8 * i)));
  }
}

std::array<std::uint32_t, 256> CrcTable() {
  std::array<std::uint32_t, 256> table;
  for (std::uint32_t n = 0; n < 256; ++n) {
    std::uint32_t c = n;
    for (int k = 0; k < 8; ++k) c = c & 1 ? 0xEDB88320U ^ (c >> 1) : c >> 1;
    table[n] = c;
  }
  return table;
}

std::string NpyHeader(const std::vector<std::size_t>& shape) {
  std::string dims;
  for (const std::size_t n : shape) dims += fmt::format("{},", n);
  std::string text =
      fmt::format("{{'descr': '<f8', 'fortran_order': False, 'shape': ({}), }}", dims);
  constexpr std::size_t kBefore = 10;  // magic, version, length
  while ((kBefore + text.size() + 1) % kAlign_bytes != 0) text += ' ';
  text += '\n';
  std::string header("\x93NUMPY\x01\x00", 8);
  Put(static_cast<std::uint16_t>(text.size()), &header);
  return header + text;
}

}  // namespace

std::uint32_t Crc32(std::string_view bytes) {
  static const std::array<std::uint32_t, 256> table = CrcTable();
  std::uint32_t c = 0xFFFF'FFFF;
  for (const char byte : bytes) c = table[(c ^ static_cast<std::uint8_t>(byte)) & 0xFF] ^ (c >> 8);
  return c ^ 0xFFFF'FFFF;
}

void NpzFile::Add(const std::string& name, const std::vector<std::size_t>& shape,
                  std::span<const double> values) {
  const std::size_t count =
      std::accumulate(shape.begin(), shape.end(), std::size_t{1}, std::multiplies<>());
  if (count != values.size()) {
    throw std::invalid_argument(
        fmt::format("{}: {} values, must be {} as its shape says", name, values.size(), count));
  }
  Entry entry;
  for (const char c : name) {
    const bool plain =
        std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_' || c == '-' || c == '.';
    entry.name += plain ? c : '_';
  }
  entry.name += ".npy";
  std::string data = NpyHeader(shape);
  data.reserve(data.size() + 8 * values.size());
  for (const double v : values) Put(std::bit_cast<std::uint64_t>(v), &data);
  entry.crc = Crc32(data);
  entry.size = data.size();
  entry.offset = bytes_.size();
  Put(kLocal, &bytes_);
  for (const std::uint16_t field :
       {kVersion, std::uint16_t{0}, std::uint16_t{0}, std::uint16_t{0}, kDate}) {
    Put(field, &bytes_);
  }
  Put(entry.crc, &bytes_);
  Put(static_cast<std::uint32_t>(entry.size), &bytes_);
  Put(static_cast<std::uint32_t>(entry.size), &bytes_);
  Put(static_cast<std::uint16_t>(entry.name.size()), &bytes_);
  Put(std::uint16_t{0}, &bytes_);
  bytes_ += entry.name + data;
  entries_.push_back(entry);
}

std::string NpzFile::Finish() {
  const std::uint64_t begin = bytes_.size();
  for (const Entry& e : entries_) {
    Put(kCentral, &bytes_);
    for (const std::uint16_t field :
         {kVersion, kVersion, std::uint16_t{0}, std::uint16_t{0}, std::uint16_t{0}, kDate}) {
      Put(field, &bytes_);
    }
    Put(e.crc, &bytes_);
    Put(static_cast<std::uint32_t>(e.size), &bytes_);
    Put(static_cast<std::uint32_t>(e.size), &bytes_);
    Put(static_cast<std::uint16_t>(e.name.size()), &bytes_);
    for (int i = 0; i < 4; ++i) Put(std::uint16_t{0}, &bytes_);  // extra, comment, disk, attributes
    Put(std::uint32_t{0}, &bytes_);
    Put(static_cast<std::uint32_t>(e.offset), &bytes_);
    bytes_ += e.name;
  }
  const std::uint64_t end = bytes_.size();
  if (end > kMost_bytes || entries_.size() > 0xFFFF) {
    throw BadInput(fmt::format(
        "npz: {} arrays of {} bytes, must be at most 65535 of 4 GiB in all: log fewer shapes "
        "(--shape-every)",
        entries_.size(), end));
  }
  Put(kEnd, &bytes_);
  Put(std::uint32_t{0}, &bytes_);
  Put(static_cast<std::uint16_t>(entries_.size()), &bytes_);
  Put(static_cast<std::uint16_t>(entries_.size()), &bytes_);
  Put(static_cast<std::uint32_t>(end - begin), &bytes_);
  Put(static_cast<std::uint32_t>(begin), &bytes_);
  Put(std::uint16_t{0}, &bytes_);
  return std::move(bytes_);
}

}  // namespace mantle::tools
