#include <fmt/format.h>
#include <unistd.h>

#include <cmath>
#include <fstream>
#include <iterator>
#include <optional>
#include <regex>

#include "loop/closed_loop.h"
#include "reduced/build/reduced_plant.h"
#include "tools/mantle/bad_input.h"
#include "tools/mantle/output_file.h"
#include "tools/mantle/summary.h"
#include "tools/report/child_process.h"
#include "tools/studies/accuracy_point.h"
#include "tools/studies/effects_study.h"
#include "tools/studies/study_store.h"

// A run whose work is counted, and who counts it.

namespace mantle::tools {
namespace {

namespace fs = std::filesystem;

// Where collecting begins and ends, by model: the run without what builds it. Of the controller its
// preparation of a plan, where the model and its derivatives are evaluated.
const char* CollectedFunction(const std::string& model) {
  if (model == "reduced") return "mantle::reduced::ReducedSimulation::Run*";
  if (model == "controller") return "mantle::controller::Mpc::Prepare*";
  return "mantle::model::Simulation::Run*";
}

std::string Contents(const fs::path& file) {
  std::ifstream in(file);
  return {std::istreambuf_iterator<char>(in), {}};
}

// A folder that goes with this process.
class ScratchFolder {
 public:
  ScratchFolder()
      : folder_(fs::temp_directory_path() / fmt::format("mantle-effects-{}", getpid())) {
    fs::create_directories(folder_);
  }
  ~ScratchFolder() {
    std::error_code error;
    fs::remove_all(folder_, error);
  }
  ScratchFolder(const ScratchFolder&) = delete;
  ScratchFolder& operator=(const ScratchFolder&) = delete;
  const fs::path& path() const { return folder_; }

 private:
  fs::path folder_;
};

// Runs the workload as a child under the counter; its work, and its row in `row`.
double Count(const StudyPoint& workload, const std::string& model, const std::string& counter,
             Json* row) {
  const ScratchFolder scratch;
  StudyStore store(scratch.path());
  const std::string key = "workload";
  store.Put(workload, key);
  const std::string self = fs::read_symlink("/proc/self/exe").string();
  const fs::path profile = scratch.path() / "profile", log = scratch.path() / "said";
  std::vector<std::string> words;
  fs::path program = self;
  if (counter == "callgrind") {
    program = FindProgram({"valgrind"});
    words = {"--tool=callgrind", "--callgrind-out-file=" + profile.string(),
             std::string("--toggle-collect=") + CollectedFunction(model), self};
  } else if (counter == "perf") {
    program = FindProgram({"perf"});
    words = {"stat", "-x", ",", "-e", "instructions:u", "-o", profile.string(), self};
  }
  for (const std::string& word :
       {std::string("study"), std::string("point"), scratch.path().string(), key}) {
    words.push_back(word);
  }
  ChildProcess child(program, words, {}, {}, log);
  const int status = child.Wait();
  const auto result = store.Row(key);
  if (status != 0 || !result) {
    throw BadInput(
        fmt::format("under {}: exit status {}: {}", counter, status, Contents(log).substr(0, 400)));
  }
  *row = *result;
  const std::string text = Contents(profile);
  std::smatch match;
  if (counter == "callgrind" && std::regex_search(text, match, std::regex("\ntotals: (\\d+)"))) {
    return std::stod(match[1]);
  }
  if (counter == "perf" && std::regex_search(text, match, std::regex("(\\d+),,instructions"))) {
    return std::stod(match[1]);
  }
  if (counter == "time") return result->value("cpu_s", NAN);
  throw BadInput(fmt::format("{} left no count of instructions", counter));
}

}  // namespace

Json RunWorkloadPoint(const StudyPoint& point) {
  const scene::Scene scene = scene::LoadScene(point.scene, point.overrides);
  const std::string model = point.options.value("model", "plant");
  Json row = RowOf(point);
  if (model == "controller") {
    loop::ClosedLoop loop(scene, {});
    const double begin = CpuSeconds();
    const loop::LoopResult result = loop.Run();
    row["cpu_s"] = CpuSeconds() - begin;
    row["state"] = 2 * loop.reduced().velocity_count();
    row["ok"] = result.ok;
    row["reason"] = result.reason;
    return row;
  }
  const MeasuredRun run = RunMeasured(scene, model == "reduced");
  row["cpu_s"] = run.cpu_s;
  row["state"] = 2 * run.unknowns;
  row["steps"] = run.counters.steps;
  row["ok"] = run.ok;
  row["reason"] = run.reason;
  return row;
}

Json RunEffectsPoint(const StudyPoint& point) {
  const std::string model = point.options.at("model"), counter = point.options.at("counter");
  StudyPoint workload = point;
  workload.kind = "workload";
  workload.options = {{"model", model}};
  workload.overrides.push_back(
      fmt::format("time.duration={}", point.options.at("count_s").get<double>()));
  Json row = RowOf(point), counted;
  row["counter"] = counter;
  row["work"] = Count(workload, model, counter, &counted);
  for (const char* key : {"state", "steps", "cpu_s"}) {
    if (counted.contains(key)) row[key] = counted[key];
  }
  row["ok"] = counted["ok"];
  row["reason"] = counted["reason"];
  if (!point.options.contains("reference")) return row;
  // The whole run, against that with the effect.
  const fs::path file = ReferenceFile(PointFromJson(point.options["reference"]));
  if (!fs::exists(file)) return row;
  const StudyPath reference = ReadStudyPath(file);
  const MeasuredRun run =
      RunMeasured(scene::LoadScene(point.scene, point.overrides), model == "reduced");
  if (!run.ok) {
    row["changes_reason"] = fmt::format("t = {:.6g} s: {}", run.sim_time_s, run.reason);
    return row;
  }
  const PathErrors errors = ComparePaths(run.path, reference);
  row["error"] = Headline(errors, reference);
  row["errors"] = ErrorsJson(errors, reference);
  return row;
}

}  // namespace mantle::tools
