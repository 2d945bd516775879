#pragma once

#include <stdexcept>

namespace mantle::tools {

/// Bad input other than a scene's (an option, a file, an output folder): one line, exit status 2.
struct BadInput : std::runtime_error {
  using std::runtime_error::runtime_error;
};

}  // namespace mantle::tools
