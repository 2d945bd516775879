#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>

#include "model/statics.h"
#include "reduced/simulation.h"
#include "tests/reduced/reduced_robots.h"

/// Prints the accuracy tables of docs/reduced.md: the reduced model against the plant on the same
/// mesh. Usage: reduced_accuracy

namespace {

using mantle::model::Vector3;
namespace model = mantle::model;
namespace reduced = mantle::reduced;

model::Robot ArmAlone() {
  model::Robot robot;
  robot.name = "arm";
  robot.root = model::ClampedRoot{};
  robot.arms = {mantle::tests::PaperArm(48)};
  robot.arms[0].mount = model::Pose::Identity();
  robot.effects.drag = robot.effects.added_mass = robot.effects.viscosity = true;
  return robot;
}

struct Basis {
  std::string name;
  reduced::ArmReduction arm;
};
std::vector<Basis> Bases(const model::StrainChoice& strains) {
  std::vector<Basis> out;
  for (int n : {1, 2, 3, 4, 6}) {
    reduced::ArmReduction a;
    a.segments = n;
    a.strains = strains;
    out.push_back({fmt::format("{} segments", n), a});
  }
  for (int d : {1, 2, 3, 4}) {
    reduced::ArmReduction a;
    a.basis = model::BasisKind::kLegendre;
    a.degree = d;
    a.strains = strains;
    out.push_back({fmt::format("Legendre {}", d), a});
  }
  return out;
}

// Equilibrium by backward Euler steps so long that only statics is left.
reduced::ReducedState Settle(const reduced::ReducedModel& m) {
  reduced::StepSettings settings;
  settings.scheme = model::StepScheme::kBackwardEuler;
  settings.max_iterations = 100;
  reduced::StepWork work(m);
  reduced::ReducedState s = InitialState(m), next = s;
  model::PlantInputs inputs;
  EvaluateInputs(m.plant, 0.0, false, &inputs);
  double h = 0.01;
  for (int i = 0; i < 400; ++i) {
    const auto o = TakeStep(m, settings, h, s, inputs, inputs, &work, &next, nullptr);
    if (!o.ok) {
      h *= 0.5;
      continue;
    }
    s = next;
    h = std::min(2.0 * h, 100.0);
  }
  return s;
}

void ArmStatic() {
  model::Robot robot = ArmAlone();
  mantle::tests::AddFourCables(&robot.arms[0]);
  robot.arms[0].cables.resize(1);
  robot.arms[0].cables[0].drive = model::GivenTension{model::ConstantSchedule{1.0}};
  const model::Plant plant(robot);
  model::StaticsSettings statics;
  statics.load_steps = 20;
  const auto full = SolveStatics(plant, statics);
  const Vector3 tip = full.state.pose.back().position;
  fmt::print(
      "\nArm, static, one cable at 1 N: error of the tip in % of L (plant: 48 elements)\n\n");
  fmt::print(
      "| basis | unknowns, six strains | error | unknowns, four | error "
      "|\n|---|---|---|---|---|\n");
  const auto six = Bases(model::kSixStrains), four = Bases(model::kFourStrains);
  for (std::size_t i = 0; i < six.size(); ++i) {
    fmt::print("| {} ", six[i].name);
    for (const Basis& b : {six[i], four[i]}) {
      reduced::Reduction r;
      r.arms = {b.arm};
      const reduced::ReducedModel m(robot, r);
      reduced::Projection projection(m);
      model::PlantState lifted = InitialState(m.plant);
      projection.Lift(Settle(m), &lifted);
      fmt::print("| {} | {:.2f} % ", m.coordinate_count(),
                 100 * (lifted.pose.back().position - tip).norm() / 0.42);
    }
    fmt::print("|\n");
  }
}

struct Worst {
  double tip{0}, volume{0};
};
Worst Run(const model::Robot& robot, const reduced::Reduction& r, double duration, double step,
          const std::vector<model::Sample>& full) {
  const reduced::ReducedModel m(robot, r);
  reduced::ReducedRunSettings settings;
  settings.duration_s = duration;
  settings.step_s = step;
  settings.output_interval_s = 0.05;
  reduced::ReducedSimulation simulation(m, settings);
  Worst w;
  double change = 1e-300;
  for (const auto& s : full) change = std::max(change, std::abs(s.volume_m3 - full[0].volume_m3));
  std::size_t i = 0;
  const auto result = simulation.Run([&](const model::Sample& s) {
    if (!s.tips.empty()) {
      w.tip = std::max(w.tip, (s.tips[0].position - full[i].tips[0].position).norm());
    }
    w.volume = std::max(w.volume, std::abs(s.volume_m3 - full[i].volume_m3) / change);
    ++i;
    return i < full.size();
  });
  if (!result.ok) w.tip = w.volume = std::nan("");
  return w;
}

std::vector<model::Sample> RunFull(const model::Robot& robot, double duration) {
  const model::Plant plant(robot);
  model::RunSettings settings;
  settings.duration_s = duration;
  settings.step_s = 0.005;
  settings.output_interval_s = 0.05;
  model::Simulation simulation(plant, settings);
  std::vector<model::Sample> out;
  const auto result = simulation.Run([&](const model::Sample& s) {
    out.push_back(s);
    return true;
  });
  if (!result.ok) fmt::print("(plant stopped: {})\n", result.reason);
  return out;
}

void ArmDynamic() {
  model::Robot robot = ArmAlone();
  model::DistributedWrench torque;
  torque.name = "torque";
  torque.direction << 0, 0, 0.05, 0, 0, 0;
  torque.tip = 0;
  torque.schedule = model::IntervalSchedule{1.0, {0.0}, {1.5}};
  robot.arms[0].distributed = {torque};
  constexpr double kDuration_s = 3.0;
  const auto full = RunFull(robot, kDuration_s);
  fmt::print(
      "\nArm, torque on for 1.5 s, then off, 3 s in water: largest error of the tip in % of L, "
      "steps of 5 ms\n\n");
  fmt::print("| basis | six strains | four strains | four, steps of 50 ms |\n|---|---|---|---|\n");
  const auto six = Bases(model::kSixStrains), four = Bases(model::kFourStrains);
  for (std::size_t i = 0; i < six.size(); ++i) {
    reduced::Reduction a, b;
    a.arms = {six[i].arm};
    b.arms = {four[i].arm};
    const auto e = [&](const reduced::Reduction& r, double step) {
      return 100 * Run(robot, r, kDuration_s, step, full).tip / 0.42;
    };
    fmt::print("| {} | {:.2f} % | {:.2f} % | {:.2f} % |\n", six[i].name, e(a, 0.005), e(b, 0.005),
               e(b, 0.05));
  }
}

model::Robot MantleAlone(model::Schedule pressure) {
  model::Robot robot;
  robot.name = "mantle";
  robot.root = model::ClampedRoot{};
  robot.mantle = mantle::tests::PaperMantle(64, 2);
  robot.mantle->strips = {mantle::tests::PaperStrip(std::move(pressure))};
  robot.effects.added_mass = robot.effects.viscosity = robot.effects.drag = true;
  return robot;
}

reduced::Reduction MantleBasis(int coordinates, bool modes) {
  reduced::Reduction r;
  r.mantle.cubature_tolerance = 1e-3;
  std::vector<double> p;
  if (modes) {
    r.mantle.modes = coordinates;
  } else {
    if (coordinates == 2) p = {325};
    if (coordinates == 3) p = {160, 325};
    if (coordinates == 5) p = {110, 220, 325, 420};
  }
  r.mantle.static_pressures_pa = p;
  return r;
}

void MantleTables() {
  for (bool pulsing : {false, true}) {
    fmt::print(
        "\nClamped mantle, {}: error of the volume in % of its change (plant: 64 elements)\n\n",
        pulsing ? "pulsing (triangular, period 0.66 s, 1.32 s, no jet)" : "static");
    fmt::print(
        "| Pa | change of volume | 1 mode | 2 modes | 3 modes | 5 modes | mode + 1 static | mode "
        "+ 2 static | mode + 4 static |\n|---|---|---|---|---|---|---|---|---|\n");
    for (double p : {50.0, 160.0, 325.0, 450.0}) {
      const model::Robot robot =
          MantleAlone(pulsing ? model::Schedule(model::TriangularSchedule{0, p, 0.66, 0})
                              : model::Schedule(model::ConstantSchedule{p}));
      const model::Plant plant(robot);
      std::vector<model::Sample> full;
      double rest = plant.shell->rest_volume_m3, change = 0, final_volume = 0;
      if (pulsing) {
        full = RunFull(robot, 1.32);
        for (const auto& s : full) change = std::max(change, std::abs(s.volume_m3 - rest));
      } else {
        final_volume = model::ShellVolume(SolveStatics(plant, {}).state.shape);
        change = rest - final_volume;
      }
      fmt::print("| {} | {:.1f} % ", p, 100 * change / rest);
      for (const auto& [n, modes] : {std::pair{1, true},
                                     {2, true},
                                     {3, true},
                                     {5, true},
                                     {2, false},
                                     {3, false},
                                     {5, false}}) {
        const reduced::Reduction r = MantleBasis(n, modes);
        double error;
        if (pulsing) {
          error = Run(robot, r, 1.32, 0.005, full).volume;
        } else {
          const reduced::ReducedModel m(robot, r);
          reduced::Projection projection(m);
          model::PlantState lifted = InitialState(m.plant);
          projection.Lift(Settle(m), &lifted);
          error = std::abs(model::ShellVolume(lifted.shape) - final_volume) / change;
        }
        fmt::print("| {:.3g} % ", 100 * error);
      }
      fmt::print("|\n");
    }
  }
}

}  // namespace

int main() {
  ArmStatic();
  ArmDynamic();
  MantleTables();
}
