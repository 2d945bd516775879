#include <benchmark/benchmark.h>

#include "reduced/build/reduced_plant.h"
#include "reduced/step.h"
#include "tests/reduced/reduced_robots.h"

/// Step of 50 ms of the reduced model: mantle with three coordinates and one arm with three
/// segments of four strains (21 velocities), alone, with all Jacobians, and with all Jacobians
/// where a plan is linearised again.

namespace mantle::reduced {
namespace {

constexpr double kStep_s = 0.05;
// Fit for control: microns and microradians; one more Newton step follows where derivatives are
// asked for.
constexpr double kTolerance = 1e-6;

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
    e.named.Set(model::RollDrag{});
    e.named.Set(model::RigidDrag{});
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

  ReducedPlant model;
  StepSettings settings;
  StepWork work;
  StepJacobian jacobian;
  model::PlantInputs inputs;
  ReducedState state, end;
};

enum class Task {
  kStep,
  kJacobians,
  kRelinearise  ///< jacobians, starting at the stages of the same step from a nearby state
};

// Rates differ by this share, tensions by this much, between the two states of kRelinearise.
constexpr double kOtherRate = 0.02, kOtherTension_n = 0.02, kOtherPressure_pa = 10.0;

void Step(benchmark::State& bench, Effects which, Task task, StepScheme scheme,
          double pressure_pa) {
  Setup s(which);
  s.settings.scheme = scheme;
  s.settings.tolerance = kTolerance;
  s.inputs.strips_pa[0] = pressure_pa;
  StepStages stages(s.model);
  ReducedState states[2] = {s.state, s.state};
  model::PlantInputs inputs[2] = {s.inputs, s.inputs};
  if (task == Task::kRelinearise) {
    states[1].v *= 1.0 + kOtherRate;
    inputs[1].cables[0].tension_n += kOtherTension_n;
    inputs[1].strips_pa[0] += kOtherPressure_pa;
  }
  int i = 0;
  long iterations = 0;
  for (auto _ : bench) {
    const StepOutcome o = TakeStep(s.model, s.settings, kStep_s, states[i], inputs[i], inputs[i],
                                   &s.work, &s.end, task == Task::kStep ? nullptr : &s.jacobian,
                                   task == Task::kRelinearise ? &stages : nullptr);
    if (!o.ok) bench.SkipWithError(o.cause);
    i = 1 - i;
    iterations += o.iterations;
    benchmark::DoNotOptimize(s.end.q.data());
  }
  bench.counters["newton"] =
      benchmark::Counter(static_cast<double>(iterations), benchmark::Counter::kAvgIterations);
  bench.counters["elements"] = static_cast<double>(s.model.mantle->elements.size());
}

// The mantle's pressure before the step is kRest_pa; the step goes on with it, or starts a pulse.
constexpr double kRest_pa = 30.0, kPulse_pa = 250.0;

const bool registered = [] {
  const auto add = [](const std::string& name, auto... arguments) {
    benchmark::RegisterBenchmark(name.c_str(), Step, arguments...)->Unit(benchmark::kMicrosecond);
  };
  const auto tasks = [&](const std::string& name, Effects which, StepScheme scheme, double p) {
    add("step/" + name, which, Task::kStep, scheme, p);
    add("step_jacobians/" + name, which, Task::kJacobians, scheme, p);
    add("relinearise/" + name, which, Task::kRelinearise, scheme, p);
  };
  tasks("paper", Effects::kPaper, StepScheme::kSdirk2, kRest_pa);
  tasks("control", Effects::kControl, StepScheme::kSdirk2, kRest_pa);
  tasks("control/pulse", Effects::kControl, StepScheme::kSdirk2, kPulse_pa);
  tasks("control/backward_euler", Effects::kControl, StepScheme::kBackwardEuler, kRest_pa);
  tasks("control/backward_euler/pulse", Effects::kControl, StepScheme::kBackwardEuler, kPulse_pa);
  return true;
}();

}  // namespace
}  // namespace mantle::reduced
