#include "reduced/build/mantle_basis.h"

#include <fmt/format.h>

#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <optional>

#include "model/modes.h"
#include "model/simulation.h"
#include "model/statics.h"
#include "model/validity.h"

namespace mantle::reduced {
namespace {

using model::BadRobot;
using model::Plant;
using model::Robot;
using model::VectorX;

constexpr double kDependent = 1e-5;  // of a shape's norm left after orthogonalisation: refused
constexpr double kTrainingReach =
    1.2;  // equilibria are sought up to this share of the last pressure
constexpr int kTrainingSteps = 6;
// A strip's collapse is some fifty times the pressure of its wall's lobes.
constexpr double kCollapseSought = 500.0;
constexpr int kCollapseSteps = 200;
constexpr double kSnapshotInterval_s = 0.01;
constexpr double kModeAmplitude_m = 2e-3;  // of the wall: size of a mode that no equilibrium shows

// The mantle alone, clamped, in vacuo but for its added mass, with every load switched off.
Robot MantleAlone(const Robot& robot) {
  Robot alone;
  alone.name = robot.name;
  alone.root = model::ClampedRoot{};
  alone.water = robot.water;
  alone.mantle = robot.mantle;
  alone.effects.added_mass = robot.effects.added_mass;
  for (auto& s : alone.mantle->strips) s.pressure_pa = model::ConstantSchedule{0.0};
  for (auto& s : alone.mantle->spokes) s.drive = model::GivenTension{model::ConstantSchedule{0.0}};
  return alone;
}

struct Strip {
  bool spokes;
  int index;
  double from_m, to_m, total_m2;
};

std::vector<Strip> DistinctStrips(const Plant& plant) {
  std::vector<Strip> out;
  const model::Mantle& m = *plant.robot.mantle;
  const auto add = [&](bool spokes, int i, double from, double to, double total) {
    const bool known = std::any_of(out.begin(), out.end(), [&](const Strip& s) {
      return std::abs(s.from_m - from) < 1e-9 && std::abs(s.to_m - to) < 1e-9;
    });
    if (!known) out.push_back({spokes, i, from, to, total});
  };
  for (std::size_t i = 0; i < m.strips.size(); ++i) {
    add(false, static_cast<int>(i), m.strips[i].from_m, m.strips[i].to_m,
        plant.shell->strips[i].strip.total_m2);
  }
  for (std::size_t i = 0; i < m.spokes.size(); ++i) {
    add(true, static_cast<int>(i), m.spokes[i].from_m, m.spokes[i].to_m,
        plant.shell->spokes[i].strip.total_m2);
  }
  return out;
}

Robot Loaded(const Robot& unloaded, const Strip& strip, double pressure) {
  Robot robot = unloaded;
  if (strip.spokes) {
    auto& spokes = robot.mantle->spokes[strip.index];
    const double tension = pressure * strip.total_m2 / spokes.spokes;
    spokes.drive = model::GivenTension{model::ConstantSchedule{tension}};
  } else {
    robot.mantle->strips[strip.index].pressure_pa = model::ConstantSchedule{pressure};
  }
  return robot;
}

// Equilibrium minus reference, 3 per node; empty where there is none.
std::optional<VectorX> StaticShape(const Robot& unloaded, const Strip& strip, double pressure) {
  const Plant plant(Loaded(unloaded, strip, pressure));
  const model::StaticsResult result = SolveStatics(plant, {});
  if (!result.ok) return std::nullopt;
  VectorX shape(3 * plant.shape_count());
  for (int j = 0; j < plant.shape_count(); ++j) {
    shape.segment<3>(3 * j) = result.state.shape[j] - plant.shell->reference[j];
  }
  return shape;
}

VectorX NodalMass(const model::Shell& shell) {
  VectorX mass(3 * shell.node_count());
  for (int j = 0; j < shell.node_count(); ++j) mass.segment<3>(3 * j) = shell.nodes[j].inertia;
  return mass;
}

// Makes column i orthonormal in the mass to those before it (modified Gram-Schmidt, twice).
void Orthonormalise(const VectorX& mass, int i, Eigen::MatrixXd* shapes) {
  auto x = shapes->col(i);
  const double norm = std::sqrt(x.dot(mass.cwiseProduct(x)));
  for (int pass = 0; pass < 2; ++pass) {
    for (int j = 0; j < i; ++j) {
      const auto y = shapes->col(j);
      x -= y * y.dot(mass.cwiseProduct(x));
    }
  }
  const double left = std::sqrt(x.dot(mass.cwiseProduct(x)));
  if (!(left > kDependent * norm)) {
    throw BadRobot(
        fmt::format("static_pressures: shape {} depends on the others ({:.2g} of it is "
                    "left, must be > {:.0e})",
                    i, left / norm, kDependent));
  }
  x /= left;
}

// Profiles minus the reference along a run of the plant, as far as it gets.
std::vector<VectorX> RecordSnapshots(const Plant& plant, double duration_s) {
  model::RunSettings settings;
  settings.duration_s = duration_s;
  settings.account_energy = false;
  model::Simulation simulation(plant, settings);
  std::vector<VectorX> out;
  for (double t = kSnapshotInterval_s; t < duration_s + 0.5 * kSnapshotInterval_s;
       t += kSnapshotInterval_s) {
    if (!simulation.AdvanceTo(std::min(t, duration_s)).ok) break;
    VectorX x(3 * plant.shape_count());
    for (int j = 0; j < plant.shape_count(); ++j) {
      x.segment<3>(3 * j) = simulation.state().shape[j] - plant.shell->reference[j];
    }
    out.push_back(std::move(x));
  }
  return out;
}

// Leading left singular vectors, in the mass, of what the first `column` shapes leave.
void AddSnapshotShapes(const std::vector<VectorX>& snapshots, const VectorX& mass, int column,
                       Eigen::MatrixXd* shapes) {
  const int n = static_cast<int>(mass.size()), count = static_cast<int>(shapes->cols()) - column;
  const VectorX root = mass.cwiseSqrt();
  Eigen::MatrixXd x(n, snapshots.size());
  for (std::size_t i = 0; i < snapshots.size(); ++i) {
    VectorX s = snapshots[i];
    for (int j = 0; j < column; ++j) {
      s -= shapes->col(j) * shapes->col(j).dot(mass.cwiseProduct(s));
    }
    x.col(static_cast<int>(i)) = root.cwiseProduct(s);
  }
  Eigen::JacobiSVD<Eigen::MatrixXd> svd(x, Eigen::ComputeThinU);
  if (svd.rank() < count) {
    throw BadRobot(
        fmt::format("snapshots = {}: the run shows only {} further shapes", count, svd.rank()));
  }
  for (int i = 0; i < count; ++i) {
    shapes->col(column + i) = svd.matrixU().col(i).cwiseQuotient(root);
    Orthonormalise(mass, column + i, shapes);
  }
}

}  // namespace

std::optional<double> CollapsePressure(const Plant& plant) {
  const Robot alone = MantleAlone(plant.robot);
  std::optional<double> lowest;
  const auto follow = [&](const Robot& loaded) {
    model::StaticsSettings settings;
    settings.arc_length = true;
    settings.load_steps = kCollapseSteps;
    const model::StaticsResult path = SolveStatics(Plant(loaded), settings);
    if (!path.limit_load_factor) return;
    const double found = *path.limit_load_factor;
    if (!lowest || found < *lowest) lowest = found;
  };
  const double sought = kCollapseSought * FindLobedBuckling(*plant.shell).held_pa;
  const std::vector<Strip> strips = DistinctStrips(plant);
  for (const Strip& strip : strips) follow(Loaded(alone, strip, sought));
  if (strips.empty()) {
    Robot pressed = alone;
    pressed.effects.normal_pressure = model::NormalPressure{model::ConstantSchedule{-sought}};
    follow(pressed);
  }
  if (lowest) *lowest *= sought;
  return lowest;
}

MantleShapes MakeMantleShapes(const Plant& plant, const MantleReduction& reduction) {
  const Robot alone = MantleAlone(plant.robot);
  const Plant clamped(alone);
  const std::vector<Strip> strips = DistinctStrips(plant);
  std::vector<double> pressures;
  int modes = reduction.modes;
  if (reduction.static_pressures_pa) {
    pressures = *reduction.static_pressures_pa;
  } else if (strips.empty()) {
    modes += 2;
  } else {
    pressures = {160.0, 325.0};
  }
  if (!pressures.empty() && strips.empty()) {
    throw BadRobot(
        "static_pressures: the mantle has no strip and no spokes to load; give an empty "
        "list and modes");
  }
  const int statics = static_cast<int>(pressures.size() * strips.size());
  const int snapshot_count = std::max(reduction.snapshots, 0);
  const int k = modes + statics + snapshot_count;
  int available = 0;
  for (const model::ShellNode& node : plant.shell->nodes) {
    available += 3 - static_cast<int>(node.held.sum());
  }
  const int bound = std::min(kMaxMantleCoordinates, available);
  if (modes < 0 || k < 1 || k > bound) {
    throw BadRobot(fmt::format(
        "modes = {}, {} static shapes and {} snapshots: {} coordinates, must be in [1, {}] "
        "(the mesh of {} nodes has {})",
        modes, statics, snapshot_count, k, bound, plant.shape_count(), available));
  }

  MantleShapes out;
  const VectorX mass = NodalMass(*plant.shell);
  const int n = static_cast<int>(mass.size());
  out.shapes.setZero(n, k);
  int column = 0;
  if (modes > 0) {
    for (const model::Mode& mode : VibrationModes(clamped, InitialState(clamped), modes)) {
      out.shapes.col(column++) = mode.shape.tail(n);
      out.mode_frequencies_rad_s.push_back(mode.angular_frequency_rad_s);
    }
  }
  for (double p : pressures) {
    for (const Strip& strip : strips) {
      const auto shape = StaticShape(alone, strip, p);
      if (!shape) {
        throw BadRobot(
            fmt::format("static_pressures = {} Pa: no stable equilibrium of the mantle "
                        "at this pressure",
                        p));
      }
      out.shapes.col(column++) = *shape;
    }
  }
  for (int i = 0; i < column; ++i) Orthonormalise(mass, i, &out.shapes);
  std::vector<VectorX> snapshots;
  if (snapshot_count > 0) {
    snapshots = RecordSnapshots(plant, reduction.snapshot_time_s);
    AddSnapshotShapes(snapshots, mass, column, &out.shapes);
  }
  const double reach =
      pressures.empty() ? 325.0 : *std::max_element(pressures.begin(), pressures.end());
  for (std::size_t i = 0; i < snapshots.size(); i += 4) {
    out.equilibria.push_back(out.shapes.transpose() * mass.cwiseProduct(snapshots[i]));
  }
  for (const Strip& strip : strips) {
    for (int i = 1; i <= kTrainingSteps; ++i) {
      const auto shape = StaticShape(alone, strip, kTrainingReach * reach * i / kTrainingSteps);
      if (!shape) break;
      out.reach_pa = std::max(out.reach_pa, kTrainingReach * reach * i / kTrainingSteps);
      out.equilibria.push_back(out.shapes.transpose() * mass.cwiseProduct(*shape));
    }
  }
  out.scale.setZero(k);
  for (const VectorX& s : out.equilibria) out.scale = out.scale.cwiseMax(s.cwiseAbs());
  for (int i = 0; i < k; ++i) {
    double largest = 0;
    for (int j = 0; j < n; j += 3) {
      largest = std::max(largest, out.shapes.col(i).segment<2>(j).norm());
    }
    out.scale(i) = std::max(out.scale(i), kModeAmplitude_m / largest);
  }
  return out;
}

}  // namespace mantle::reduced
