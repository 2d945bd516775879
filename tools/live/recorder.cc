#include "tools/live/recorder.h"

#include <fmt/format.h>

#include <ctime>
#include <system_error>

#include "tools/mantle/bad_input.h"

namespace mantle::tools {
namespace {

namespace fs = std::filesystem;

// A new folder "live-20260131-235959", or with a number behind it where there is one.
fs::path NewFolder(const fs::path& parent) {
  constexpr int kTries = 100;
  const std::time_t now = std::time(nullptr);
  std::tm local{};
  localtime_r(&now, &local);
  char name[32] = {};
  std::strftime(name, sizeof name, "live-%Y%m%d-%H%M%S", &local);
  std::error_code error;
  fs::create_directories(parent, error);
  for (int i = 1; i <= kTries && !error; ++i) {
    const fs::path folder = parent / (i == 1 ? std::string(name) : fmt::format("{}-{}", name, i));
    if (fs::create_directory(folder, error)) return folder;
  }
  throw CannotGoOn(fmt::format("{}: no folder can be made in it: {}", parent.string(),
                               error ? error.message() : "all names are taken"));
}

}  // namespace

Recorder::~Recorder() { Finish(); }

template <typename Message>
void Recorder::Keep(const Message& message) {
  const std::lock_guard lock(mutex_);
  if (!log_) return;
  try {
    log_->Write(message);
    if (++figures_.messages >= kMostRecord_messages) End("it has grown to its largest length");
  } catch (const std::exception& error) {
    log_.reset();
    figures_.on = false;
    figures_.note = error.what();
  }
}

void Recorder::Write(const StateTelemetry& m) {
  {
    const std::lock_guard lock(mutex_);
    if (log_ && figures_.messages > 0 && m.utime < state_us_) End("another run began");
    state_us_ = m.utime;
  }
  Keep(m);
}

void Recorder::Begin() {
  figures_ = {};
  try {
    const fs::path folder = NewFolder(parent_);
    figures_.folder = folder.string();
    log_ = OpenLcm({.log_folder = folder});
    figures_.on = true;
  } catch (const std::exception& error) {
    log_.reset();
    figures_.note = error.what();
  }
}

void Recorder::End(const std::string& why) {
  figures_.on = false;
  figures_.note = why;
  try {
    log_->FinishLog();
  } catch (const std::exception& error) {
    figures_.note = error.what();
  }
  log_.reset();
}

void Recorder::Toggle() {
  const std::lock_guard lock(mutex_);
  log_ ? End("") : Begin();
}

void Recorder::Finish(const std::string& why) {
  const std::lock_guard lock(mutex_);
  if (log_) End(why);
}

Recorder::Figures Recorder::figures() const {
  const std::lock_guard lock(mutex_);
  return figures_;
}

}  // namespace mantle::tools
