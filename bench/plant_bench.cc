// Speed of the plant (Google Benchmark): time per simulated second of scenes, cost against the
// number of nodes and arms, and the memory of a state.

#include <benchmark/benchmark.h>

#include <cmath>
#include <numbers>

#include "loop/scene/scene.h"
#include "model/simulation.h"

namespace mantle::model {
namespace {

scene::Scene Load(const char* name) {
  return scene::LoadScene(std::string(MANTLE_SOURCE_DIR) + "/scenes/" + name);
}

// A whole run of a scene; the counter is simulated over wall time.
void RunScene(benchmark::State& state, const char* name) {
  const scene::Scene scene = Load(name);
  const Plant plant(scene.robot);
  double simulated = 0;
  for (auto _ : state) {
    Simulation simulation(plant, scene.run);
    const RunResult result = simulation.Run();
    if (!result.ok) state.SkipWithError(result.reason.c_str());
    simulated += result.sim_time_s;
  }
  state.counters["realtime_factor"] = benchmark::Counter(simulated, benchmark::Counter::kIsRate);
}
BENCHMARK_CAPTURE(RunScene, paper, "paper.toml")->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK_CAPTURE(RunScene, mantle_swim, "mantle_swim.toml")
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();
BENCHMARK_CAPTURE(RunScene, speed_rod, "speed_rod.toml")
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();

Arm SwingingArm(int elements) {
  Arm arm = Load("paper.toml").robot.arms.at(0);
  arm.elements = elements;
  arm.distributed.clear();
  arm.points.clear();
  arm.initial_mode1_tip_speed_m_s = 0;
  arm.initial_twist << 0, 0, 0.5, 0, 0, 0;
  return arm;
}

RunSettings ShortRun() {
  RunSettings run;
  run.duration_s = 0.2;
  run.step_s = 0.01;
  run.output_interval_s = 0.2;
  return run;
}

void Simulate(benchmark::State& state, const Robot& robot) {
  const Plant plant(robot);
  for (auto _ : state) {
    Simulation simulation(plant, ShortRun());
    benchmark::DoNotOptimize(simulation.AdvanceTo(0.2));
  }
}

// One arm of N elements: time must grow linearly.
void ArmElements(benchmark::State& state) {
  Robot robot = Load("paper.toml").robot;
  robot.mantle.reset();
  robot.effects.jet_thrust.reset();
  robot.arms = {SwingingArm(static_cast<int>(state.range(0)))};
  Simulate(state, robot);
  state.SetComplexityN(state.range(0));
}
BENCHMARK(ArmElements)
    ->RangeMultiplier(2)
    ->Range(32, 2048)
    ->Unit(benchmark::kMillisecond)
    ->Complexity();

// k arms around the root: at most 8.5 times one for eight.
void Arms(benchmark::State& state) {
  Robot robot = Load("paper.toml").robot;
  robot.mantle.reset();
  robot.effects.jet_thrust.reset();
  robot.arms.clear();
  for (int k = 0; k < state.range(0); ++k) {
    Arm arm = SwingingArm(40);
    arm.name = "arm" + std::to_string(k);
    const double angle = 2.0 * std::numbers::pi * k / 8;
    arm.mount.position += Vector3(0.02 * std::cos(angle), 0.02 * std::sin(angle), 0);
    robot.arms.push_back(arm);
  }
  Simulate(state, robot);
}
BENCHMARK(Arms)->Arg(1)->Arg(2)->Arg(4)->Arg(8)->Unit(benchmark::kMillisecond);

void MantleElements(benchmark::State& state) {
  Robot robot = Load("mantle_swim.toml").robot;
  robot.mantle->elements = static_cast<int>(state.range(0));
  Simulate(state, robot);
  state.SetComplexityN(state.range(0));
}
BENCHMARK(MantleElements)
    ->RangeMultiplier(2)
    ->Range(32, 2048)
    ->Unit(benchmark::kMillisecond)
    ->Complexity();

// One evaluation of all forces of the paper's vehicle, and bytes of state per node.
void Forces(benchmark::State& state) {
  const Plant plant(Load("paper.toml").robot);
  const PlantState at = InitialState(plant);
  PlantInputs inputs;
  EvaluateInputs(plant, 0.1, false, &inputs);
  PlantWork work(plant);
  for (auto _ : state) benchmark::DoNotOptimize(EvaluateForces(plant, at, inputs, &work));
  const double bytes =
      static_cast<double>(at.pose.size() * sizeof(Pose) + at.shape.size() * sizeof(Vector3)) +
      8.0 * static_cast<double>(at.velocity.size());
  state.counters["state_bytes_per_node"] = bytes / (plant.pose_count() + plant.shape_count());
}
BENCHMARK(Forces)->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace mantle::model

BENCHMARK_MAIN();
