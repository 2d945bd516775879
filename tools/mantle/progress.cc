#include "tools/mantle/progress.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace mantle::tools {
namespace {

constexpr auto kRedraw = std::chrono::milliseconds(100);
constexpr int kBarWidth = 24;

}  // namespace

std::string ClockText(double seconds) {
  const long s = std::lround(std::clamp(seconds, 0.0, 1e9));
  if (s >= 3600) return fmt::format("{}:{:02}:{:02}", s / 3600, s / 60 % 60, s % 60);
  return fmt::format("{}:{:02}", s / 60, s % 60);
}

Progress::Progress(double start, double total, std::string unit, bool show_realtime)
    : start_(start),
      total_(total),
      unit_(std::move(unit)),
      show_realtime_(show_realtime),
      terminal_(isatty(STDERR_FILENO) != 0),
      begin_(Clock::now()),
      last_(begin_) {}

Progress::~Progress() { Finish(); }

void Progress::Update(double done) {
  if (!terminal_) return;
  const Clock::time_point now = Clock::now();
  if (now - last_ < kRedraw) return;
  last_ = now;
  const double elapsed = std::chrono::duration<double>(now - begin_).count();
  const double part = std::clamp((done - start_) / (total_ - start_), 1e-9, 1.0);
  const int filled = static_cast<int>(kBarWidth * std::clamp(done / total_, 0.0, 1.0));
  std::string line = fmt::format("\r[{}{}] {:.3g} of {:.3g} {}  ETA {}", std::string(filled, '='),
                                 std::string(kBarWidth - filled, ' '), done, total_, unit_,
                                 ClockText(elapsed * (1.0 - part) / part));
  if (show_realtime_) line += fmt::format("  {:.1f}x real time", (done - start_) / elapsed);
  std::fputs((line + "\x1b[K").c_str(), stderr);
  std::fflush(stderr);
  drawn_ = true;
}

void Progress::Finish() {
  if (drawn_) std::fputs("\r\x1b[K", stderr);
  drawn_ = false;
}

}  // namespace mantle::tools
