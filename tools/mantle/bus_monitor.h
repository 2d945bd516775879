#pragma once

#include <atomic>
#include <string>

/// `mantle bus monitor`: prints what is on a bus, in words or JSON, and its load.

namespace mantle::tools {

struct MonitorOptions {
  std::string bus;
  double duration_s{0};  ///< 0: until `interrupted`
  bool json{false};
  bool changes{false};  ///< a frame only where it says something new
  std::string record;   ///< candump log to write; empty: none
};

/// Returns the exit status. Throws std::invalid_argument for a bad option and std::system_error
/// where bus or log cannot be opened.
int RunMonitor(const MonitorOptions& options, const std::atomic<bool>& interrupted);

}  // namespace mantle::tools
