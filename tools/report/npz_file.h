#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

/// Arrays for NumPy: an .npz file is a zip archive (stored, not compressed; PKWARE's APPNOTE) of
/// .npy files (format 1.0), one for each array, in C order, little-endian.

namespace mantle::tools {

/// CRC-32 of zip and gzip (polynomial 0xEDB88320, reflected).
std::uint32_t Crc32(std::string_view bytes);

class NpzFile {
 public:
  /// An array of this shape; `values` has as many entries as that says. Names are unique; what is
  /// not a letter, a digit, `_`, `-` or `.` becomes `_`. Throws std::invalid_argument where the
  /// counts differ.
  void Add(const std::string& name, const std::vector<std::size_t>& shape,
           std::span<const double> values);

  /// The whole file. Throws BadInput where it is beyond what zip's 32-bit fields tell (4 GiB).
  std::string Finish();

 private:
  struct Entry {
    std::string name;
    std::uint32_t crc{0};
    std::uint64_t size{0}, offset{0};
  };
  std::string bytes_;
  std::vector<Entry> entries_;
};

}  // namespace mantle::tools
