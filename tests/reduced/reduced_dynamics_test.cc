#include <gtest/gtest.h>

#include "reduced/projection.h"
#include "tests/reduced/reduced_robots.h"
#include "tests/support/gradient_checker.h"

namespace mantle::reduced {
namespace {

using model::Plant;
using model::PlantInputs;
using model::PlantState;
using model::PlantWork;
using tests::RandomReducedState;

PlantInputs SomeInputs(const ReducedModel& model) {
  PlantInputs inputs;
  EvaluateInputs(model.plant, 0.0, false, &inputs);
  for (std::size_t i = 0; i < inputs.cables.size(); ++i) {
    inputs.cables[i].tension_n = 0.3 + 0.2 * static_cast<double>(i);
  }
  for (double& d : inputs.distributed) d = 0.7;
  for (double& s : inputs.strips_pa) s = 120.0;
  for (double& p : inputs.points) p = 0.4;
  return inputs;
}

// The plant's residual M a - f at the lifted state, projected with the lifting's Jacobian, which is
// taken by differences of the lifted velocity in v (it is linear in v).
struct Projected {
  model::VectorX residual;  // for a = 0 with the lift's own acceleration J_dot v
  Eigen::MatrixXd mass;
  double power;
};
Projected ProjectPlant(const ReducedModel& model, const ReducedState& s,
                       const PlantInputs& inputs) {
  const Plant& plant = model.plant;
  Projection projection(model);
  PlantState lifted = InitialState(plant);
  projection.Lift(s, &lifted);
  const int n = model.velocity_count();
  Eigen::MatrixXd jacobian(plant.velocity_size(), n);
  PlantState other = lifted;
  for (int j = 0; j < n; ++j) {
    ReducedState unit = s;
    unit.v = model::VectorX::Unit(n, j);
    projection.Lift(unit, &other);
    jacobian.col(j) = other.velocity;
  }
  // J_dot v by differences along the motion
  constexpr double kStep = 1e-3;
  const auto velocity_at = [&](double t) -> Eigen::VectorXd {
    ReducedState moved = s;
    moved.root = s.root * model::ExpSE3(t * s.v.head<6>());
    moved.q += t * s.v.tail(n - 6);
    projection.Lift(moved, &other);
    return other.velocity;
  };
  const model::VectorX drift = tests::DifferenceRate(velocity_at, kStep);
  PlantWork work(plant);
  EXPECT_FALSE(EvaluateForces(plant, lifted, inputs, &work));
  Projected out;
  model::VectorX image(plant.velocity_size());
  ApplyMass(plant, work, drift, &image);
  out.residual = jacobian.transpose() * (image - work.force);
  out.mass.resize(n, n);
  for (int j = 0; j < n; ++j) {
    model::VectorX column = jacobian.col(j);
    ApplyMass(plant, work, column, &image);
    out.mass.col(j) = jacobian.transpose() * image;
  }
  out.power = work.force.dot(lifted.velocity);
  return out;
}

// Differences of fourth order with steps of 1e-3 leave about 1e-11; the fitted polynomials 1e-9.
constexpr double kProjection = 2e-8;

TEST(ReducedDynamics, EqualsPlantProjectedOnSameStrainField) {
  const model::Robot robot = tests::ControlRobot(8, 32);
  const ReducedModel model(robot, tests::EquivalentReduction(robot));
  for (unsigned seed : {1u, 2u, 3u}) {
    const ReducedState s = RandomReducedState(model, 1.0, seed);
    const PlantInputs inputs = SomeInputs(model);
    const Projected plant = ProjectPlant(model, s, inputs);
    ReducedWork work(model);
    ReducedJacobians jacobians(model);
    const model::VectorX zero = model::VectorX::Zero(model.velocity_count());
    ASSERT_FALSE(EvaluateResidual(model, s, zero, inputs, &work));
    Linearise(model, s, zero, inputs, true, &work, &jacobians);
    const double scale = plant.residual.cwiseAbs().maxCoeff();
    EXPECT_LT((work.residual - plant.residual).cwiseAbs().maxCoeff(), kProjection * scale)
        << (work.residual - plant.residual).transpose() << "\n"
        << plant.residual.transpose();
    EXPECT_TRUE(tests::JacobianMatches(jacobians.mass, plant.mass, 1e-8));
  }
}

TEST(ReducedDynamics, DerivativesMatchDifferences) {
  model::Robot robot = tests::ControlRobot(8, 32);
  robot.arms[0].points = {
      {"tip", 0.42, model::Vector6::Ones() * 0.02, model::LoadFrame::kWorld, {}}};
  for (BasisKind kind : {BasisKind::kConstant, BasisKind::kLegendre}) {
    Reduction reduction;
    reduction.arms[0].basis = kind;
    reduction.arms[0].segments = 3;
    reduction.arms[0].degree = 2;
    const ReducedModel model(robot, reduction);
    const int n = model.velocity_count();
    const ReducedState s = RandomReducedState(model, 1.0, 7);
    const model::VectorX a = tests::RandomVector(n, 3);
    const PlantInputs inputs = SomeInputs(model);
    ReducedWork work(model);
    ReducedJacobians j(model);
    const auto at = [&](const ReducedState& state, const model::VectorX& acceleration,
                        const PlantInputs& in) -> Eigen::VectorXd {
      EXPECT_FALSE(EvaluateResidual(model, state, acceleration, in, &work));
      return work.residual;
    };
    model::VectorX scale = model::VectorX::Constant(n, 1e-3);
    for (int i = 0; i < model.mantle->size; ++i) {
      scale(6 + model.mantle_first() + i) = 1e-2 * model.mantle->basis.scale(i);
    }
    const model::VectorX origin = model::VectorX::Zero(n);
    const auto by_increment = tests::DifferenceJacobian(
        [&](const Eigen::VectorXd& x) {
          ReducedState moved = s;
          moved.root = s.root * model::ExpSE3(x.head<6>());
          moved.q += x.tail(n - 6);
          return at(moved, a, inputs);
        },
        origin, scale);
    const auto by_velocity = tests::DifferenceJacobian(
        [&](const Eigen::VectorXd& x) {
          ReducedState moved = s;
          moved.v += x;
          return at(moved, a, inputs);
        },
        origin, scale);
    const auto by_acceleration =
        tests::DifferenceJacobian([&](const Eigen::VectorXd& x) { return at(s, a + x, inputs); },
                                  origin, model::VectorX::Ones(n));
    const auto by_input = tests::DifferenceJacobian(
        [&](const Eigen::VectorXd& x) {
          PlantInputs in = inputs;
          int k = 0;
          for (auto& c : in.cables) c.tension_n += x(k++);
          for (auto& d : in.distributed) d += x(k++);
          for (auto& p : in.strips_pa) p += x(k++);
          return at(s, a, in);
        },
        model::VectorX::Zero(model.input_count()), model::VectorX::Ones(model.input_count()));
    at(s, a, inputs);
    Linearise(model, s, a, inputs, true, &work, &j);
    constexpr double kDerivative = 1e-7;  // drag has kinks of |u|, whose fourth derivative is large
    EXPECT_TRUE(tests::JacobianMatches(j.stiffness, by_increment, kDerivative, 1e-9)) << "K";
    EXPECT_TRUE(tests::JacobianMatches(j.damping, by_velocity, kDerivative, 1e-9)) << "D";
    EXPECT_TRUE(tests::JacobianMatches(j.mass, by_acceleration, kDerivative, 1e-9)) << "M";
    EXPECT_TRUE(tests::JacobianMatches(j.input, by_input, kDerivative, 1e-9)) << "U";
  }
}

}  // namespace
}  // namespace mantle::reduced
