#include <benchmark/benchmark.h>

#include <algorithm>
#include <vector>

#include "controller/controller.h"
#include "loop/scene/scene.h"
#include "reduced/build/reduced_plant.h"

// The controller's times on one core, for the steering scene with 20 steps of 50 ms (42 states, 5
// motors): one whole MPC step (prepare and solve) along a closed loop with the reduced model as the
// plant, and the fast loop between solves. Counters: median, p99 and largest step in ms.

namespace mantle {
namespace {

struct Rig {
  Rig()
      : scene(scene::LoadScene(MANTLE_SOURCE_DIR "/scenes/steer.toml",
                               {"control.grid.steps=20", "control.grid.step=0.05",
                                "control.grid.knots=[1,2,4,6,9,12,16,20]", "control.period=0.05"})),
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

  // One control period; returns the time of the MPC step in ms.
  double Turn() {
    controller->Update(state.time_s, &state, tensions, 0);
    const controller::MpcStatus& status = controller->mpc()->status();
    controller->Command(state.time_s + scene.control->period_s, &state, tensions);
    propagator.Step(state, scene.control->period_s, tensions, &next, nullptr);
    next.time_s = state.time_s + scene.control->period_s;
    std::swap(state, next);
    return 1e3 * (status.prepare_s + status.solve_s);
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

void MpcStep(benchmark::State& bench) {
  Rig rig;
  std::vector<double> times_ms;
  double iterations = 0;
  for (auto _ : bench) {
    times_ms.push_back(rig.Turn());
    iterations += rig.controller->mpc()->status().iterations;
  }
  std::sort(times_ms.begin(), times_ms.end());
  const auto quantile = [&](double q) {
    return times_ms[static_cast<std::size_t>(q * static_cast<double>(times_ms.size() - 1))];
  };
  bench.counters["median_ms"] = quantile(0.5);
  bench.counters["p99_ms"] = quantile(0.99);
  bench.counters["max_ms"] = quantile(1.0);
  bench.counters["ipopt_iterations"] = iterations / static_cast<double>(times_ms.size());
  bench.counters["states"] = 2 * rig.model.velocity_count();
}
BENCHMARK(MpcStep)->Name("mpc_step/steer")->Iterations(400)->Unit(benchmark::kMillisecond);

void FastLoop(benchmark::State& bench) {
  Rig rig;
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

BENCHMARK_MAIN();
