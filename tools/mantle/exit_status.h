#pragma once

#include <functional>

/// Exit statuses of every command: 0 done; 1 standard output could not be written, or an internal
/// fault; 2 bad input (scene, option, output folder), said in one line, nothing changed; 3 could
/// not go on, or interrupted, what was reached kept in DIR.partial.

namespace mantle::tools {

inline constexpr int kExitFault = 1;
inline constexpr int kExitBadInput = 2;
inline constexpr int kExitCannotContinue = 3;

/// The status of `command`: what it returns, or what it throws says, in one line on standard error.
/// Flushes standard output; where that fails and nothing worse has happened, the status is 1.
int StatusOf(const std::function<int()>& command) noexcept;

}  // namespace mantle::tools
