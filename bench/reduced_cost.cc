#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <sstream>
#include <stdexcept>
#include <string>
#include <string_view>

#include "reduced/build/reduced_plant.h"
#include "reduced/step.h"
#include "tests/reduced/reduced_robots.h"

/// Takes N steps of 50 ms of the reduced model for every case: what bench/effect_cost.py counts
/// instructions of. Usage: reduced_cost N step|jacobians CASE ...; a case is a list of effects
/// separated by commas, each of them drag, added_mass, viscosity, jet_thrust, weight,
/// contained_water, lateral_added_mass, lateral_drag, roll_drag, rigid_drag, all; -EFFECT switches
/// one off again; `none` is no effect; with `never`, the robot is one that never had the effects
/// that are off: it lacks their parameters too.

namespace {

using mantle::model::Robot;
namespace model = mantle::model;
namespace reduced = mantle::reduced;

constexpr double kStep_s = 0.05;

// False where the name is none of an effect.
bool Switch(std::string_view name, bool on, model::Effects* e) {
  bool known = name == "all";
  const auto flag = [&](const char* x, bool* value) {
    if (name != x && name != "all") return;
    *value = on;
    known = true;
  };
  flag("weight", &e->weight);
  flag("weight", &e->buoyancy);
  flag("drag", &e->drag);
  flag("added_mass", &e->added_mass);
  flag("viscosity", &e->viscosity);
  flag("contained_water", &e->contained_water);
  flag("lateral_added_mass", &e->lateral_added_mass);
  const auto option = [&](const char* x, auto* value, auto made) {
    if (name != x && name != "all") return;
    value->reset();
    if (on) *value = made;
    known = true;
  };
  option("jet_thrust", &e->jet_thrust, model::JetThrust{});
  option("lateral_drag", &e->lateral_drag, model::LateralDrag{});
  option("roll_drag", &e->named.Get<model::RollDrag>(), model::RollDrag{});
  option("rigid_drag", &e->named.Get<model::RigidDrag>(), model::RigidDrag{});
  return known;
}

// Takes away the parameters that only switched-off effects read.
void Forget(Robot* robot) {
  const model::Effects& e = robot->effects;
  if (!e.drag) {
    robot->arms[0].drag_coefficients.setZero();
    robot->mantle->drag_coefficient = 0;
  }
  if (!e.added_mass)
    robot->arms[0].added_mass_coefficient = robot->mantle->added_mass_coefficient = 0;
  if (!e.viscosity) {
    robot->arms[0].material.viscosity_pa_s = robot->mantle->material.viscosity_pa_s = 0;
  }
  if (!e.jet_thrust) robot->mantle->nozzle_radius_m = 0;
}

Robot Built(const std::string& description) {
  Robot robot = mantle::tests::PaperRobot(12, 32);
  robot.mantle->grading = 2;
  robot.mantle->strips = {mantle::tests::PaperStrip(model::ConstantSchedule{0.0})};
  mantle::tests::AddFourCables(&robot.arms[0]);
  bool never = false;
  std::istringstream words(description);
  for (std::string word; std::getline(words, word, ',');) {
    if (word == "none") continue;
    if (word == "never") {
      never = true;
    } else if (const bool off = word.front() == '-';
               !Switch(std::string_view(word).substr(off), !off, &robot.effects)) {
      throw std::runtime_error("unknown effect " + word);
    }
  }
  if (never) Forget(&robot);
  return robot;
}

struct Cost {
  double iterations;  ///< of Newton's method, per step
  double path_m;      ///< of the root: cases that should be the same robot show the same
};

// A function of its own, so that a profile can be cut where it ends.
[[gnu::noinline]] Cost CostOf(const std::string& description, int count, bool derivatives) {
  reduced::Reduction reduction;
  reduction.arms[0].segments = 3;
  const reduced::ReducedPlant model(Built(description), reduction);
  reduced::StepSettings settings;
  settings.tolerance = 1e-8;
  reduced::StepWork work(model);
  reduced::StepJacobian jacobian(model);
  model::PlantInputs inputs;
  EvaluateInputs(model.plant, 0.0, false, &inputs);
  reduced::ReducedState state = InitialState(model), end = state;
  inputs.cables[0].tension_n = 0.4;
  long iterations = 0;
  for (int i = 0; i < count; ++i) {
    inputs.strips_pa[0] = i % 4 < 2 ? 150.0 : 30.0;
    const reduced::StepOutcome o = TakeStep(model, settings, kStep_s, state, inputs, inputs, &work,
                                            &end, derivatives ? &jacobian : nullptr);
    if (!o.ok) {
      throw std::runtime_error("step " + std::to_string(i) + ": " + o.body + ": " + o.cause);
    }
    iterations += o.iterations;
    state = end;
  }
  return {static_cast<double>(iterations) / count, state.root.position.norm()};
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 4) {
    std::fprintf(stderr, "usage: %s N step|jacobians CASE ...\n", argv[0]);
    return 2;
  }
  try {
    for (int i = 3; i < argc; ++i) {
      const Cost t = CostOf(argv[i], std::atoi(argv[1]), std::strcmp(argv[2], "step") != 0);
      std::printf("%s %.3f %.17g\n", argv[i], t.iterations, t.path_m);
    }
  } catch (const std::exception& error) {
    std::fprintf(stderr, "reduced_cost: %s\n", error.what());
    return 3;
  }
}
