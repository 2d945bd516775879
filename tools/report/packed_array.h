#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <vector>

/// Arrays as the report's page reads them (tools/report/page/src/packed.ts): one quantity, packed
/// small.
///
///   {"k": "c", "n", "v"}                       all the same value
///   {"k": "u16", "n", "lo", "step", "d"}       lo + step u, u below 65535; 65535: none (NaN)
///   {"k": "f32", "n", "d"}                     where the values span more than numbers of 16 bit
///   tell
///
/// d is base64 of little-endian numbers. Whole numbers within 65534 of one another keep their exact
/// value (step 1).

namespace mantle::tools {

std::string Base64(std::span<const std::uint8_t> bytes);

struct PackedArray {
  nlohmann::ordered_json json;
  double error{0};  ///< largest difference between a value and what is unpacked
};

/// 16 bit where rounding then loses at most `most_error` (0: whatever it loses), else single
/// precision.
PackedArray Pack(std::span<const double> values, double most_error = 0);

/// Every k-th of `rows` rows, and the last one: their indices.
std::vector<std::size_t> EveryKth(std::size_t rows, std::size_t k);

/// The k for EveryKth that leaves at most `most` rows, which is 2 or more.
std::size_t ThinningFor(std::size_t rows, std::size_t most);

/// Largest difference between values[i] and the line through the kept neighbours, over `time`;
/// infinite or missing values do not count.
double ThinningError(std::span<const double> time, std::span<const double> values,
                     std::span<const std::size_t> kept);

}  // namespace mantle::tools
