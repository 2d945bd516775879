#include "tools/live/run_process.h"

#include <fmt/format.h>
#include <sys/prctl.h>
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

// Name of the program that a process runs; empty where it cannot be told.
std::string ProgramOf(const std::string& process) {
  std::error_code error;
  std::string name = fs::read_symlink("/proc/" + process + "/exe", error).filename().string();
  constexpr std::string_view kReplaced = " (deleted)";  // by a newer build meanwhile
  if (name.ends_with(kReplaced)) name.resize(name.size() - kReplaced.size());
  return name;
}

}  // namespace

RunProcess::RunProcess(const std::vector<std::string>& arguments) {
  const std::string program = fs::read_symlink("/proc/self/exe").string();
  std::vector<std::string> words{"mantle"};
  words.insert(words.end(), arguments.begin(), arguments.end());
  std::vector<char*> argv;
  for (std::string& word : words) argv.push_back(word.data());
  argv.push_back(nullptr);
  const pid_t parent = getpid();
  process_ = fork();
  if (process_ < 0) {
    throw CannotGoOn(fmt::format("no process for the run: {}", std::strerror(errno)));
  }
  if (process_ > 0) return;
  // The child: nothing but calls that are safe between fork and exec. A group of its own, so that
  // Ctrl-C on the terminal reaches it once, by Stop.
  setpgid(0, 0);
  std::signal(SIGINT, SIG_DFL);
  std::signal(SIGTERM, SIG_DFL);
  prctl(PR_SET_PDEATHSIG, SIGTERM);
  if (getppid() != parent) _exit(kSignalled);  // it has ended already
  execv(program.c_str(), argv.data());
  _exit(kSignalled - 1);
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
    ended = waitpid(process_, &status, flags);
  } while (ended < 0 && errno == EINTR && flags == 0);
  if (ended != process_) return std::nullopt;
  status_ = WIFEXITED(status) ? WEXITSTATUS(status) : kSignalled + WTERMSIG(status);
  return status_;
}

std::optional<int> RunProcess::Poll() { return Collect(WNOHANG); }

void RunProcess::Stop() {
  if (stopped_ || Poll()) return;
  stopped_ = true;
  kill(process_, SIGINT);
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
