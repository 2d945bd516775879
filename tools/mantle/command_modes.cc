#include <fmt/format.h>

#include <cstdio>
#include <iterator>

#include "mantle/version.h"
#include "model/buckling.h"
#include "model/motion_modes.h"
#include "model/static_problem.h"
#include "model/statics.h"
#include "tools/mantle/output_folder.h"
#include "tools/mantle/scene_options.h"
#include "tools/mantle/standard_output.h"
#include "tools/mantle/summary.h"

namespace mantle::tools {
namespace {

constexpr const char* kHelp =
    "Linearised motions about the reference shape or an equilibrium.\nFrequencies, damping, growth "
    "rates and shapes, with the water's added mass and "
    "every load. With --buckling also the load factors at which the reference\nshape buckles.\n"
    "Writes summary.json and shapes.csv (docs/outputs.md).\n\n"
    "  mantle modes scenes/arm_vibration.toml\n"
    "  mantle modes scenes/arm_static.toml --about static --count 6\n"
    "  mantle modes scenes/arm_static.toml --buckling 3\n\n"
    "Exit status 0: found. 2: bad input, nothing changed. 3: no equilibrium, or no convergence.";

struct ModesOptions {
  SceneOptions scene;
  std::string about{"reference"};
  int count{8};
  int buckling{0};
};

// Where the robot rests and under what.
struct Rest {
  model::PlantState state;
  model::PlantInputs inputs;
  double load_factor{0};
};

Rest AtReference(const model::Plant& plant, double time_s) {
  Rest rest;
  if (!plant.root_free()) {
    const model::StaticProblem problem(plant, time_s);
    model::StaticState state = problem.Reference();
    model::PlantWork work(plant);
    problem.Evaluate(0.0, &state, &rest.inputs, &work);
    rest.state = state;
    return rest;
  }
  rest.state = model::InitialState(plant);  // of a free robot: adrift with the water
  rest.state.velocity.setZero();
  EvaluateInputs(plant, time_s, false, &rest.inputs);
  model::ScaleLoads(plant, 0.0, &rest.inputs);
  return rest;
}

Json ModeJson(const model::MotionMode& mode, int number) {
  return {{"mode", number},
          {"frequency_hz", mode.frequency_hz()},
          {"damping_ratio", mode.damping_ratio()},
          {"growth_rate_1_s", mode.rate_1_s.real()},
          {"angular_frequency_rad_s", mode.rate_1_s.imag()},
          {"unstable", mode.unstable()}};
}

// Displacements of every node, in the frame of its section at rest for arms (the last three columns
// its rotation), in the root's meridian plane (r, z, theta) for the mantle.
std::string ShapesCsv(const model::Plant& plant, const std::vector<model::MotionMode>& modes) {
  std::string text =
      "mode,body,node,arc_length_m,x_re,y_re,z_re,x_im,y_im,z_im,rx_re,ry_re,rz_re,rx_im,ry_im,"
      "rz_im\n";
  const auto row = [&](std::size_t mode, const std::string& body, int node, double x_m,
                       const Eigen::Vector3cd& move, const Eigen::Vector3cd& turn) {
    fmt::format_to(std::back_inserter(text), "{},{},{},{}", mode + 1, body, node, x_m);
    for (const Eigen::Vector3cd& v : {move, turn}) {
      const model::Vector3 re = v.real(), im = v.imag();
      fmt::format_to(std::back_inserter(text), ",{},{},{},{},{},{}", re(0), re(1), re(2), im(0),
                     im(1), im(2));
    }
    text += '\n';
  };
  for (std::size_t k = 0; k < modes.size(); ++k) {
    for (std::size_t a = 0; a < plant.rods.size(); ++a) {
      const model::Rod& rod = plant.rods[a];
      for (int i = 1; i <= rod.element_count(); ++i) {
        const int at = plant.ArmVelocity(static_cast<int>(a), i);
        row(k, rod.name, i, rod.x_m[i], modes[k].shape.segment<3>(at + 3),
            modes[k].shape.segment<3>(at));
      }
    }
    for (int j = 0; j < plant.shape_count(); ++j) {
      const Eigen::Vector3cd q = modes[k].shape.segment<3>(plant.ShellVelocity(j));
      row(k, plant.shell->name, j, plant.shell->nodes[j].x_m, {q(0), 0.0, q(1)}, {0.0, q(2), 0.0});
    }
  }
  return text;
}

void PrintTable(const Json& j, const std::filesystem::path& folder) {
  Print("{}: motions about {}, load factor {:.6g}\n", j["scene"].get<std::string>(),
        j["about"] == "static" ? "the equilibrium" : "the reference shape",
        j["load_factor"].get<double>());
  Print("  mode  frequency      damping ratio  real part\n");
  for (const auto& mode : j["modes"]) {
    Print("  {:4}  {:11.6g} Hz {:12.4g}   {:11.4g} 1/s{}\n", mode["mode"].get<int>(),
          mode["frequency_hz"].get<double>(), mode["damping_ratio"].get<double>(),
          mode["growth_rate_1_s"].get<double>(), mode["unstable"] == true ? "  grows" : "");
  }
  for (const auto& load : j["buckling_load_factors"]) {
    Print("  buckles at load factor {:.6g}\n", load.get<double>());
  }
  if (j["buckling_load_factors"].is_array() && j["buckling_load_factors"].empty()) {
    Print("  no load buckles it below load factor {:.0e}\n", model::kLargestFactor);
  }
  Print("  results in {}\n", folder.string());
}

int FindModes(const ModesOptions& options) {
  const scene::Scene scene = options.scene.Load();
  const model::Plant plant = BuildPlant(options.scene, scene);
  Rest rest;
  std::string failure;
  if (options.about == "static") {
    const model::StaticsResult result =
        InScene(options.scene, [&] { return model::SolveStatics(plant, scene.statics); });
    if (!result.ok) failure = result.reason;
    const model::StaticProblem problem(plant, scene.statics.time_s);
    problem.Scale(result.load_factor, &rest.inputs);
    rest.state = result.state;
    rest.load_factor = result.load_factor;
  } else {
    rest = AtReference(plant, scene.statics.time_s);
  }
  std::vector<model::MotionMode> modes;
  if (failure.empty()) {
    try {
      modes = model::MotionModes(plant, rest.state, rest.inputs, options.count);
    } catch (const std::runtime_error& error) {
      failure = error.what();
    }
  }
  model::BucklingResult buckling;
  if (failure.empty() && options.buckling > 0) {
    buckling = InScene(options.scene, [&] {
      return model::FindBucklingLoads(plant, scene.statics.time_s, options.buckling);
    });
    if (!buckling.ok) failure = "buckling: " + buckling.reason;
  }
  if (!failure.empty()) {
    Complain("{}: {}", scene.name, failure);
    return kExitCannotContinue;
  }
  Json j;
  j["scene"] = scene.name;
  j["mantle_version"] = kVersion;
  j["about"] = options.about;
  j["load_factor"] = rest.load_factor;
  j["modes"] = Json::array();
  for (std::size_t k = 0; k < modes.size(); ++k) {
    j["modes"].push_back(ModeJson(modes[k], static_cast<int>(k) + 1));
  }
  j["buckling_load_factors"] = Json();
  if (options.buckling > 0) {
    j["buckling_load_factors"] = Json::array();
    for (const auto& load : buckling.loads) j["buckling_load_factors"].push_back(load.load_factor);
  }
  j["effects"] = EffectNames(plant.robot.effects);
  j["overrides"] = options.scene.overrides;
  ResultFolder folder(options.scene.OutputFolder(scene), kSceneResults);
  WriteWhole(folder.partial(), "shapes.csv", ShapesCsv(plant, modes));
  WriteWhole(folder.partial(), "summary.json", Dump(j));
  folder.Publish();
  if (options.scene.json) {
    PrintText(Dump(j));
  } else {
    PrintTable(j, folder.folder());
  }
  return 0;
}

}  // namespace

void AddModesCommand(CLI::App& app, int& exit_status) {
  CLI::App* command = app.add_subcommand("modes", kHelp);
  static ModesOptions options;  // lives as long as the parser that points to it
  AddSceneOptions(command, &options.scene);
  AddOutOption(command, &options.scene);
  command->add_option("--about", options.about, "reference (default) or static")
      ->check(CLI::IsMember({"reference", "static"}));
  command->add_option("--count", options.count, "how many, those nearest to zero first")
      ->check(CLI::Range(1, 60));
  command
      ->add_option("--buckling", options.buckling,
                   "how many load factors of buckling, those nearest to zero first")
      ->check(CLI::Range(1, 20));
  command->callback([&exit_status] { exit_status = FindModes(options); });
}

}  // namespace mantle::tools
