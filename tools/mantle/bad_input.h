#pragma once

#include <stdexcept>

/// What ends a command early, by the exit status it leads to (tools/mantle/exit_status.h).

namespace mantle::tools {

/// Bad input other than a scene's (an option, a file, an output folder): one line, exit status 2.
struct BadInput : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// A run that could not go on for what is neither input nor model (a full disk): one line, exit
/// status 3.
struct CannotGoOn : std::runtime_error {
  using std::runtime_error::runtime_error;
};

}  // namespace mantle::tools
