#include <fcntl.h>
#include <fmt/format.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <map>
#include <new>
#include <sstream>

#include "loop/scene/scene.h"
#include "model/plant.h"
#include "model/rod.h"
#include "model/simulation.h"
#include "tests/support/paths.h"
#include "tests/tools/scene_mutants.h"

/// fuzz_scenes --check N --run M --seed S: mutants of the shipped scenes, N of them through what
/// `mantle check` does (in this process's children, so that a crash is caught), M through the
/// program `mantle run`. What it looks for: a crash, a hang, an exit status other than 0, 2 or 3, a
/// message of more than one line, a message that names nothing. Ends with 1 where it found one, and
/// leaves the mutant in the folder.

namespace mantle::testing_tools {
namespace {

namespace fs = std::filesystem;

constexpr int kBatch = 250;
constexpr unsigned kCheckLimit_s = 30;             // of a mutant; the largest scenes are big
constexpr int kRunLimit_s = 10, kEndLimit_s = 30;  // until it is interrupted, until it must be gone
constexpr rlim_t kMemory_bytes = rlim_t{3} << 30;

struct Options {
  int check{300}, run{6};
  std::uint64_t seed{1};
  std::string folder{"fuzz_scenes"};
};

/// What a batch's child says to its parent, in shared memory: which mutant, and what came of it.
struct Report {
  int current, ok, refused, stopped, failed;
  char message[500];
};

class Findings {
 public:
  explicit Findings(fs::path folder) : folder_(std::move(folder)) {}

  void Add(const std::string& what, int index, const std::string& text,
           const std::string& changes) {
    const fs::path file = folder_ / fmt::format("found_{}_{}.toml", kind_, index);
    std::ofstream(file, std::ios::binary) << text;
    fmt::print("FOUND {} ({}): {}\n", file.string(), changes, what);
    ++count_;
  }
  void SetKind(const char* kind) { kind_ = kind; }
  int count() const { return count_; }

