#include "controller/steering.h"

#include <gtest/gtest.h>

#include <numbers>

#include "controller/trajectory.h"
#include "reduced/outputs.h"
#include "tests/controller/steered.h"
#include "tests/reduced/reduced_robots.h"

namespace mantle::controller {
namespace {

using tests::Steered;

// The state after some seconds under one motor's tension.
ReducedState Pulled(const Steered& s, ReducedState state, int motor, double tension_n,
                    double seconds) {
  Propagator propagator(s.model, s.step);
  ReducedState next = state;
  VectorX tensions = VectorX::Zero(s.model.input_count());
  tensions(motor) = tension_n;
  constexpr double kStep_s = 0.05;
  for (int k = 0; k < std::lround(seconds / kStep_s); ++k) {
    EXPECT_TRUE(propagator.Step(state, kStep_s, tensions, &next, nullptr).ok);
    state = next;
  }
  return state;
}

TEST(Steering, AVehicleTurnsTowardsThePulledCable) {
  const auto s = tests::SteeredVehicle(tests::StraightPath());
  const Eigen::Matrix2Xd n = PullDirections(s->model, -1);
  for (int motor = 0; motor < 4; ++motor) {
    ReducedState state = InitialState(s->model);
    state.v(5) = tests::kSpeed_m_s;
    state = Pulled(*s, state, motor, 0.2, 2.0);
    const Vector2 turned = (state.root.rotation * Vector3::UnitZ()).head<2>();
    constexpr double kTurned_rad = 0.02;  // 5.5 deg/s once it is steady ([physics.md] 9)
    EXPECT_GT(turned.norm(), kTurned_rad);
    constexpr double kAligned = 0.999;  // a turn is planar
    EXPECT_GT(turned.normalized().dot(n.col(motor)), kAligned) << motor;
  }
}

TEST(Steering, ATipMovesTowardsThePulledCable) {
  const auto s = tests::SteeredTip();
  const Eigen::Matrix2Xd n = PullDirections(s->model, 0);
  const ReducedState rest = InitialState(s->model);
  Aim aim(s->model, s->reference);
  for (int motor = 0; motor < 4; ++motor) {
    const ReducedState state = Pulled(*s, rest, motor, 0.1, 1.0);
    ReducedState before = rest;
    before.time_s = state.time_s;
    // The same reference, so that what the error loses is the tip's way.
    const Vector2 way = aim.At(before, 0).error - aim.At(state, 0).error;
    constexpr double kWay_m = 0.01, kAligned = 0.999;
    EXPECT_GT(way.norm(), kWay_m);
    EXPECT_GT(way.normalized().dot(n.col(motor)), kAligned) << motor;
  }
}

TEST(Steering, MantlesAndSymmetricGangsDoNotSteer) {
  std::vector<reduced::Actuator> motors = tests::FiveMotors();
  motors[0].targets.push_back({reduced::ActuatorTarget::Kind::kCable, 2, 1.0});
  const Steered s(tests::SwimmingRobot(12, 32), motors, tests::StraightPath());
  const Eigen::Matrix2Xd n = PullDirections(s.model, -1);
  EXPECT_EQ(n.col(0).norm(), 0.0) << "opposite cables on one motor";
  EXPECT_EQ(n.col(4).norm(), 0.0) << "the mantle";
  constexpr double kRoundOff = 1e-14;
  EXPECT_NEAR(n.col(1).norm(), 1.0, kRoundOff);
}

TEST(Steering, ATurnedMountTurnsTheDirections) {
  constexpr double kTurn = 0.7;
  model::Robot robot = tests::SwimmingRobot(12, 32);
  const Steered straight(robot, tests::FiveMotors(), tests::StraightPath());
  const Eigen::Quaterniond turn(Eigen::AngleAxisd(kTurn, Vector3::UnitZ()));
  robot.arms[0].mount.rotation = turn * robot.arms[0].mount.rotation;
  const Steered turned(robot, tests::FiveMotors(), tests::StraightPath());
  const Eigen::Matrix2Xd expected =
      Eigen::Rotation2Dd(kTurn).toRotationMatrix() * PullDirections(straight.model, -1);
  constexpr double kRoundOff = 1e-14;
  EXPECT_LT((PullDirections(turned.model, -1) - expected).norm(), kRoundOff);
}

TEST(Steering, ACableThatWindsOnceRoundTheArmDoesNotSteer) {
  model::Robot robot = tests::SwimmingRobot(40, 32);
  robot.arms[0].radius_tip_m = robot.arms[0].radius_base_m;  // else the thick end wins
  robot.arms[0].cables[0].turns = 1;
  const Steered s(robot, tests::FiveMotors(), tests::StraightPath());
  EXPECT_EQ(PullDirections(s.model, -1).col(0).norm(), 0.0);
}

TEST(Steering, PullsAreSharedAmongTheMotorsThatFaceThem) {
  Eigen::Matrix2Xd n(2, 3);
  n << 1, 0, 0, 0, 1, 0;
  VectorX tensions = VectorX::Constant(3, 0.1);
  AddPull(n, {0.5, -0.3}, tensions);
  EXPECT_DOUBLE_EQ(tensions(0), 0.6);
  EXPECT_DOUBLE_EQ(tensions(1), 0.1) << "no cable pushes";
  EXPECT_DOUBLE_EQ(tensions(2), 0.1) << "no direction, no pull";
}

TEST(Steering, HeadingErrorIsTheAngleAllTheWayRound) {
  const auto s = tests::SteeredVehicle(tests::StraightPath());
  ReducedState state = InitialState(s->model);
  tests::RandomValues random(3);
  state.root = random.AnyPose(1.0);
  constexpr double kRoundOff = 1e-12;
  for (double angle = 0.01; angle < std::numbers::pi; angle += 0.1) {
    const Vector3 body(0.6 * std::sin(angle), -0.8 * std::sin(angle), std::cos(angle));
    const SteeringError e = HeadingError(state, 3.0 * (state.root.rotation * body));
    EXPECT_LT((e.error - angle * Vector2(0.6, -0.8)).norm(), kRoundOff);
  }
  const Vector3 behind = -(state.root.rotation * Vector3::UnitZ());
  EXPECT_NEAR(HeadingError(state, behind).error.norm(), std::numbers::pi, 1e-6);
}

TEST(Steering, RatesOfErrorsAreTheirDerivatives) {
  const auto vehicle = tests::SteeredVehicle(CruiseTask{});
  const auto tip = tests::SteeredTip();
  for (const Steered* s : {vehicle.get(), tip.get()}) {
    ReducedState state = tests::RandomReducedState(s->model, 0.3, 5);
    state.root.rotation.setIdentity();  // small errors: the angle's rate is that of e3
    state.time_s = 3.0;
    Aim aim(s->model, s->reference);
    const SteeringError e = aim.At(state, 0.2);
    constexpr double kDt_s = 1e-4;
    ReducedState moved[2];
    for (int side = 0; side < 2; ++side) {
      const double dt = side == 0 ? -kDt_s : kDt_s;
      VectorX by = VectorX::Zero(2 * s->model.velocity_count());
      by.head(s->model.velocity_count()) = dt * state.v;
      moved[side] = state;
      MoveState(state, by, &moved[side]);
      moved[side].time_s = state.time_s + dt;
    }
    const Vector2 rate = (aim.At(moved[1], 0.2).error - aim.At(moved[0], 0.2).error) / (2 * kDt_s);
    // The reference's own rate is a difference over 1 ms: its second derivative times half of that.
    const double tolerance = 0.1 * std::pow(2 * std::numbers::pi / 4.0, 2) * 0.5e-3 + 1e-6;
    EXPECT_LT((rate - e.rate).norm(), tolerance);
  }
}

}  // namespace
}  // namespace mantle::controller
