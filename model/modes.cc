#include "model/modes.h"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <random>
#include <stdexcept>

#include "model/newton_matrix.h"

namespace mantle::model {
namespace {

constexpr int kGuardVectors = 6;
constexpr int kSweeps = 200;
constexpr double kConverged = 1e-12;   // relative change of the squared frequencies
constexpr double kShift_rad_s = 0.01;  // keeps K + shift^2 M regular on a free root

// The robot without anything that depends on velocity.
Robot Conservative(Robot robot) {
  robot.effects.viscosity = false;
  robot.effects.drag = false;
  robot.effects.jet_thrust.reset();
  robot.effects.lateral_drag.reset();
  robot.effects.named.ForEach([](auto& effect) {
    if (EffectType<decltype(effect)>::kOnVelocity) effect.reset();
  });
  robot.effects.current_m_s.reset();
  robot.effects.unsteady_current.reset();
  return robot;
}

int FreeCoordinates(const Plant& plant) {
  int free = plant.velocity_size() - (plant.root_free() ? 0 : 6);
  if (plant.shell) {
    for (const ShellNode& node : plant.shell->nodes) free -= static_cast<int>(node.held.sum());
  }
  return free;
}

}  // namespace

std::vector<Mode> VibrationModes(const Plant& plant, const PlantState& state, int count) {
  PlantInputs inputs;
  EvaluateInputs(plant, state.time_s, false, &inputs);
  return VibrationModes(plant, state, inputs, count);
}

std::vector<Mode> VibrationModes(const Plant& original, const PlantState& at,
                                 const PlantInputs& inputs, int count) {
  const Plant plant(Conservative(original.robot));
  PlantState state = at;
  state.velocity.setZero();
  PlantWork work(plant);
  if (const EvaluationFailure failure = EvaluateForces(plant, state, inputs, &work)) {
    throw BadRobot("vibration modes: " + failure.Message());
  }
  NewtonMatrix matrix(plant);
  const double shift = plant.root_free() ? kShift_rad_s : 0.0;
  if (!matrix.FactorAtRest(plant, state, inputs, work, shift)) {
    throw BadRobot("vibration modes: the stiffness matrix is singular");
  }
  const int n = plant.velocity_size(), free = FreeCoordinates(plant);
  if (count > free) {
    throw BadRobot(
        fmt::format("vibration modes: count = {}, the mesh has {} free coordinates", count, free));
  }
  const int m = std::min(count + kGuardVectors, free);
  Eigen::MatrixXd x(n, m), mx(n, m), ax(n, m);
  std::mt19937 random(7);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  for (double& e : x.reshaped()) e = uniform(random);
  if (!plant.root_free()) x.topRows(6).setZero();
  VectorX column(n), image(n);
  const auto mass = [&](const VectorX& v, VectorX* out) {
    ApplyMass(plant, work, v, out);
    if (!plant.root_free()) out->head<6>().setZero();
  };
  VectorX last = VectorX::Zero(m);
  for (int sweep = 0; sweep < kSweeps; ++sweep) {
    for (int k = 0; k < m; ++k) {
      column = x.col(k);
      mass(column, &image);
      ax.col(k) = image;  // A (A^-1 M x) = M x
      matrix.Solve(plant, &image);
      x.col(k) = image;
      mass(x.col(k), &column);
      mx.col(k) = column;
    }
    const Eigen::MatrixXd reduced_m = x.transpose() * mx;
    const Eigen::MatrixXd reduced_a = x.transpose() * ax;
    Eigen::GeneralizedSelfAdjointEigenSolver<Eigen::MatrixXd> solver(
        0.5 * (reduced_a + reduced_a.transpose()), 0.5 * (reduced_m + reduced_m.transpose()));
    if (solver.info() != Eigen::Success) {
      throw BadRobot("vibration modes: the projected problem failed");
    }
    x = (x * solver.eigenvectors()).eval();
    const VectorX& values = solver.eigenvalues();
    const double change = ((values - last).head(count).cwiseAbs().array() /
                           values.head(count).cwiseAbs().array().max(1e-12))
                              .maxCoeff();
    last = values;
    if (change < kConverged) {
      std::vector<Mode> modes;
      for (int k = 0; k < count; ++k) {
        VectorX shape = x.col(k);
        Eigen::Index largest;
        shape.cwiseAbs().maxCoeff(&largest);
        if (shape(largest) < 0) shape = -shape;
        const double squared = values(k) - shift * shift;
        modes.push_back({std::sqrt(std::max(squared, 0.0)), std::move(shape),
                         std::sqrt(std::max(-squared, 0.0))});
      }
      return modes;
    }
  }
  throw BadRobot("vibration modes: the iteration did not converge");
}

}  // namespace mantle::model
