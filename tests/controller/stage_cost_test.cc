#include "controller/stage_cost.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/controller/control_scene.h"
#include "tests/support/gradient_checker.h"

namespace mantle::controller {
namespace {

using tests::ControlScene;
using tests::DifferenceJacobian;
using tests::JacobianMatches;
using Quantity = SoftBound::Quantity;

/// Every term of a scene's goal with a weight of its own, and bounds of every quantity that a
/// moving, bent robot breaks (or, `wide`, keeps).
ControlOptions AllTerms(const ControlScene& world, bool wide = false) {
  ControlOptions o = *world.scene.control;
  o.cost.position = 3;
  o.cost.heading = 0.7;
  o.cost.velocity = 11;
  o.cost.turn_rate = world.model.plant.root_free() ? 0.4 : 0.0;
  o.cost.tip = 5;
  o.cost.volume = 2;
  o.bounds.clear();
  const auto add = [&](Quantity quantity, double low, double high, double weight) {
    o.bounds.push_back({quantity, wide ? -1e3 : low, wide ? 1e3 : high, weight});
  };
  if (world.model.mantle) {
    add(Quantity::kVolume, 0.0, 0.5, 1.5);  // above
    add(Quantity::kVolume, 1.5, 2.0, 1.6);  // below
  }
  if (world.model.plant.root_free()) {
    add(Quantity::kSpeed, 0.0, 1e-3, 1.7);
    add(Quantity::kTurnRate, 0.0, 1e-3, 1.8);
  }
  add(Quantity::kCurvature, 0.0, 1e-3, 1.9);
  return o;
}

// The state's parts of order one: curvatures of the chart act over some tenths. Round-off of the
// difference quotient over this step is 1e-12 of positions of some metres.
constexpr double kStep = 1e-3, kShare = 1e-8;

void CheckJacobian(ControlScene* world, const ReducedState& at) {
  const ControlOptions options = AllTerms(*world);
  StageCost cost(world->model, options, world->reference);
  const int columns = 2 * world->model.velocity_count();
  VectorX residual(cost.rows());
  Eigen::MatrixXd jacobian(cost.rows(), columns);
  cost.Evaluate(at, &residual, &jacobian);
  ReducedState moved = at;
  const Eigen::MatrixXd numeric = DifferenceJacobian(
      [&](const VectorX& by) {
        MoveState(at, by, &moved);
        VectorX r(cost.rows());
        cost.Evaluate(moved, &r, nullptr);
        return r;
      },
      VectorX::Zero(columns), VectorX::Constant(columns, kStep));
  // Every row of every term moves with something; the two bounds of the volume are of both sides.
  EXPECT_GT(numeric.cwiseAbs().rowwise().maxCoeff().minCoeff(), 1e-6);
  EXPECT_TRUE(JacobianMatches(jacobian, numeric, kShare, 1e-10));
  EXPECT_TRUE((residual.array() != 0.0).all()) << residual.transpose();
}

/// Bent, turned and moving with speeds that differ from axis to axis: no bound's norm is near its
/// kink.
ReducedState Tumbling(ControlScene* world) {
  ReducedState s = world->Start();
  const int n = world->model.velocity_count();
  VectorX by = VectorX::Zero(2 * n);
  const bool free = world->model.plant.root_free();
  for (std::size_t a = 0; a < world->model.arms.size(); ++a) {
    const int first = 6 + world->model.arm_first(static_cast<int>(a));
    for (int i = 0; i < world->model.arms[a].size(); ++i) by(first + i) = 0.3 + 0.05 * std::cos(i);
  }
  if (free) {
    by.head<6>() << 0.4, -0.3, 0.8, 0.2, -0.1, 0.3;
    by.segment<6>(n) << 0.5, -0.2, 0.3, 0.05, -0.04, 0.1;
  }
  ReducedState moved = s;
  MoveState(s, by, &moved);
  return moved;
}

TEST(StageCost, JacobianMatchesDifferencesAlongAPath) {
  ControlScene world("steer.toml");
  CheckJacobian(&world, Tumbling(&world));
}

TEST(StageCost, JacobianMatchesDifferencesOfACruise) {
  ControlScene world("swim.toml");
  CheckJacobian(&world, Tumbling(&world));
}

TEST(StageCost, JacobianMatchesDifferencesOfATip) {
  // The clamped root's columns are differentiated as well: the tip's place depends on its pose.
  ControlScene world("reach.toml");
  CheckJacobian(&world, Tumbling(&world));
  const ControlOptions options = AllTerms(world);
  const StageCost cost(world.model, options, world.reference);
  EXPECT_EQ(cost.rows(), 3 + 4) << "the tip and a curvature in each of four segments";
}

TEST(StageCost, ValueIsTheDefinitionsSum) {
  ControlScene world("steer.toml");
  ControlOptions options = AllTerms(world);
  const ReducedState s = Tumbling(&world);
  StageCost cost(world.model, options, world.reference);
  VectorX residual(cost.rows());
  cost.Evaluate(s, &residual, nullptr);

  const ReferencePoint ref = world.reference.At(s.time_s);
  const Vector3 w = s.v.head<3>(), v = s.v.segment<3>(3);
  reduced::VolumeFunction volume(*world.model.mantle);
  const VectorX rest = VectorX::Zero(world.model.mantle->size);
  const double open = volume.Evaluate(rest.data());
  const double share = volume.Evaluate(s.q.data() + world.model.mantle_first()) / open;
  double sum = 3 * (s.root.position - ref.position).squaredNorm();
  sum += 0.7 * (s.root.rotation * Vector3::UnitZ() - ref.direction).squaredNorm();
  sum += 11 * (s.root.rotation * v - ref.velocity).squaredNorm();
  sum += 0.4 * w.squaredNorm() + 2 * std::pow(share - 1, 2);
  sum += 1.5 * std::pow(share - 0.5, 2) + 1.6 * std::pow(share - 1.5, 2);
  sum += 1.7 * std::pow(v.norm() - 1e-3, 2) + 1.8 * std::pow(w.norm() - 1e-3, 2);
  // bending strains of constant-strain segments with four strains: coordinates 1 and 2 of each
  const int first = world.model.arm_first(0);
  const auto& groups = world.model.arms[0].basis.groups();
  for (const auto& group : groups) {
    const double bend = s.q.segment<2>(first + group.first + 1).norm();
    sum += 1.9 * std::pow(bend - 1e-3, 2);
  }
  EXPECT_NEAR(cost.Value(residual), sum, 1e-10 * sum);
}

TEST(StageCost, BoundsThatAreKeptCostNothingAndPushNowhere) {
  ControlScene world("steer.toml");
  const ControlOptions broken = AllTerms(world), kept = AllTerms(world, true);
  const ReducedState s = Tumbling(&world);
  StageCost with(world.model, broken, world.reference), cost(world.model, kept, world.reference);
  ASSERT_EQ(cost.rows(), with.rows());
  const Eigen::Index bounds = cost.rows() - (4 + 3);  // four bounds and three segments' curvatures
  VectorX residual(cost.rows()), other(cost.rows());
  Eigen::MatrixXd jacobian(cost.rows(), 2 * world.model.velocity_count());
  cost.Evaluate(s, &residual, &jacobian);
  with.Evaluate(s, &other, nullptr);
  EXPECT_EQ(residual.tail(7), VectorX::Zero(7));
  EXPECT_EQ(jacobian.bottomRows(7).cwiseAbs().maxCoeff(), 0.0);
  EXPECT_EQ(residual.head(bounds), other.head(bounds));
}

TEST(StageCost, AtRestJacobiansOfNormsAreFinite) {
  // The norm has no derivative at zero: a bound that is broken there from below pushes nowhere.
  ControlScene world("steer.toml");
  ControlOptions options = AllTerms(world);
  for (SoftBound& b : options.bounds) b.low = b.high = 10.0;
  StageCost cost(world.model, options, world.reference);
  const ReducedState rest = InitialState(world.model);
  VectorX residual(cost.rows());
  Eigen::MatrixXd jacobian(cost.rows(), 2 * world.model.velocity_count());
  cost.Evaluate(rest, &residual, &jacobian);
  EXPECT_TRUE(residual.allFinite());
  EXPECT_TRUE(jacobian.allFinite());
}

TEST(StageCost, TermsWithoutAWeightHaveNoRows) {
  ControlScene world("steer.toml");
  ControlOptions options = *world.scene.control;
  options.cost = {};
  options.bounds.clear();
  StageCost none(world.model, options, world.reference);
  EXPECT_EQ(none.rows(), 0);
  options.cost.heading = 1;
  StageCost one(world.model, options, world.reference);
  EXPECT_EQ(one.rows(), 3);
}

TEST(StageCost, InputValueIsEffortAndRate) {
  ControlScene world("reach.toml");
  ControlOptions options = *world.scene.control;
  options.cost.effort = 0.3;
  options.cost.rate = 0.05;
  StageCost cost(world.model, options, world.reference);
  VectorX u(4), rate(4);
  u << 0.1, 0.2, 0.3, 0.4;
  rate << 1, -2, 0, 0.5;
  EXPECT_NEAR(cost.InputValue(u, rate), 0.3 * 0.3 + 0.05 * 5.25, 1e-14);
}

}  // namespace
}  // namespace mantle::controller
