#include "tools/studies/study_engine.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sched.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstring>
#include <set>
#include <thread>

#include "tools/mantle/bad_input.h"

namespace mantle::tools {
namespace {

constexpr auto kLook = std::chrono::milliseconds(2);
constexpr int kNotStarted = 127;

std::vector<int> CoresOfThisProcess() {
  cpu_set_t set;
  CPU_ZERO(&set);
  std::vector<int> cores;
  if (sched_getaffinity(0, sizeof set, &set) == 0) {
    for (int core = 0; core < CPU_SETSIZE; ++core) {
      if (CPU_ISSET(core, &set)) cores.push_back(core);
    }
  }
  return cores.empty() ? std::vector<int>{0} : cores;
}

struct Child {
  pid_t process{0};
  std::size_t point{0};
  int core{-1};
};

std::string ReasonOf(int status, double limit_s, const std::string& words) {
  const std::string said = words.empty() ? "" : ": " + words;
  if (WIFSIGNALED(status)) {
    const int signal = WTERMSIG(status);
    if (signal == SIGXCPU || signal == SIGKILL) {
      return fmt::format("took more than {} s of CPU time, the bound of a point (--limit){}",
                         limit_s, said);
    }
    return fmt::format("ended by signal {} ({}){}", signal, strsignal(signal), said);
  }
  return fmt::format("ended with exit status {}{}", WEXITSTATUS(status), said);
}

class LocalEngine : public StudyEngine {
 public:
  explicit LocalEngine(const EngineOptions& options)
      : options_(options), cores_(CoresOfThisProcess()) {
    if (options_.jobs <= 0) options_.jobs = static_cast<int>(cores_.size());
  }

  bool Run(const std::vector<std::string>& keys, StudyStore* store, const StudyProgress& progress,
           std::vector<std::string>* reasons) override {
    reasons->assign(keys.size(), "");
    std::vector<Child> running;
    std::vector<int> free_cores(cores_.rbegin(), cores_.rend());
    std::size_t next = 0, done = 0;
    bool go = true;
    while (done < keys.size()) {
      go = go && progress(static_cast<int>(done), static_cast<int>(keys.size()));
      if (!go) break;
      while (next < keys.size() && static_cast<int>(running.size()) < options_.jobs) {
        int core = -1;
        if (!free_cores.empty()) {
          core = free_cores.back();
          free_cores.pop_back();
        }
        running.push_back({Start(store, keys[next], core), next, core});
        ++next;
      }
      std::erase_if(running, [&](const Child& child) {
        int status = 0;
        if (waitpid(child.process, &status, WNOHANG) != child.process) return false;
        if (child.core >= 0) free_cores.push_back(child.core);
        if (status != 0) {
          (*reasons)[child.point] =
              ReasonOf(status, options_.limit_s, store->LastWords(keys[child.point]));
        }
        ++done;
        return true;
      });
      std::this_thread::sleep_for(kLook);
    }
    for (const Child& child : running) kill(child.process, SIGTERM);
    for (const Child& child : running) {
      while (waitpid(child.process, nullptr, 0) < 0 && errno == EINTR) {
      }
    }
    return go;
  }

 private:
  pid_t Start(StudyStore* store, const std::string& key, int core) const {
    const std::string folder = store->folder().string(), log = store->Log(key).string();
    char program[] = "mantle", study[] = "study", point[] = "point";
    std::string words[] = {folder, key};
    char* argv[] = {program, study, point, words[0].data(), words[1].data(), nullptr};
    const auto limit = static_cast<rlim_t>(std::ceil(options_.limit_s));
    const pid_t parent = getpid();
    const pid_t child = fork();
    if (child < 0) throw CannotGoOn(fmt::format("no process: {}", std::strerror(errno)));
    if (child > 0) return child;
    setpgid(0, 0);  // Ctrl-C is for this study alone, which stops its points
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    if (getppid() != parent) _exit(kNotStarted);
    std::signal(SIGINT, SIG_DFL);
    std::signal(SIGTERM, SIG_DFL);
    if (core >= 0) {
      cpu_set_t set;
      CPU_ZERO(&set);
      CPU_SET(core, &set);
      sched_setaffinity(0, sizeof set, &set);
    }
    const rlimit bound{limit, limit + 1};
    setrlimit(RLIMIT_CPU, &bound);
    const rlimit no_core{0, 0};
    setrlimit(RLIMIT_CORE, &no_core);
    const int out = open(log.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600);
    const int nothing = open("/dev/null", O_RDONLY);
    dup2(nothing, STDIN_FILENO);
    dup2(out, STDOUT_FILENO);
    dup2(out, STDERR_FILENO);
    execv("/proc/self/exe", argv);
    _exit(kNotStarted);
  }

  EngineOptions options_;
  std::vector<int> cores_;
};

}  // namespace

std::unique_ptr<StudyEngine> MakeLocalEngine(const EngineOptions& options) {
  return std::make_unique<LocalEngine>(options);
}

std::vector<Json> RunPoints(const std::vector<StudyPoint>& points, StudyEngine* engine,
                            StudyStore* store, const StudyProgress& progress, bool* stopped) {
  std::vector<std::string> keys, missing;
  std::set<std::string> wanted;
  for (const StudyPoint& point : points) {
    keys.push_back(point.Key());
    if (store->Row(keys.back()) || !wanted.insert(keys.back()).second) continue;
    store->Put(point, keys.back());
    missing.push_back(keys.back());
  }
  std::vector<std::string> reasons;
  *stopped = !engine->Run(missing, store, progress, &reasons);
  std::vector<Json> rows;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (auto row = store->Row(keys[i])) {
      rows.push_back(std::move(*row));
      continue;
    }
    if (*stopped) continue;
    const auto at = std::find(missing.begin(), missing.end(), keys[i]) - missing.begin();
    rows.push_back(FailedRow(points[i], reasons[at].empty() ? "left no row" : reasons[at]));
  }
  return rows;
}

}  // namespace mantle::tools