 private:
  fs::path folder_;
  const char* kind_{""};
  int count_{0};
};

std::vector<std::string> ShippedScenes() {
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(tests::SourcePath("scenes"))) {
    if (entry.path().extension() == ".toml") files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  std::vector<std::string> texts;
  for (const fs::path& file : files) {
    std::ostringstream text;
    text << std::ifstream(file, std::ios::binary).rdbuf();
    texts.push_back(text.str());
  }
  return texts;
}

// What `mantle check` does, with two steps instead of 0.4 s of them. Returns the exit status.
int Check(const std::string& text, std::string* message) {
  try {
    const scene::Scene scene = scene::ParseScene(text, "mutant.toml", tests::SourcePath("scenes"));
    const model::Plant plant(scene.robot);
    if (scene.has_time) {
      model::Simulation simulation(plant, scene.run);
      for (int i = 1; i <= 2; ++i) {
        const double t = std::min(i * scene.run.step_s, scene.run.duration_s);
        if (!simulation.AdvanceTo(t).ok) return 3;
      }
      simulation.Observe();
    }
    return 0;
  } catch (const scene::BadScene& error) {
    *message = error.what();
    return 2;
  } catch (const model::BadRobot& error) {
    *message = error.what();
    return 2;
  } catch (const std::bad_alloc&) {
    return 3;
  } catch (const std::exception& error) {
    *message = error.what();
    return 1;
  }
}

void CheckBatch(const std::vector<std::string>& mutants, int begin, Report* report) {
  const rlimit memory{kMemory_bytes, kMemory_bytes};
  setrlimit(RLIMIT_AS, &memory);
  const rlimit no_core{0, 0};
  setrlimit(RLIMIT_CORE, &no_core);
  for (int i = begin; i < static_cast<int>(mutants.size()); ++i) {
    report->current = i;
    alarm(kCheckLimit_s);
    std::string message;
    const int status = Check(mutants[static_cast<std::size_t>(i)], &message);
    int* const counts[] = {&report->ok, &report->failed, &report->refused, &report->stopped};
    ++*counts[status];
    if (status == 1 || (status == 2 && message.find("mutant") == std::string::npos &&
                        message.find(": ") == std::string::npos)) {
      std::snprintf(report->message, sizeof report->message, "%s", message.c_str());
      _exit(1);
    }
  }
  _exit(0);
}

void CheckMutants(const Options& options, Findings* findings) {
  SceneMutants source(ShippedScenes(), options.seed);
  auto* report = static_cast<Report*>(
      mmap(nullptr, sizeof(Report), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0));
  for (int done = 0; done < options.check; done += kBatch) {
    std::vector<std::string> mutants, changes;
    for (int i = done; i < std::min(done + kBatch, options.check); ++i) {
      mutants.push_back(source.Next());
      changes.push_back(source.changes());
    }
    for (int begin = 0; begin < static_cast<int>(mutants.size());) {
      std::fflush(stdout);
      const pid_t child = fork();
      if (child == 0) CheckBatch(mutants, begin, report);
      int status = 0;
      waitpid(child, &status, 0);
      if (WIFEXITED(status) && WEXITSTATUS(status) == 0) break;
      const auto at = static_cast<std::size_t>(report->current);
      const std::string what =
          WIFSIGNALED(status)
              ? (WTERMSIG(status) == SIGALRM ? fmt::format("hangs for {} s", kCheckLimit_s)
                                             : fmt::format("signal {}", WTERMSIG(status)))
              : fmt::format("not refused: {}", report->message);
      findings->Add(what, done + report->current, mutants[at], changes[at]);
      begin = report->current + 1;
    }
  }
  fmt::print("check: {} mutants: {} sound, {} refused, {} could not go on; {} found\n",
             options.check, report->ok, report->refused, report->stopped, findings->count());
}

/// A process that is interrupted and, where that does not help, killed. Its status; -signal; -1000
/// where it had to be killed.
int Wait(pid_t child) {
  constexpr useconds_t kPoll_us = 5'000;
  constexpr int kPolls_s = 1'000'000 / kPoll_us;
  for (int poll = 0; poll < kEndLimit_s * kPolls_s; ++poll) {
    int status = 0;
    if (waitpid(child, &status, WNOHANG) == child) {
      return WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status);
    }
    if (poll == kRunLimit_s * kPolls_s) kill(child, SIGINT);
    usleep(kPoll_us);
  }
  kill(child, SIGKILL);
  waitpid(child, nullptr, 0);
  return -1000;
}

void RunMutants(const Options& options, Findings* findings) {
  SceneMutants source(ShippedScenes(), options.seed + 1);
  const fs::path folder = options.folder;
  std::map<int, int> statuses;
  const std::string scene = (folder / "mutant.toml").string(), out = (folder / "out").string(),
                    said = (folder / "said").string();
  for (const auto& entry : fs::directory_iterator(tests::SourcePath("scenes"))) {
    fs::copy(entry.path(), folder, fs::copy_options::overwrite_existing);  // what they extend
  }
  for (int i = 0; i < options.run; ++i) {
    const std::string text = source.Next();
    std::ofstream(scene, std::ios::binary) << text;
    // A short run; a mutant whose own [time] is wrong is refused all the same.
    const pid_t child = fork();
    if (child == 0) {
      const rlimit memory{kMemory_bytes, kMemory_bytes};
      setrlimit(RLIMIT_AS, &memory);
      const int fd = open(said.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600);
      const int nothing = open("/dev/null", O_WRONLY);
      dup2(nothing, STDOUT_FILENO);
      dup2(fd, STDERR_FILENO);
      execl(tests::BinaryPath("mantle").c_str(), "mantle", "run", scene.c_str(), "--set",
            "time.duration=0.04", "--out", out.c_str(), nullptr);
      _exit(127);
    }
    const int status = Wait(child);
    ++statuses[status];
    std::ostringstream err;
    err << std::ifstream(said, std::ios::binary).rdbuf();
    const std::string line = err.str();
    const auto lines = std::count(line.begin(), line.end(), '\n');
    std::string what;
    if (status != 0 && status != 2 && status != 3)
      what = fmt::format("status {}: {}", status, line);
    // A run that is done may warn, a line for each.
    const bool warned = status == 0 && line.starts_with("mantle: warning: ");
    if (lines != (status == 0 ? 0 : 1) && !warned) what = fmt::format("{} lines: {}", lines, line);
    if (!what.empty()) findings->Add(what, i, text, source.changes());
    const bool was = fs::exists(fs::path(out) / "summary.json");
    if (was != (status == 0))
      findings->Add("results do not fit the status", i, text, source.changes());
    fs::remove_all(out);
    fs::remove_all(out + ".partial");
  }
  fmt::print("run: {} mutants:", options.run);
  for (const auto& [status, count] : statuses) fmt::print(" {} with status {},", count, status);
  fmt::print(" {} found in all\n", findings->count());
}

int Main(int argc, char** argv) {
  Options options;
  CLI::App app{"Mutants of the shipped scenes through check and run"};
  // The last one counts: a script gives defaults before what its user adds.
  app.option_defaults()->multi_option_policy(CLI::MultiOptionPolicy::TakeLast);
  app.add_option("--check", options.check, "mutants through what `mantle check` does");
  app.add_option("--run", options.run, "mutants through `mantle run`");
  app.add_option("--seed", options.seed);
  app.add_option("--folder", options.folder, "where mutants and findings are left");
  CLI11_PARSE(app, argc, argv);
  fs::create_directories(options.folder);
  Findings findings(options.folder);
  findings.SetKind("check");
  CheckMutants(options, &findings);
  findings.SetKind("run");
  if (options.run > 0) RunMutants(options, &findings);
  return findings.count() == 0 ? 0 : 1;
}

}  // namespace
}  // namespace mantle::testing_tools

int main(int argc, char** argv) { return mantle::testing_tools::Main(argc, argv); }
