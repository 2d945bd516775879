#include <benchmark/benchmark.h>
#include <time.h>

#include <algorithm>
#include <string>
#include <vector>

#include "controller/controller.h"
#include "loop/scene/scene.h"
#include "reduced/build/reduced_plant.h"

// The controller's times on one core, along closed loops with the reduced model as the plant: one
// whole MPC step (prepare and solve), the solve's share of it, and the fast loop between solves.
// The steering scene with 20 steps of 50 ms (42 states, 5 motors), with its own 40 steps (80
// unknowns), either also with Ipopt; the octopus (82 states) as it is. Counters: median, p99 and
// largest, in ms of CPU time for the step: what else the machine does is left out.

namespace mantle {
namespace {

struct Rig {
  explicit Rig(const std::string& name, const std::vector<std::string>& overrides)
      : scene(scene::LoadScene(MANTLE_SOURCE_DIR "/scenes/" + name, overrides)),
        model(scene.robot, scene.reduction),
        step{scene.reduction.scheme, 1e-6},
        reference(scene.control->goal, scene.robot),
        controller(controller::MakeMpcController({model, step, *scene.control, reference})),
        propagator(model, step),
        state(InitialState(model)),
        next(state),
        tensions(model::VectorX::Zero(model.input_count())) {
    controller->Start(state);
  }

  // One control period; returns the CPU time of the MPC step in ms.
  double Turn() {
    const double begin_ms = Cpu_ms();
    controller->Update(state.time_s, &state, tensions, 0);
    const double spent_ms = Cpu_ms() - begin_ms;
    controller->Command(state.time_s + scene.control->period_s, &state, tensions);
    propagator.Step(state, scene.control->period_s, tensions, &next, nullptr);
    next.time_s = state.time_s + scene.control->period_s;
    std::swap(state, next);
    return spent_ms;
  }
  static double Cpu_ms() {
    timespec t{};
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
    return 1e3 * static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_nsec);
  }

  scene::Scene scene;
  reduced::ReducedPlant model;
  reduced::StepSettings step;
  controller::Reference reference;
  std::unique_ptr<controller::Controller> controller;
  controller::Propagator propagator;
  reduced::ReducedState state, next;
  model::VectorX tensions;
};

using Overrides = std::vector<std::string>;
const Overrides kTwentySteps = {"control.grid.steps=20", "control.grid.step=0.05",
                                "control.grid.knots=[1,2,4,6,9,12,16,20]", "control.period=0.05"};

void MpcStep(benchmark::State& bench, const std::string& scene, Overrides overrides, bool ipopt) {
  if (ipopt) overrides.emplace_back("control.solver='ipopt'");
  Rig rig(scene, overrides);
  std::vector<double> times_ms, solves_ms;
  double iterations = 0;
  for (auto _ : bench) {
    times_ms.push_back(rig.Turn());
    solves_ms.push_back(1e3 * rig.controller->mpc()->status().solve_s);
    iterations += rig.controller->mpc()->status().iterations;
  }
  const auto quantile = [&](std::vector<double>* values, double q) {
    std::sort(values->begin(), values->end());
    return (*values)[static_cast<std::size_t>(q * static_cast<double>(values->size() - 1))];
  };
  bench.counters["median_ms"] = quantile(&times_ms, 0.5);
  bench.counters["p99_ms"] = quantile(&times_ms, 0.99);
  bench.counters["max_ms"] = quantile(&times_ms, 1.0);
  bench.counters["solve_wall_median_ms"] = quantile(&solves_ms, 0.5);
  bench.counters["iterations"] = iterations / static_cast<double>(times_ms.size());
  bench.counters["states"] = 2 * rig.model.velocity_count();
  bench.counters["unknowns"] = rig.controller->mpc()->horizon().decision_count();
}
void Register(const char* name, const char* scene, const Overrides& overrides, bool ipopt) {
  benchmark::RegisterBenchmark(name, MpcStep, scene, overrides, ipopt)
      ->Iterations(400)
      ->Unit(benchmark::kMillisecond);
}

void FastLoop(benchmark::State& bench) {
  Rig rig("steer.toml", kTwentySteps);
  for (int i = 0; i < 20; ++i) rig.Turn();
  const double t = rig.state.time_s - 0.02;
  for (auto _ : bench) {
    rig.controller->Command(t, &rig.state, rig.tensions);
    benchmark::DoNotOptimize(rig.tensions.data());
  }
}
BENCHMARK(FastLoop)->Name("fast_loop/steer");

}  // namespace
}  // namespace mantle

int main(int argc, char** argv) {
  mantle::Register("mpc_step/steer", "steer.toml", mantle::kTwentySteps, false);
  mantle::Register("mpc_step/steer/ipopt", "steer.toml", mantle::kTwentySteps, true);
  mantle::Register("mpc_step/steer_40_steps", "steer.toml", {}, false);
  mantle::Register("mpc_step/steer_40_steps/ipopt", "steer.toml", {}, true);
  mantle::Register("mpc_step/octopus", "octopus_swim.toml", {}, false);
  benchmark::Initialize(&argc, argv);
  benchmark::RunSpecifiedBenchmarks();
}
