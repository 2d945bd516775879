#pragma once

#include <string>
#include <string_view>

/// Where a test finds the repository's files and the built program. Compiled in one file, so that
/// no other object depends on where the repository stands.

namespace mantle::tests {

/// Absolute path of a file of the repository, such as "scenes/paper.toml".
std::string SourcePath(std::string_view relative);
/// Absolute path in the build folder; "mantle" is the program.
std::string BinaryPath(std::string_view relative);

}  // namespace mantle::tests
