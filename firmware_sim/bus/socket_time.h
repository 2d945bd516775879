#pragma once

#include <cerrno>
#include <cstdint>
#include <ctime>

/// @file
/// Kernel time structures in microseconds, for the socket transports.

namespace mantle::firmware_sim {

inline timespec ToTimespec(std::int64_t duration_us) {
  return {.tv_sec = duration_us / 1'000'000, .tv_nsec = (duration_us % 1'000'000) * 1000};
}

inline std::int64_t ToMicroseconds(const timespec& time) {
  return std::int64_t{time.tv_sec} * 1'000'000 + time.tv_nsec / 1000;
}

/// CLOCK_REALTIME, the clock of kernel time stamps and candump logs.
inline std::int64_t RealTime_us() {
  timespec now{};
  clock_gettime(CLOCK_REALTIME, &now);
  return ToMicroseconds(now);
}

/// CLOCK_MONOTONIC, the clock of programs that run in real time.
inline std::int64_t MonotonicTime_us() {
  timespec now{};
  clock_gettime(CLOCK_MONOTONIC, &now);
  return ToMicroseconds(now);
}

/// Blocks for `duration_us`; signals do not shorten it.
inline void SleepFor(std::int64_t duration_us) {
  timespec left = ToTimespec(duration_us);
  while (clock_nanosleep(CLOCK_MONOTONIC, 0, &left, &left) == EINTR) {
  }
}

/// Blocks until CLOCK_MONOTONIC shows `time_us`; signals do not shorten it. At once where it is
/// past.
inline void SleepUntil(std::int64_t time_us) {
  const timespec until = ToTimespec(time_us);
  while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &until, nullptr) == EINTR) {
  }
}

}  // namespace mantle::firmware_sim
