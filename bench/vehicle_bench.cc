// Speed of the vehicle in lock-step: a SYNC period of the swimming robot with five motors, drives,
// bus and plant.

#include <benchmark/benchmark.h>

#include <cmath>

#include "tests/loop/vehicle.h"
#include "tests/loop/vehicles.h"

namespace mantle::loop {
namespace {

// Counter: simulated over wall time.
void Cycle(benchmark::State& state) {
  const model::Plant plant(tests::SwimmingRobot());
  model::RunSettings run = tests::LoopRun();
  run.account_energy = state.range(1) != 0;
  Vehicle vehicle(plant, run, tests::FiveMotors(),
                  {.cable_stiffness_n_m = static_cast<double>(state.range(0))});
  if (const Status status = vehicle.BringUp(); !status.ok) {
    state.SkipWithError(status.reason.c_str());
    return;
  }
  MotorCommand commands[5] = {};
  long k = 0;
  for (auto _ : state) {
    const double t = 0.01 * static_cast<double>(k++);
    const double wanted = tests::Triangle(t, 0.66, 0.5);
    const double sigma = std::fmod(t, 0.66) < 0.33 ? 1.0 : -1.0;
    commands[4].torque_permille =
        static_cast<std::int16_t>(std::lround(TensionToTorque(vehicle.winch_map(), wanted, sigma)));
    if (const Status status = vehicle.Cycle(commands); !status.ok) {
      state.SkipWithError(status.reason.c_str());
    }
  }
  state.counters["realtime_factor"] = benchmark::Counter(
      1e-6 * static_cast<double>(vehicle.time_us()), benchmark::Counter::kIsRate);
}
BENCHMARK(Cycle)
    ->ArgNames({"N_per_m", "energy"})
    ->Args({500, 0})
    ->Args({500, 1})
    ->Args({5000, 0})
    ->Iterations(600)
    ->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace mantle::loop
