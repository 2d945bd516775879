#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>

/// @file
/// Reading a whole file that a user names: regular files alone (a pipe may never end, a device has
/// no end), and none that is larger than its kind can be.

namespace mantle::scene {

/// Why a file cannot be read, for behind its name: "no such file", "is no regular file".
struct UnreadableFile : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// The file's bytes, the first `first_bytes` of them where given. Never waits for another process.
/// Throws UnreadableFile where there is no such file, it is none of bytes, it cannot be read, or
/// what is to be read is more than `most_bytes`.
std::string ReadRegularFile(const std::filesystem::path& file, std::uintmax_t most_bytes,
                            std::optional<std::uintmax_t> first_bytes = {});

/// FNV-1a, 64 bits: of a text alone, or of a text behind what `hash` is of. Two texts of one length
/// that differ in one byte never have the same.
inline constexpr std::uint64_t kEmptyHash = 14695981039346656037ull;
std::uint64_t Hash(std::string_view text, std::uint64_t hash = kEmptyHash);

}  // namespace mantle::scene
