#include <gtest/gtest.h>

#include "reduced/build/projection.h"
#include "tests/reduced/reduced_robots.h"
#include "tests/support/gradient_checker.h"
#include "tests/support/rich_robot.h"

namespace mantle::reduced {
namespace {

using model::Plant;
using model::PlantInputs;
using model::PlantState;
using model::PlantWork;
using tests::RandomReducedState;

PlantInputs SomeInputs(const ReducedPlant& model) {
  PlantInputs inputs;
  EvaluateInputs(model.plant, 0.0, false, &inputs);
  for (std::size_t i = 0; i < inputs.cables.size(); ++i) {
    inputs.cables[i].tension_n = 0.3 + 0.2 * static_cast<double>(i);
  }
  // Each another, so that none is taken for its neighbour.
  double value = 0.4;
  for (double& d : inputs.distributed) d = value += 0.1;
  for (double& s : inputs.strips_pa) s = 120.0;
  for (double& p : inputs.points) p = value += 0.1;
  for (model::MuscleInput& m : inputs.muscles) m.amplitude_n_m *= value += 0.1;
  for (double& e : inputs.envelopes) e *= value += 0.1;
  return inputs;
}

// The plant's residual M a - f at the lifted state, projected with the lifting's Jacobian, which is
// taken by differences of the lifted velocity in v (it is linear in v).
struct Projected {
  model::VectorX residual;  // for a = 0 with the lift's own acceleration J_dot v
  Eigen::MatrixXd mass;
  double power;  // of that residual on the lifted velocity
};
Projected ProjectPlant(const ReducedPlant& model, const ReducedState& s,
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
  const model::VectorX image_of_drift = image;
  out.residual = jacobian.transpose() * (image - work.force);
  out.mass.resize(n, n);
  for (int j = 0; j < n; ++j) {
    model::VectorX column = jacobian.col(j);
    ApplyMass(plant, work, column, &image);
    out.mass.col(j) = jacobian.transpose() * image;
  }
  out.power = (image_of_drift - work.force).dot(lifted.velocity);
  return out;
}

// Generalised forces with the velocities' own part, inertia, and power: what the forces and the
// inertia do on v.
struct Compared {
  double forces, inertia, power;  ///< relative differences, reduced from plant
};
Compared CompareWithPlant(const model::Robot& robot, const Reduction& reduction, unsigned seed) {
  const ReducedPlant model(robot, reduction);
  const ReducedState s = RandomReducedState(model, 1.0, seed);
  const PlantInputs inputs = SomeInputs(model);
  const Projected plant = ProjectPlant(model, s, inputs);
  ReducedWork work(model);
  ReducedJacobians jacobians(model);
  const model::VectorX zero = model::VectorX::Zero(model.velocity_count());
  EXPECT_FALSE(EvaluateResidual(model, s, zero, inputs, &work));
  Linearise(model, s, zero, inputs, true, &work, &jacobians);
  Eigen::VectorXd row = plant.mass.diagonal().cwiseSqrt();
  const Eigen::MatrixXd scale = row * row.transpose();
  // Every power that makes up the sum, so that cancellation does not flatter or blame.
  const double powers = plant.residual.cwiseProduct(s.v).cwiseAbs().sum();
  return {
      (work.residual - plant.residual).cwiseAbs().maxCoeff() / plant.residual.cwiseAbs().maxCoeff(),
      (jacobians.mass - plant.mass).cwiseQuotient(scale).cwiseAbs().maxCoeff(),
      std::abs(work.residual.dot(s.v) - plant.power) / powers};
}

// Differences of fourth order with steps of 1e-3 leave about 1e-11; the fitted polynomials 1e-9.
constexpr double kProjection = 2e-8;

TEST(ReducedDynamics, EqualsPlantProjectedOnSameStrainField) {
  const model::Robot robot = tests::ControlRobot(8, 32);
  Reduction reduction = tests::EquivalentReduction(robot);
  for (int segments : {8, 4, 2, 1}) {  // each strain constant over 1, 2, 4, 8 elements
    reduction.arms[0].segments = segments;
    for (unsigned seed : {1u, 2u, 3u}) {
      const Compared c = CompareWithPlant(robot, reduction, seed);
      EXPECT_LT(c.forces, kProjection) << segments << " segments, seed " << seed;
      EXPECT_LT(c.inertia, kProjection) << segments << " segments, seed " << seed;
      EXPECT_LT(c.power, kProjection) << segments << " segments, seed " << seed;
    }
  }
}

// Pieces, coupled strains, muscles, payloads, loads of both sources and an unsteady current.
TEST(ReducedDynamics, EqualsPlantWithAllThatAnArmMayCarry) {
  model::Robot robot = tests::ControlRobot(8, 24);
  tests::AddRichness(&robot);
  const Reduction reduction = tests::EquivalentReduction(robot);
  for (unsigned seed : {11u, 12u}) {
    const Compared c = CompareWithPlant(robot, reduction, seed);
    EXPECT_LT(c.forces, kProjection) << seed;
    EXPECT_LT(c.inertia, kProjection) << seed;
    EXPECT_LT(c.power, kProjection) << seed;
  }
}

// Two such arms, each with inputs of its own.
TEST(ReducedDynamics, EqualsPlantWithTwoArmsAndAllThatTheyMayCarry) {
  model::Robot robot = tests::ControlRobot(8, 24);
  tests::AddRichness(&robot);
  model::Arm second = robot.arms[0];
  second.name = "second";
  second.mount.position += model::Vector3(0.02, -0.01, 0.03);
  second.mount.rotation =
      second.mount.rotation * Eigen::AngleAxisd(0.8, model::Vector3(1, 2, -1).normalized());
  robot.arms.push_back(second);
  robot.arms[1].payloads.pop_back();
  const Compared c = CompareWithPlant(robot, tests::EquivalentReduction(robot), 13);
  EXPECT_LT(c.forces, kProjection);
  EXPECT_LT(c.inertia, kProjection);
  EXPECT_LT(c.power, kProjection);
}

TEST(ReducedDynamics, EqualsPlantOnAClampedRootToo) {
  model::Robot robot = tests::ControlRobot(6, 24);
  robot.root = model::ClampedRoot{};
  const Compared c = CompareWithPlant(robot, tests::EquivalentReduction(robot), 4);
  EXPECT_LT(c.forces, kProjection);
  EXPECT_LT(c.inertia, kProjection);
  EXPECT_LT(c.power, kProjection);
}

TEST(ReducedDynamics, GaussSectionsAreWhatThePlantsMeshConvergesTo) {
  // The plant's places of mass integrate to fourth order, but a section's own rotary inertia, which
  // is all that torsion moves, and cables' paths, taken at the middle of elements, to second. Eight
  // Radau points per segment have no error that shows.
  Reduction reduction;
  reduction.arms[0].segments = 2;
  reduction.arms[0].points = 8;
  reduction.mantle.cubature_tolerance = 0;
  reduction.mantle.lateral_slices = 0;
  const auto compare = [&](const StrainChoice& strains, int doubling) {
    reduction.arms[0].strains = strains;
    return CompareWithPlant(tests::ControlRobot(8 << doubling, 24), reduction, 5);
  };
  constexpr double kFourfold = 3.4;  // 4 for the second order
  Compared c[3], six[3];
  for (int i : {0, 1, 2}) {
    c[i] = compare(kFourStrains, i);
    six[i] = compare(kSixStrains, i);
  }
  for (int i : {0, 1}) {
    EXPECT_GT(c[i].forces / c[i + 1].forces, kFourfold);
    EXPECT_GT(c[i].inertia / c[i + 1].inertia, kFourfold);
    EXPECT_GT(c[i].power / c[i + 1].power, kFourfold);
    EXPECT_GT(six[i].inertia / six[i + 1].inertia, kFourfold);
  }
  constexpr double kThirtyTwo = 1e-3;  // 0.05 % of torsion's inertia is left at 32 elements
  EXPECT_LT(c[2].forces, kThirtyTwo);
  EXPECT_LT(c[2].inertia, kThirtyTwo);
  // In shear the plant's element has the residual bending besides (model/rod_element.h), GA / (1 +
  // x) with x = GA l^2 / 12 EI, 2 at 8 elements: of x / (1 + x) each halving leaves more than half,
  // at first, and in the end a quarter.
  EXPECT_GT(six[0].forces, six[1].forces);
  EXPECT_GT(six[1].forces / six[2].forces, six[0].forces / six[1].forces);
  EXPECT_GT(six[2].forces, 10.0 * c[2].forces);
}

void ExpectDerivativesMatchDifferences(const model::Robot& robot,
                                       model::CableInput reel = {.reeled = false}) {
  for (BasisKind kind : {BasisKind::kConstant, BasisKind::kLegendre}) {
    Reduction reduction;
    reduction.arms[0].basis = kind;
    reduction.arms[0].segments = 3;
    reduction.arms[0].degree = 2;
    const ReducedPlant model(robot, reduction);
    const int n = model.velocity_count();
    const ReducedState s = RandomReducedState(model, 1.0, 7);
    const model::VectorX a = tests::RandomVector(n, 3);
    PlantInputs inputs = SomeInputs(model);
    for (std::size_t i = 0; reel.reeled && i < inputs.cables.size(); ++i) {
      reel.reel_m = model.plant.cable_rest_m[i] - 0.03;  // far from slack in every state asked
      inputs.cables[i] = reel;
    }
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
          for (auto& c : in.cables) {
            (c.reeled ? c.reel_m : c.tension_n) += x(k++);
          }
          for (auto& d : in.distributed) d += x(k++);
          for (auto& p : in.strips_pa) p += x(k++);
          return at(s, a, in);
        },
        model::VectorX::Zero(model.input_count()),
        model::VectorX::Constant(model.input_count(), reel.reeled ? 1e-3 : 1.0));
    at(s, a, inputs);
    Linearise(model, s, a, inputs, true, &work, &j);
    constexpr double kDerivative = 1e-7;  // drag has kinks of |u|, whose fourth derivative is large
    EXPECT_TRUE(tests::JacobianMatches(j.stiffness, by_increment, kDerivative, 1e-9)) << "K";
    EXPECT_TRUE(tests::JacobianMatches(j.damping, by_velocity, kDerivative, 1e-9)) << "D";
    EXPECT_TRUE(tests::JacobianMatches(j.mass, by_acceleration, kDerivative, 1e-9)) << "M";
    EXPECT_TRUE(tests::JacobianMatches(j.input, by_input, kDerivative, 1e-9)) << "U";
  }
}

