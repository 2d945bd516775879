#include <fmt/format.h>
#include <fmt/ranges.h>

#include <chrono>

#include "loop/scene/key_tables.h"
#include "loop/scene/scene_schema.h"
#include "loop/scene/toml_reader.h"
#include "model/schedule.h"
#include "tools/mantle/build_run.h"
#include "tools/mantle/control_warnings.h"
#include "tools/mantle/json_schema.h"
#include "tools/mantle/progress.h"
#include "tools/mantle/reduced_run.h"
#include "tools/mantle/scene_options.h"
#include "tools/mantle/standard_output.h"
#include "tools/mantle/static_output.h"
#include "tools/mantle/summary.h"
#include "tools/mantle/trajectory.h"

namespace mantle::tools {
namespace {

constexpr const char* kHelp =
    "Check a scene: say what is active and what it will cost. Refuses whatever `mantle run` would "
    "refuse,\ntakes a few real steps, writes nothing.\n\n"
    "  mantle check scenes/octopus.toml\n"
    "  mantle check scenes/paper.toml --set time.integrator=rk4     # says the stable step\n"
    "  mantle check scenes/steer_noise.toml --write > mine.toml     # every default spelt out\n"
    "  mantle check --json-schema > scene.schema.json               # for an editor\n\n"
    "Exit status 0: the scene is sound. 2: it is not, and why.";

// A measurement this long is good to some 10 %.
constexpr double kMeasure_s = 0.4;
constexpr int kWarmUpSteps = 2;

struct Cost {
  double us_per_step{0};
  double wall_s_per_s{0};
  double newton_per_step{0};
  std::string failure;  ///< why the steps did not succeed
};

Cost MeasureCost(const SceneOptions& options, const scene::Scene& scene,
                 const model::Plant& plant) {
  using Clock = std::chrono::steady_clock;
  const auto run = BuildFullRun(options, scene, plant);
  model::Simulation& simulation = *run;
  Cost cost;
  double t = 0;
  const auto advance = [&] {
    t = std::min(t + scene.run.step_s, scene.run.duration_s);
    const model::StepStatus status = simulation.AdvanceTo(t);
    if (!status.ok) cost.failure = status.reason;
    return status.ok && t < scene.run.duration_s;
  };
  for (int i = 0; i < kWarmUpSteps && advance(); ++i) {
  }
  const model::StepCounters before = simulation.counters();
  const double t0 = t;
  const Clock::time_point begin = Clock::now();
  double wall = 0;
  while (advance() && wall < kMeasure_s) {
    wall = std::chrono::duration<double>(Clock::now() - begin).count();
  }
  wall = std::chrono::duration<double>(Clock::now() - begin).count();
  const model::StepCounters after = simulation.counters();
  const double steps = static_cast<double>(after.steps - before.steps);
  if (steps > 0 && t > t0) {
    cost.us_per_step = 1e6 * wall / steps;
    cost.wall_s_per_s = wall / (t - t0);
    cost.newton_per_step =
        static_cast<double>(after.newton_iterations - before.newton_iterations) / steps;
  }
  return cost;
}

int Stages(model::Integrator integrator) {
  switch (integrator) {
    case model::Integrator::kSdirk2:
      return 2;
    case model::Integrator::kSdirk3:
      return 3;
    case model::Integrator::kRk4:
      return 4;
    default:
      return 1;
  }
}

Json LoadNames(const model::Plant& plant) {
  Json names = Json::array();
  for (const model::Rod& rod : plant.rods) {
    for (const auto& d : rod.distributed) names.push_back(rod.name + "." + d.name);
    for (const auto& p : rod.points) names.push_back(rod.name + "." + p.load.name);
  }
  if (plant.shell) {
    for (const auto& s : plant.shell->strips)
      names.push_back(plant.shell->name + "." + s.strip.name);
  }
  return names;
}

// Largest inward pressure on the mantle that the scene's schedules ask for over its duration, from
// a fine raster of it; cables with a given tension count, reels and motors do not.
double WorkingPressure(const scene::Scene& scene, const model::Plant& plant) {
  constexpr int kInstants = 2000;
  model::PlantInputs inputs;
  double largest = 0;
  const double duration = scene.has_time ? scene.run.duration_s : 0.0;
  const double start = scene.has_time ? 0.0 : scene.statics.time_s;
  for (int i = 0; i <= kInstants; ++i) {
    EvaluateInputs(plant, start + duration * i / kInstants, false, &inputs);
    std::vector<double> tensions;
    for (const model::CableInput& c : inputs.cables) tensions.push_back(c.tension_n);
    largest = std::max(largest, InwardPressure(plant, inputs, tensions));
  }
  return largest;
}

std::string RootName(const model::RootMotion& root) {
  if (std::holds_alternative<model::FreeRoot>(root)) return "free";
  return std::holds_alternative<model::ClampedRoot>(root) ? "clamped" : "prescribed";
}

Json CheckReport(const SceneOptions& options, const scene::Scene& scene,
                 const model::Plant& plant) {
  Json j;
  j["scene"] = scene.name;
  j["description"] = scene.description;
  j["root"] = RootName(scene.robot.root);
  j["rigid_body"] = scene.robot.rigid_body ? Json(scene.robot.rigid_body->name) : Json();
  j["loads"] = LoadNames(plant);
  j["cables"] = CableNames(plant);
  j["settings"] = SettingsSummary(scene, plant);
  j["stages"] = Stages(scene.run.stepper.integrator);
  j["explicit_step_limit_s"] = scene.run.stepper.integrator == model::Integrator::kRk4
                                   ? Json(model::ExplicitStepLimit(plant))
                                   : Json();
  j["lobed_buckling"] = Json();
  j["warnings"] = Json::array();
  if (plant.shell) {
    const model::LobedBuckling lobes = model::FindLobedBuckling(*plant.shell);
    const double working = WorkingPressure(scene, plant);
    j["lobed_buckling"] = LobedBucklingJson(model::LobedBucklingMargin{lobes, working, {}});
    j["warnings"] = model::LobedBucklingWarnings({lobes, working, {}});
  }
  if (scene.control) {
    const auto model = BuildReduced(options, scene);
    for (const std::string& warning : ControlWarnings(scene, *model)) {
      j["warnings"].push_back(warning);
    }
  }
  if (!scene.has_time) return j;
  const Cost cost = MeasureCost(options, scene, plant);
  j["us_per_step"] = cost.us_per_step;
  j["newton_iterations_per_step"] = cost.newton_per_step;
  j["estimated_wall_time_s"] = cost.wall_s_per_s * scene.run.duration_s;
  j["estimated_realtime_factor"] = cost.wall_s_per_s > 0 ? Json(1.0 / cost.wall_s_per_s) : Json();
  j["failure"] = cost.failure.empty() ? Json() : Json(cost.failure);
  return j;
}

std::string Joined(const Json& names) {
  const auto list = names.get<std::vector<std::string>>();
  return list.empty() ? "none" : fmt::format("{}", fmt::join(list, ", "));
}

void PrintReport(const Json& j, const scene::Scene& scene) {
  const Json& s = j["settings"];
  Print("{}: {}\n", j["scene"].get<std::string>(),
        scene.description.empty() ? "ok" : scene.description);
  Print("  root      {}, {} coupling\n", j["root"].get<std::string>(),
        s["coupling"].get<std::string>());
  std::vector<std::string> bodies;
  for (const auto& [name, count] : s["elements"].items()) {
    bodies.push_back(fmt::format("{} ({} elements)", name, count.get<int>()));
  }
  if (!j["rigid_body"].is_null()) bodies.push_back(j["rigid_body"].get<std::string>() + " (rigid)");
  Print("  bodies    {}\n", fmt::join(bodies, ", "));
  Print("  effects   {}\n", Joined(s["effects"]));
  Print("  loads     {}\n", Joined(j["loads"]));
  Print("  cables    {}\n", Joined(j["cables"]));
  Print("  unknowns  {}\n", s["unknowns"].get<int>());
  if (!j["lobed_buckling"].is_null()) {
    const Json& lobes = j["lobed_buckling"];
    Print("  lobes     from {:.3g} Pa (ends free) to {:.3g} Pa (ends round), works at {:.3g} Pa\n",
          lobes["ends_free_pa"].get<double>(), lobes["ends_held_pa"].get<double>(),
          lobes["working_pa"].get<double>());
  }
  for (const auto& warning : j["warnings"]) {
    Print("  warning   {}\n", warning.get<std::string>());
  }
  if (scene.has_statics) {
    Print("  statics   {}\n", scene.statics.arc_length
                                  ? "arc length"
                                  : fmt::format("{} load steps", scene.statics.load_steps));
  }
  if (!scene.has_time) return;
  Print("  time      {} s with {}, step {} s, {} stage{} a step\n", s["duration_s"].get<double>(),
        s["integrator"].get<std::string>(), s["step_s"].get<double>(), j["stages"].get<int>(),
        j["stages"].get<int>() == 1 ? "" : "s");
  if (!j["explicit_step_limit_s"].is_null()) {
    Print("  stability explicit steps up to {:.3g} s\n", j["explicit_step_limit_s"].get<double>());
  }
  if (!j["failure"].is_null()) {
    Print("  warning   a trial run stopped: {}\n", j["failure"].get<std::string>());
  }
  if (j["us_per_step"].get<double>() > 0) {
    Print(
        "  cost      {:.0f} us a step (measured, {:.1f} Newton iterations), whole run about {} "
        "({:.1f}x real time)\n",
        j["us_per_step"].get<double>(), j["newton_iterations_per_step"].get<double>(),
        ClockText(j["estimated_wall_time_s"].get<double>()),
        j["estimated_realtime_factor"].get<double>());
  }
}

struct CheckOptions {
  SceneOptions scene;
  RunChoice choice;
  bool write{false}, json_schema{false};
  std::string page;
};

int Execute(const CheckOptions& options) {
  if (options.json_schema) {
    PrintText(Dump(JsonSchema(scene::SceneCatalogue())));
    return 0;
  }
  if (!options.page.empty()) {
    const std::string page = scene::ReadTextFile(options.page);
    try {
      PrintText(scene::WithKeyTables(scene::SceneCatalogue(), page));
    } catch (const std::invalid_argument& error) {
      throw BadInput(options.page + ": " + error.what());
    }
    return 0;
  }
  if (options.scene.scene_file.empty()) {
    throw BadInput("SCENE is required (mantle check --help lists the options)");
  }
  const scene::Scene scene = options.scene.Load();
  DemandRunnable(options.scene, scene, options.choice);
  if (options.write) {
    PrintText(scene.text);
    return 0;
  }
  const model::Plant plant = BuildPlant(options.scene, scene);
  const Json report = CheckReport(options.scene, scene, plant);
  if (options.scene.json) {
    PrintText(Dump(report));
  } else {
    PrintReport(report, scene);
  }
  return 0;
}

}  // namespace

void AddCheckCommand(CLI::App& app, int& exit_status) {
  CLI::App* command = app.add_subcommand("check", kHelp);
  static CheckOptions options;  // lives as long as the parser that points to it
  AddSceneOptions(command, &options.scene);
  command->get_option("SCENE")->required(false);
  AddRunChoice(command, &options.choice);
  command->add_flag("--write", options.write,
                    "Print the scene with every default spelt out, what it extends and every --set "
                    "merged in");
  command->add_flag("--json-schema", options.json_schema,
                    "Print a JSON schema of scenes, for editors");
  command
      ->add_option("--docs", options.page,
                   "Print a page with its tables of keys written anew (docs/scene.md)")
      ->type_name("PAGE");
  command->callback([&exit_status] { exit_status = Execute(options); });
}

}  // namespace mantle::tools
