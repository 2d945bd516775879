#pragma once

#include <chrono>
#include <string>

/// One line on a terminal that says how far a run is, how long it will take and how fast it is.
/// Silent where standard error is not a terminal.

namespace mantle::tools {

class Progress {
 public:
  /// `total` in the unit of what is reported (simulated seconds, load factor); `start` where it
  /// begins.
  Progress(double start, double total, std::string unit, bool show_realtime);
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  void Update(double done);
  /// Clears the line.
  void Finish();

 private:
  using Clock = std::chrono::steady_clock;
  double start_, total_;
  std::string unit_;
  bool show_realtime_, terminal_, drawn_{false};
  Clock::time_point begin_, last_;
};

/// "1:05", "2:03:04".
std::string ClockText(double seconds);

}  // namespace mantle::tools
