#pragma once

#include <gtest/gtest.h>
#include <sys/types.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <string>
#include <vector>

#include "firmware_sim/bus/socket_time.h"

/// For the tests that run where vcan0 exists (through tools/vcan_run) and drive real processes.

namespace mantle::firmware_sim {

/// Runs a shell command; returns what it wrote to stdout. A status other than 0 fails the test.
inline std::string Shell(const std::string& command) {
  std::string output;
  FILE* pipe = popen(command.c_str(), "r");
  if (!pipe) {
    ADD_FAILURE() << "cannot run " << command;
    return output;
  }
  char chunk[512];
  for (std::size_t size = 0; (size = fread(chunk, 1, sizeof(chunk), pipe)) > 0;) {
    output.append(chunk, size);
  }
  const int status = pclose(pipe);
  EXPECT_EQ(status, 0) << command;
  return output;
}

/// A program in a process of its own, killed at the end if it still runs.
class Process {
 public:
  /// Its output goes to `output_file` where one is named, else to ours.
  explicit Process(const std::vector<std::string>& command, const std::string& output_file = "") {
    pid_ = fork();
    if (pid_ == 0) {
      if (!output_file.empty() && !std::freopen(output_file.c_str(), "w", stdout)) _exit(126);
      std::vector<char*> arguments;
      for (const std::string& word : command) arguments.push_back(const_cast<char*>(word.c_str()));
      arguments.push_back(nullptr);
      execvp(arguments[0], arguments.data());
      _exit(127);
    }
  }
  /// A function of this program.
  explicit Process(const std::function<void()>& body) {
    pid_ = fork();
    if (pid_ == 0) {
      body();
      _exit(0);
    }
  }
  Process(const Process&) = delete;
  Process& operator=(const Process&) = delete;
  ~Process() {
    if (pid_ > 0) {
      Signal(SIGKILL);
      Wait();
    }
  }

  void Signal(int number) const {
    if (pid_ > 0) kill(pid_, number);
  }
  bool Running() {
    if (pid_ <= 0) return false;
    if (waitpid(pid_, &status_, WNOHANG) != pid_) return true;
    pid_ = 0;
    return false;
  }
  /// The exit status, or 128 + the signal that ended it.
  int Wait() {
    if (pid_ > 0) waitpid(pid_, &status_, 0);
    pid_ = 0;
    return WIFEXITED(status_) ? WEXITSTATUS(status_) : 128 + WTERMSIG(status_);
  }

 private:
  pid_t pid_{0};
  int status_{0};
};

/// Polls `done` on the wall clock, every 5 ms.
inline bool WaitUntil(const std::function<bool()>& done, std::int64_t limit_us) {
  constexpr std::int64_t kSlice_us = 5'000;
  for (const std::int64_t end_us = MonotonicTime_us() + limit_us; MonotonicTime_us() < end_us;) {
    if (done()) return true;
    SleepFor(kSlice_us);
  }
  return done();
}

inline bool HasVcan() { return access("/sys/class/net/vcan0", F_OK) == 0; }

}  // namespace mantle::firmware_sim
