#include "tests/support/paths.h"

namespace mantle::tests {

std::string SourcePath(std::string_view relative) {
  return std::string(MANTLE_SOURCE_DIR "/") + std::string(relative);
}

std::string BinaryPath(std::string_view relative) {
  return std::string(MANTLE_BINARY_DIR "/") + std::string(relative);
}

}  // namespace mantle::tests
