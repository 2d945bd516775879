#include "tools/report/packed_array.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

namespace mantle::tools {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::uint16_t kNone = 65535, kMost = 65534;

template <typename Integer>
void Append(Integer value, std::vector<std::uint8_t>* bytes) {
  for (std::size_t i = 0; i < sizeof value; ++i) {
    bytes->push_back(static_cast<std::uint8_t>(value >> (8 * i)));
  }
}

}  // namespace

std::string Base64(std::span<const std::uint8_t> bytes) {
  constexpr const char* kDigits =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    const std::size_t left = std::min<std::size_t>(3, bytes.size() - i);
    std::uint32_t word = 0;
    for (std::size_t k = 0; k < 3; ++k) word = word << 8 | (k < left ? bytes[i + k] : 0U);
    for (std::size_t k = 0; k < 4; ++k) {
      text += k <= left ? kDigits[word >> (18 - 6 * k) & 63] : '=';
    }
  }
  return text;
}

PackedArray Pack(std::span<const double> values, double most_error) {
  double low = std::numeric_limits<double>::infinity(), high = -low;
  bool missing = false, whole = true;
  for (const double v : values) {
    if (!std::isfinite(v)) {
      missing = true;
      continue;
    }
    low = std::min(low, v);
    high = std::max(high, v);
    whole = whole && v == std::floor(v);
  }
  PackedArray out;
  const auto n = values.size();
  if (low > high) {
    out.json = {{"k", "c"}, {"n", n}, {"v", nullptr}};
    return out;
  }
  if (low == high && !missing) {
    out.json = {{"k", "c"}, {"n", n}, {"v", low}};
    return out;
  }
  whole = whole && high - low <= kMost;
  const double step = whole ? 1.0 : std::max((high - low) / kMost, 1e-300);
  std::vector<std::uint8_t> bytes;
  if (most_error > 0 && !whole && 0.5 * step > most_error) {
    bytes.reserve(4 * n);
    for (const double v : values) {
      const auto single = static_cast<float>(v);
      if (std::isfinite(v)) out.error = std::max(out.error, std::abs(v - double{single}));
      Append(std::bit_cast<std::uint32_t>(single), &bytes);
    }
    out.json = {{"k", "f32"}, {"n", n}, {"d", Base64(bytes)}};
    return out;
  }
  bytes.reserve(2 * n);
  for (const double v : values) {
    std::uint16_t u = kNone;
    if (std::isfinite(v)) {
      u = static_cast<std::uint16_t>(std::min<double>(std::round((v - low) / step), kMost));
      out.error = std::max(out.error, std::abs(v - (low + step * u)));
    }
    Append(u, &bytes);
  }
  out.json = {{"k", "u16"}, {"n", n}, {"lo", low}, {"step", step}, {"d", Base64(bytes)}};
  return out;
}

std::vector<std::size_t> EveryKth(std::size_t rows, std::size_t k) {
  std::vector<std::size_t> kept;
  for (std::size_t i = 0; i < rows; i += k) kept.push_back(i);
  if (rows > 0 && kept.back() != rows - 1) kept.push_back(rows - 1);
  return kept;
}

std::size_t ThinningFor(std::size_t rows, std::size_t most) {
  std::size_t k = 1;
  const auto kept = [&] { return (rows - 1) / k + 1 + ((rows - 1) % k != 0 ? 1 : 0); };
  while (rows > most && kept() > most) ++k;
  return k;
}

double ThinningError(std::span<const double> time, std::span<const double> values,
                     std::span<const std::size_t> kept) {
  double error = 0;
  for (std::size_t i = 0; i + 1 < kept.size(); ++i) {
    const std::size_t a = kept[i], b = kept[i + 1];
    for (std::size_t j = a + 1; j < b; ++j) {
      const double span = time[b] - time[a];
      const double share = span > 0 ? (time[j] - time[a]) / span : 0.0;
      const double off = std::abs(values[j] - values[a] - share * (values[b] - values[a]));
      if (std::isfinite(off)) error = std::max(error, off);
    }
  }
  return error;
}

}  // namespace mantle::tools
