#include <fmt/format.h>

#include <chrono>
#include <cstring>
#include <functional>

#include "loop/scene/scene.h"
#include "reduced/build/reduced_plant.h"
#include "tests/reduced/accuracy.h"

/// Prints the accuracy tables of docs/reduced.md: the reduced model against the plant on a fine
/// mesh, and the time of its step. Usage: reduced_accuracy [statics|dynamics|mantle|vehicle|price
/// ...]; without names, all.

namespace {

using namespace mantle::tests;
namespace model = mantle::model;
namespace reduced = mantle::reduced;
namespace scene = mantle::scene;

struct Basis {
  std::string name;
  reduced::ArmReduction arm;
};
std::vector<Basis> Bases(const reduced::StrainChoice& strains) {
  std::vector<Basis> out;
  for (int n : {1, 2, 3, 4, 5, 6}) {
    reduced::ArmReduction a;
    a.segments = n;
    a.strains = strains;
    out.push_back({fmt::format("{} segment{}", n, n > 1 ? "s" : ""), a});
  }
  for (int d : {1, 2, 3, 4}) {
    reduced::ArmReduction a;
    a.basis = reduced::BasisKind::kLegendre;
    a.degree = d;
    a.strains = strains;
    out.push_back({fmt::format("Legendre {}", d), a});
  }
  return out;
}

reduced::Reduction OfArm(const reduced::ArmReduction& arm) {
  reduced::Reduction r;
  r.arms = {arm};
  return r;
}

void ArmStatics() {
  const model::Robot robot = ArmWithCable(1.0);
  const model::PlantState full = FullEquilibrium(robot);
  fmt::print(
      "\nArm, static, one cable at 1 N: error of the tip in % of L (plant: {} elements)\n\n"
      "| basis | unknowns, six strains | error | unknowns, four | error |\n"
      "|---|---|---|---|---|\n",
      kFineArm);
  const auto six = Bases(reduced::kSixStrains), four = Bases(reduced::kFourStrains);
  for (std::size_t i = 0; i < six.size(); ++i) {
    fmt::print("| {} ", six[i].name);
    for (const Basis& b : {six[i], four[i]}) {
      const double error = StaticTipError(robot, OfArm(b.arm), full);
      fmt::print("| {} | {:.2f} % ", reduced::StrainBasis(b.arm, 0.42).size(), 100 * error);
    }
    fmt::print("|\n");
  }
}

void ArmDynamics() {
  constexpr double kDuration_s = 3.0;
  const model::Robot robot = ArmWithTorque();
  const auto full = FullRun(robot, kDuration_s);
  fmt::print(
      "\nArm, torque on for 1.5 s, then off, 3 s in water: largest error of the tip in % of L "
      "(plant: {} elements)\n\n"
      "| basis | six strains, steps of 5 ms | four strains, 5 ms | four strains, 50 ms |\n"
      "|---|---|---|---|\n",
      kFineArm);
  const auto six = Bases(reduced::kSixStrains), four = Bases(reduced::kFourStrains);
  for (std::size_t i = 0; i < six.size(); ++i) {
    const auto e = [&](const Basis& b, double step_s) {
      return 100 * ErrorsOfRun(robot, OfArm(b.arm), step_s, full).tip;
    };
    fmt::print("| {} | {:.2f} % | {:.2f} % | {:.2f} % |\n", six[i].name, e(six[i], 0.005),
               e(four[i], 0.005), e(four[i], 0.05));
  }
}

// `coordinates` of which one is a vibration mode, or all are.
reduced::Reduction OfMantle(int coordinates, bool modes_only) {
  reduced::Reduction r;
  r.mantle.static_pressures_pa.emplace();
  if (modes_only) {
    r.mantle.modes = coordinates;
    return r;
  }
  if (coordinates == 2) r.mantle.static_pressures_pa = {325};
  if (coordinates == 3) r.mantle.static_pressures_pa = {160, 325};
  if (coordinates == 5) r.mantle.static_pressures_pa = {110, 220, 325, 420};
  return r;
}

void MantleVolume(bool pulsing) {
  constexpr double kPeriod_s = 0.66;
  fmt::print(
      "\nClamped mantle, {}: error of the volume in % of its change (plant: {} elements)\n\n"
      "| Pa | change of volume | 1 mode | 2 modes | 3 modes | 5 modes | mode + 1 static | "
      "mode + 2 static | mode + 4 static |\n|---|---|---|---|---|---|---|---|---|\n",
      pulsing ? "two pulses (triangular, period 0.66 s, no jet, steps of 5 ms)" : "static",
      kFineMantle);
  for (double p : {50.0, 160.0, 250.0, 325.0, 400.0, 450.0}) {
    const model::Robot robot =
        MantleAlone(pulsing ? model::Schedule(model::TriangularSchedule{0, p, kPeriod_s, 0})
                            : model::Schedule(model::ConstantSchedule{p}));
    const double rest = model::Plant(robot).shell->rest_volume_m3;
    double change = 0;
    std::function<double(const reduced::Reduction&)> error;
    std::vector<model::Sample> run;
    model::PlantState equilibrium;
    if (pulsing) {
      run = FullRun(robot, 2 * kPeriod_s);
      for (const auto& s : run) change = std::max(change, rest - s.volume_m3);
      error = [&](const auto& r) { return ErrorsOfRun(robot, r, kFineStep_s, run).volume; };
    } else {
      equilibrium = FullEquilibrium(robot);
      change = rest - model::ShellVolume(equilibrium.shape);
      error = [&](const auto& r) { return StaticVolumeError(robot, r, equilibrium); };
    }
    fmt::print("| {} | {:.1f} % ", p, 100 * change / rest);
    for (int n : {1, 2, 3, 5}) fmt::print("| {:.3g} % ", 100 * error(OfMantle(n, true)));
    for (int n : {2, 3, 5}) fmt::print("| {:.3g} % ", 100 * error(OfMantle(n, false)));
    fmt::print("|\n");
  }
}

void Vehicle() {
  struct Case {
    const char* name;
    std::vector<std::string> overrides;
  };
  const std::vector<Case> bases = {
      {"3 modes", {"reduced.modes=3", "reduced.static_pressures=[]", "reduced.snapshots=0"}},
      {"mode + static 325", {"reduced.static_pressures=[325]", "reduced.snapshots=0"}},
      {"mode + static 160, 325", {"reduced.static_pressures=[160, 325]", "reduced.snapshots=0"}},
      {"mode + static 325 + snapshot", {"reduced.static_pressures=[325]", "reduced.snapshots=1"}},
      {"mode + static 160, 325 + 3 snapshots",
       {"reduced.static_pressures=[160, 325]", "reduced.snapshots=3"}}};
  const std::vector<Case> runs = {
      {"160 Pa", {"mantle.strips.muscle.pressure.high=160"}},
      {"250 Pa", {"mantle.strips.muscle.pressure.high=250"}},
      {"325 Pa, the paper's", {}},
      {"325 Pa, thrust on the dome", {"effects.jet_thrust.place=\"dome\""}},
      {"325 Pa, flux of the radial motion", {"effects.jet_thrust.flux=\"radial\""}}};
  fmt::print(
      "\nWhole vehicle, scenes/paper.toml, 9 s, 4 segments x 4 strains: largest errors of the "
      "root's path in % of the body length, of the heading, and of the volume in % of its change "
      "(plant: {} and {} elements, steps of 5 ms)\n\n"
      "| run | mantle | coordinates | root, steps of 5 ms | root, 50 ms | heading, 50 ms | volume, "
      "50 ms |\n|---|---|---|---|---|---|---|\n",
      kFineMantle, kFineArm);
  for (const Case& run : runs) {
    std::vector<model::Sample> full;
    for (const Case& basis : bases) {
      std::vector<std::string> overrides = {fmt::format("mantle.elements={}", kFineMantle),
                                            fmt::format("arms.arm.elements={}", kFineArm)};
      overrides.insert(overrides.end(), run.overrides.begin(), run.overrides.end());
      overrides.insert(overrides.end(), basis.overrides.begin(), basis.overrides.end());
      const scene::Scene scene =
          scene::LoadScene(std::string(MANTLE_SOURCE_DIR) + "/scenes/paper.toml", overrides);
      if (full.empty()) full = FullRun(scene.robot, scene.run.duration_s);
      const RunErrors fine = ErrorsOfRun(scene.robot, scene.reduction, 0.005, full);
      const RunErrors coarse = ErrorsOfRun(scene.robot, scene.reduction, 0.05, full);
      fmt::print("| {} | {} | {} | {:.1f} % | {:.1f} % | {:.3f} rad | {:.1f} % |\n", run.name,
                 basis.name, reduced::ReducedPlant(scene.robot, scene.reduction).mantle->size,
                 100 * fine.root, 100 * coarse.root, coarse.heading, 100 * coarse.volume);
    }
  }
}

// Shortest of many steps of 50 ms in the middle of a swim, in microseconds.
double ShortestStep(const reduced::ReducedPlant& model, bool derivatives) {
  constexpr int kSteps = 26, kRepeats = 20;  // two pulses
  constexpr double kStep_s = 0.05;
  const double share = reduced::FirstStageTime(reduced::StepScheme::kSdirk2);
  reduced::StepWork work(model);
  reduced::StepJacobian jacobian(model);
  reduced::StepSettings settings;
  settings.tolerance = 1e-8;
  model::PlantInputs first, last;
  double best = 1e300;
  for (int repeat = 0; repeat < kRepeats; ++repeat) {
    reduced::ReducedState s = InitialState(model), next = s;
    double sum = 0;
    for (int i = 0; i < kSteps; ++i) {
      EvaluateInputs(model.plant, s.time_s + share * kStep_s, false, &first);
      EvaluateInputs(model.plant, s.time_s + kStep_s, true, &last);
      const auto begin = std::chrono::steady_clock::now();
      const auto o = TakeStep(model, settings, kStep_s, s, first, last, &work, &next,
                              derivatives ? &jacobian : nullptr);
      const std::chrono::duration<double> taken = std::chrono::steady_clock::now() - begin;
      if (!o.ok) return std::nan("");
      sum += taken.count();
      s = next;
    }
    best = std::min(best, sum / kSteps);
  }
  return 1e6 * best;
}

void Price() {
  fmt::print(
      "\nTime of a step of 50 ms of the paper's vehicle, mean over two pulses, best of 20 runs, "
      "us\n\n"
      "| arm, four strains | mantle | states | step | with derivatives |\n|---|---|---|---|---|\n");
  const model::Robot robot =
      scene::LoadScene(std::string(MANTLE_SOURCE_DIR) + "/scenes/paper.toml").robot;
  const auto row = [&](const Basis& basis, int mantle) {
    reduced::Reduction r = OfMantle(mantle, false);
    r.arms = {basis.arm};
    const reduced::ReducedPlant m(robot, r);
    fmt::print("| {} | {} | {} | {:.0f} | {:.0f} |\n", basis.name, mantle, 2 * m.velocity_count(),
               ShortestStep(m, false), ShortestStep(m, true));
  };
  const std::vector<Basis> bases = Bases(reduced::kFourStrains);
  for (const Basis& basis : bases) row(basis, 3);
  for (int mantle : {2, 5}) row(bases[3], mantle);
}

}  // namespace

int main(int argc, char** argv) {
  const auto wanted = [&](const char* name) {
    if (argc == 1) return true;
    for (int i = 1; i < argc; ++i) {
      if (std::strcmp(argv[i], name) == 0) return true;
    }
    return false;
  };
  if (wanted("statics")) ArmStatics();
  if (wanted("dynamics")) ArmDynamics();
  if (wanted("mantle")) {
    MantleVolume(false);
    MantleVolume(true);
  }
  if (wanted("vehicle")) Vehicle();
  if (wanted("price")) Price();
}
