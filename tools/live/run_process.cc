#include "tools/live/run_process.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstring>
#include <filesystem>

#include "tools/mantle/bad_input.h"

namespace mantle::tools {
namespace {

namespace fs = std::filesystem;

constexpr int kSignalled = 128;
constexpr int kLook_ms = 50;  // whether the run has ended

// Name of the program that a process runs; empty where it cannot be told.
std::string ProgramOf(const std::string& process) {
  std::error_code error;
  std::string name = fs::read_symlink("/proc/" + process + "/exe", error).filename().string();
  constexpr std::string_view kReplaced = " (deleted)";  // by a newer build meanwhile
  if (name.ends_with(kReplaced)) name.resize(name.size() - kReplaced.size());
  return name;
}

int StatusOf(int status) {
  return WIFEXITED(status) ? WEXITSTATUS(status) : kSignalled + WTERMSIG(status);
}

/// The process between: nothing but calls that are safe in a fork of a program with threads.
[[noreturn]] void RunAndWait(const char* program, char* const* argv, int pipe) {
  setpgid(0, 0);  // Ctrl-C on the terminal is not for the run: it gets one signal, from here
  std::signal(SIGINT, SIG_IGN);
  std::signal(SIGTERM, SIG_IGN);
  // Sockets of the server would stay open as long as the run.
  if (pipe > STDERR_FILENO + 1) close_range(STDERR_FILENO + 1, static_cast<unsigned>(pipe) - 1, 0);
  close_range(static_cast<unsigned>(pipe) + 1, ~0U, 0);
  const pid_t run = fork();
  if (run < 0) _exit(kSignalled - 1);
  if (run == 0) {
    std::signal(SIGINT, SIG_DFL);
    std::signal(SIGTERM, SIG_DFL);
    close(pipe);
    execv(program, argv);
    _exit(kSignalled - 1);
  }
  for (bool stopped = false;;) {
    int status = 0;
    const pid_t ended = waitpid(run, &status, stopped ? 0 : WNOHANG);
    if (ended == run) _exit(StatusOf(status));
    if (ended < 0 && errno != EINTR) _exit(kSignalled - 1);
    pollfd closed{pipe, POLLIN, 0};
    if (!stopped && poll(&closed, 1, kLook_ms) > 0) {
      kill(run, SIGINT);
      stopped = true;
    }
  }
}

}  // namespace

RunProcess::RunProcess(const std::vector<std::string>& arguments) {
  const std::string program = fs::read_symlink("/proc/self/exe").string();
  std::vector<std::string> words{"mantle"};
  words.insert(words.end(), arguments.begin(), arguments.end());
  std::vector<char*> argv;
  for (std::string& word : words) argv.push_back(word.data());
  argv.push_back(nullptr);
  int ends[2] = {-1, -1};
  waiter_ = pipe2(ends, O_CLOEXEC) == 0 ? fork() : -1;
  if (waiter_ == 0) RunAndWait(program.c_str(), argv.data(), ends[0]);
  const int error = errno;
  if (ends[0] >= 0) close(ends[0]);
  pipe_ = ends[1];
  if (waiter_ > 0) return;
  if (pipe_ >= 0) close(pipe_);
  throw CannotGoOn(fmt::format("no process for the run: {}", std::strerror(error)));
}

RunProcess::~RunProcess() {
  Stop();
  Wait();
}

std::optional<int> RunProcess::Collect(int flags) {
  if (status_) return status_;
  int status = 0;
  pid_t ended = 0;
  do {
    ended = waitpid(waiter_, &status, flags);
  } while (ended < 0 && errno == EINTR && flags == 0);
  if (ended == waiter_) status_ = StatusOf(status);
  return status_;
}

std::optional<int> RunProcess::Poll() { return Collect(WNOHANG); }

void RunProcess::Stop() {
  if (pipe_ >= 0) close(pipe_);
  pipe_ = -1;
}

int RunProcess::Wait() { return Collect(0).value_or(kSignalled); }

std::string CannotStop(const SessionTelemetry& session) {
  char host[256] = {};
  if (gethostname(host, sizeof host - 1) != 0 || session.host != host) {
    return fmt::format("the run is on {}, must be on this machine", session.host);
  }
  const std::string program = ProgramOf(std::to_string(session.process));
  if (session.process <= 1 || program.empty() || program != ProgramOf("self")) {
    return fmt::format("process {} is no run of this program, or another user's", session.process);
  }
  return {};
}

std::string StopSession(const SessionTelemetry& session) {
  // The descriptor stays that process's: its number may become another's meanwhile.
  const int process = static_cast<int>(syscall(SYS_pidfd_open, session.process, 0));
  if (process < 0) return fmt::format("process {}: {}", session.process, std::strerror(errno));
  std::string why = CannotStop(session);
  if (why.empty() && syscall(SYS_pidfd_send_signal, process, SIGINT, nullptr, 0) != 0) {
    why = fmt::format("process {}: {}", session.process, std::strerror(errno));
  }
  close(process);
  return why;
}

}  // namespace mantle::tools
