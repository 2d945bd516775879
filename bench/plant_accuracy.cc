// Price of accuracy of the plant: a scene run with each of the settings named, its largest distance
// from CVODE on the scene's own mesh, the CPU time and the counts.
//
//   build/bench/plant_accuracy scenes/paper.toml sdirk2:step=0.015 sdirk2:step=0.03
//   build/bench/plant_accuracy scenes/paper.toml sdirk2:tolerance=1e-3
//
// The reference is CVODE at a relative tolerance of 1e-9 and an absolute one of 1e-11, compared at
// the scene's output rows. `--reference FILE` keeps it there, and takes it from there where it
// exists.

#include <fmt/format.h>

#include <cstdio>
#include <cstring>
#include <ctime>
#include <fstream>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "loop/scene/scene.h"
#include "model/simulation.h"

namespace mantle::model {
namespace {

// Positions of root and tips at every output row, and when.
struct Row {
  double time_s;
  std::vector<Vector3> at;
};
using Path = std::vector<Row>;

constexpr double kSameTime_s = 1e-9;

double CpuTime() { return static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

Path Follow(const Plant& plant, const RunSettings& settings, RunResult* result) {
  Path path;
  Simulation simulation(plant, settings);
  *result = simulation.Run([&](const Sample& s) {
    Row row{s.time_s, {s.root.position}};
    for (const Pose& tip : s.tips) row.at.push_back(tip.position);
    path.push_back(std::move(row));
    return true;
  });
  if (!result->ok) throw std::runtime_error(result->reason);
  return path;
}

Path Reference(const Plant& plant, RunSettings settings, const std::string& file) {
  Path path;
  if (std::ifstream in(file); !file.empty() && in) {
    for (std::string line; std::getline(in, line);) {
      std::istringstream words(line);
      Row row{};
      words >> row.time_s;
      for (Vector3 p; words >> p.x() >> p.y() >> p.z();) row.at.push_back(p);
      path.push_back(std::move(row));
    }
    return path;
  }
  settings.stepper.integrator = Integrator::kCvode;
  settings.stepper.relative_tolerance = 1e-9;
  settings.stepper.absolute_tolerance = 1e-11;
  settings.account_energy = false;
  RunResult result;
  path = Follow(plant, settings, &result);
  if (!file.empty()) {
    std::ofstream out(file);
    for (const Row& row : path) {
      out << fmt::format("{:.17g} ", row.time_s);
      for (const Vector3& p : row.at)
        out << fmt::format("{:.17g} {:.17g} {:.17g} ", p.x(), p.y(), p.z());
      out << '\n';
    }
  }
  return path;
}

Integrator IntegratorOf(const std::string& name) {
  if (name == "sdirk2") return Integrator::kSdirk2;
  if (name == "sdirk3") return Integrator::kSdirk3;
  if (name == "backward_euler") return Integrator::kBackwardEuler;
  if (name == "rk4") return Integrator::kRk4;
  if (name == "cvode") return Integrator::kCvode;
  throw std::runtime_error("integrator \"" + name + "\" is not known");
}

// INTEGRATOR[:KEY=VALUE]..., keys step, tolerance, newton, output and energy.
RunSettings SettingsOf(const std::string& text, RunSettings settings) {
  std::istringstream words(text);
  std::string word;
  std::getline(words, word, ':');
  settings.stepper.integrator = IntegratorOf(word);
  while (std::getline(words, word, ':')) {
    const std::size_t at = word.find('=');
    if (at == std::string::npos) throw std::runtime_error("\"" + word + "\" is not KEY=VALUE");
    const std::string key = word.substr(0, at);
    const double value = std::stod(word.substr(at + 1));
    if (key == "step") {
      settings.step_s = value;
    } else if (key == "tolerance") {
      settings.stepper.step_tolerance = value;
    } else if (key == "output") {
      settings.output_interval_s = value;
    } else if (key == "newton") {
      settings.stepper.newton_tolerance = value;
    } else if (key == "energy") {
      settings.account_energy = value != 0.0;
    } else {
      throw std::runtime_error("key \"" + key + "\" is not known");
    }
  }
  return settings;
}

void Report(const Plant& plant, const RunSettings& base, const Path& reference,
            const std::string& text) {
  const RunSettings settings = SettingsOf(text, base);
  RunResult result;
  const double before = CpuTime();
  const Path path = Follow(plant, settings, &result);
  const double cpu_s = CpuTime() - before;
  double root = 0, tip = 0;
  std::size_t next = 0, rows = 0;
  for (const Row& row : path) {  // a run whose steps are longer than the interval has fewer rows
    while (next < reference.size() && reference[next].time_s < row.time_s - kSameTime_s) ++next;
    if (next == reference.size() || reference[next].time_s > row.time_s + kSameTime_s) continue;
    ++rows;
    root = std::max(root, (row.at[0] - reference[next].at[0]).norm());
    for (std::size_t k = 1; k < row.at.size(); ++k) {
      tip = std::max(tip, (row.at[k] - reference[next].at[k]).norm());
    }
  }
  const double length = plant.body_length_m;
  const StepCounters& c = result.counters;
  fmt::print("{:<34} {:>10.3g} {:>10.3g} {:>9.4f} {:>8.1f} {:>7} {:>5} {:>8} {:>7} {:>5}\n", text,
             root / length, tip / length, cpu_s, result.sim_time_s / cpu_s, c.steps, c.rejected,
             c.evaluations, c.factorisations, rows);
}

int Main(const std::vector<std::string>& arguments) {
  std::string file;
  std::vector<std::string> rest;
  for (std::size_t i = 0; i < arguments.size(); ++i) {
    if (arguments[i] == "--reference" && i + 1 < arguments.size()) {
      file = arguments[++i];
    } else {
      rest.push_back(arguments[i]);
    }
  }
  if (rest.size() < 2)
    throw std::runtime_error("usage: plant_accuracy SCENE INTEGRATOR:KEY=VALUE...");
  const scene::Scene scene = scene::LoadScene(rest[0]);
  const Plant plant(scene.robot);
  const Path reference = Reference(plant, scene.run, file);
  fmt::print("{:<34} {:>10} {:>10} {:>9} {:>8} {:>7} {:>5} {:>8} {:>7} {:>5}\n", "settings", "root",
             "tip", "cpu [s]", "x real", "steps", "rej.", "eval.", "factor.", "rows");
  for (std::size_t i = 1; i < rest.size(); ++i) Report(plant, scene.run, reference, rest[i]);
  return 0;
}

}  // namespace
}  // namespace mantle::model

int main(int argc, char** argv) {
  try {
    return mantle::model::Main({argv + 1, argv + argc});
  } catch (const std::exception& error) {
    fmt::print(stderr, "plant_accuracy: {}\n", error.what());
    return 2;
  }
}
