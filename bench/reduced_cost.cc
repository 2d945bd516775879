#include <cstdio>
#include <cstdlib>
#include <cstring>

#include "reduced/step.h"
#include "tests/reduced/reduced_robots.h"

/// Takes N steps of 50 ms of the reduced model and exits: what tools/effect_cost counts
/// instructions of. Usage: reduced_cost N step|jacobians [effect ...]; an effect is one of drag,
/// added_mass, viscosity, jet_thrust, weight, contained_water, lateral_added_mass, lateral_drag,
/// roll_drag, rigid_drag, all, paper. With `twin`, the robot is built as if the switched-off
/// effects had never existed (their parameters zero).

namespace {

using mantle::model::Robot;
namespace model = mantle::model;
namespace reduced = mantle::reduced;

bool Enable(const char* name, model::Effects* e) {
  const auto is = [&](const char* x) { return std::strcmp(name, x) == 0; };
  const bool all = is("all"), paper = all || is("paper");
  bool known = paper;
  const auto flag = [&](const char* x, bool in_group, bool* value) {
    if (is(x) || in_group) *value = known = true;
  };
  flag("weight", paper, &e->weight);
  flag("weight", paper, &e->buoyancy);
  flag("drag", paper, &e->drag);
  flag("added_mass", paper, &e->added_mass);
  flag("viscosity", paper, &e->viscosity);
  flag("contained_water", all, &e->contained_water);
  flag("lateral_added_mass", all, &e->lateral_added_mass);
  const auto option = [&](const char* x, bool in_group, auto* value, auto made) {
    if (is(x) || in_group) {
      *value = made;
      known = true;
    }
  };
  option("jet_thrust", paper, &e->jet_thrust, model::JetThrust{});
  option("lateral_drag", all, &e->lateral_drag, model::LateralDrag{});
  option("roll_drag", all, &e->roll_drag, model::RollDrag{});
  option("rigid_drag", all, &e->rigid_drag, model::RigidDrag{});
  return known;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 3) {
    std::fprintf(stderr, "usage: %s N step|jacobians [effect ...]\n", argv[0]);
    return 2;
  }
  Robot robot = mantle::tests::PaperRobot(20, 64);
  robot.mantle->grading = 2;
  robot.mantle->strips = {mantle::tests::PaperStrip(model::ConstantSchedule{0.0})};
  mantle::tests::AddFourCables(&robot.arms[0]);
  for (int i = 3; i < argc; ++i) {
    if (!Enable(argv[i], &robot.effects)) {
      std::fprintf(stderr, "unknown effect %s\n", argv[i]);
      return 2;
    }
  }
  reduced::Reduction reduction;
  reduction.arms[0].segments = 3;
  const reduced::ReducedModel model(robot, reduction);
  reduced::StepSettings settings;
  settings.tolerance = 1e-8;
  reduced::StepWork work(model);
  reduced::StepJacobian jacobian(model);
  model::PlantInputs inputs;
  EvaluateInputs(model.plant, 0.0, false, &inputs);
  reduced::ReducedState state = InitialState(model), end = state;
  inputs.cables[0].tension_n = 0.4;
  const bool jacobians = std::strcmp(argv[2], "jacobians") == 0;
  const int count = std::atoi(argv[1]);
  long iterations = 0;
  for (int i = 0; i < count; ++i) {
    inputs.strips_pa[0] = i % 4 < 2 ? 250.0 : 30.0;
    const reduced::StepOutcome o = TakeStep(model, settings, 0.05, state, inputs, inputs, &work,
                                            &end, jacobians ? &jacobian : nullptr);
    if (!o.ok) {
      std::fprintf(stderr, "step %d: %s: %s\n", i, o.body, o.cause);
      return 3;
    }
    iterations += o.iterations;
    state = end;
  }
  std::printf("%.3f Newton iterations per step\n", static_cast<double>(iterations) / count);
}