TEST(ReducedDynamics, DerivativesMatchDifferences) {
  model::Robot robot = tests::ControlRobot(8, 32);
  robot.arms[0].points = {
      {"tip", 0.42, model::Vector6::Ones() * 0.02, model::LoadFrame::kWorld, {}}};
  ExpectDerivativesMatchDifferences(robot);
}

TEST(ReducedDynamics, DerivativesMatchDifferencesOnReelsThatDamp) {
  model::CableInput reel;
  reel.reeled = true;
  reel.reel_rate_m_s = -0.02;
  reel.stiffness_n_m = 20.0;
  reel.damping_n_s_m = 3.0;
  ExpectDerivativesMatchDifferences(tests::ControlRobot(8, 32), reel);
}

// What sits where the arm begins moves with the root: a payload and a force there.
TEST(ReducedDynamics, EqualsPlantWithWhatSitsAtAnArmsRoot) {
  model::Robot robot = tests::ControlRobot(8, 24);
  model::Arm& arm = robot.arms[0];
  arm.points = {{"at the root", 0.0, model::Vector6::Ones() * 0.02, model::LoadFrame::kWorld, {}}};
  model::Payload payload{.name = "at the root", .mass_kg = 0.05};
  payload.offset_m = {0.004, 0.01, -0.006};
  arm.payloads = {payload};
  const Reduction reduction = tests::EquivalentReduction(robot);
  const Compared c = CompareWithPlant(robot, reduction, 21);
  EXPECT_LT(c.forces, kProjection);
  EXPECT_LT(c.inertia, kProjection);
  EXPECT_LT(c.power, kProjection);
}

TEST(ReducedDynamics, DerivativesMatchDifferencesWithAllThatAnArmMayCarry) {
  model::Robot robot = tests::ControlRobot(8, 24);
  tests::AddRichness(&robot);
  ExpectDerivativesMatchDifferences(robot);
}

}  // namespace
}  // namespace mantle::reduced
