#include <benchmark/benchmark.h>

#include "reduced/step.h"
#include "tests/reduced/reduced_robots.h"

/// Step of 50 ms of the reduced model: mantle with three coordinates and one arm with three
/// segments of four strains (21 velocities), alone and with all Jacobians.

namespace mantle::reduced {
namespace {

constexpr double kStep_s = 0.05;

enum class Effects { kPaper, kControl };

model::Robot BenchRobot(Effects which) {
  model::Robot robot = tests::PaperRobot(20, 64);
  robot.mantle->grading = 2;
  robot.mantle->strips = {tests::PaperStrip(model::ConstantSchedule{0.0})};
  tests::AddFourCables(&robot.arms[0]);
  model::Effects& e = robot.effects;
  e.weight = e.buoyancy = e.drag = e.added_mass = e.viscosity = true;
  e.jet_thrust = model::JetThrust{};
  if (which == Effects::kControl) {
    e.contained_water = e.lateral_added_mass = true;
    e.jet_thrust->flux = model::FluxReading::kRadial;
    e.lateral_drag = model::LateralDrag{};
    e.roll_drag = model::RollDrag{};
    e.rigid_drag = model::RigidDrag{};
  }
  return robot;
}

struct Setup {
  explicit Setup(Effects which)
      : model(BenchRobot(which), MakeReduction()), work(model), jacobian(model) {
    EvaluateInputs(model.plant, 0.0, false, &inputs);
    state = InitialState(model);
    end = state;
    inputs.cables[0].tension_n = 0.4;
    inputs.strips_pa[0] = 200.0;
    for (int i = 0; i < 8; ++i) {  // into a swimming, bent state
      inputs.strips_pa[0] = i % 4 < 2 ? 250.0 : 30.0;
      TakeStep(model, settings, kStep_s, state, inputs, inputs, &work, &end, nullptr);
      state = end;
    }
  }
  static Reduction MakeReduction() {
    Reduction r;
    r.arms[0].segments = 3;
    return r;
  }

  ReducedModel model;
  StepSettings settings;
  StepWork work;
  StepJacobian jacobian;
  model::PlantInputs inputs;
  ReducedState state, end;
};

template <Effects which, bool derivatives>
void Step(benchmark::State& bench) {
  Setup s(which);
  s.settings.tolerance = 1e-8;
  int iterations = 0;
  for (auto _ : bench) {
    const StepOutcome o = TakeStep(s.model, s.settings, kStep_s, s.state, s.inputs, s.inputs,
                                   &s.work, &s.end, derivatives ? &s.jacobian : nullptr);
    if (!o.ok) bench.SkipWithError(o.cause);
    iterations = o.iterations;
    benchmark::DoNotOptimize(s.end.q.data());
  }
  bench.counters["newton"] = iterations;
  bench.counters["elements"] = static_cast<double>(s.model.mantle->elements.size());
}
BENCHMARK(Step<Effects::kPaper, false>)->Name("step/paper")->Unit(benchmark::kMicrosecond);
BENCHMARK(Step<Effects::kPaper, true>)->Name("step_jacobians/paper")->Unit(benchmark::kMicrosecond);
BENCHMARK(Step<Effects::kControl, false>)->Name("step/control")->Unit(benchmark::kMicrosecond);
BENCHMARK(Step<Effects::kControl, true>)
    ->Name("step_jacobians/control")
    ->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace mantle::reduced
