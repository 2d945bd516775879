#include <gtest/gtest.h>

#include <limits>
#include <numbers>
#include <string>

#include "reduced/build/simulation.h"
#include "tests/reduced/reduced_robots.h"
#include "tests/support/gradient_checker.h"

// Cases at the edge of what the model can be asked: each either succeeds with finite numbers or is
// refused with a body and a cause.

namespace mantle::reduced {
namespace {

using model::PlantInputs;
using tests::RandomReducedState;

PlantInputs SomeInputs(const ReducedPlant& model) {
  PlantInputs inputs;
  EvaluateInputs(model.plant, 0.0, false, &inputs);
  for (std::size_t i = 0; i < inputs.cables.size(); ++i) {
    inputs.cables[i].tension_n = 0.1 + 0.1 * static_cast<double>(i);
  }
  for (double& s : inputs.strips_pa) s = 200.0;
  return inputs;
}

bool AllFinite(const ReducedState& s) {
  return s.q.allFinite() && s.v.allFinite() && s.root.position.allFinite() &&
         s.root.rotation.coeffs().allFinite();
}
bool AllFinite(const StepJacobian& j) {
  return j.state.allFinite() && j.input.allFinite() && j.step.allFinite();
}

// One step: finite, with finite derivatives, or refused in words. Returns whether it succeeded.
bool SaneStep(const ReducedPlant& model, const ReducedState& from, double h, ReducedState* to) {
  StepWork work(model);
  StepJacobian jacobian(model);
  const PlantInputs inputs = SomeInputs(model);
  const StepOutcome o = TakeStep(model, {}, h, from, inputs, inputs, &work, to, &jacobian);
  if (!o.ok) {
    EXPECT_TRUE(o.body != nullptr && o.cause != nullptr);
    return false;
  }
  EXPECT_TRUE(AllFinite(*to));
  EXPECT_TRUE(AllFinite(jacobian));
  return true;
}

// A second of steps of at most 50 ms from a bent, moving state, halved where one is refused: must
// reach its end, with finite derivatives at every step.
void ExpectRuns(const model::Robot& robot, const Reduction& reduction, double size,
                const std::string& what) {
  SCOPED_TRACE(what);
  const ReducedPlant model(robot, reduction);
  ReducedState s = RandomReducedState(model, size, 3), next = s;
  double t = 0, h = 0.05;
  for (int tries = 0; t < 1.0 - 1e-9; ++tries) {
    ASSERT_LT(tries, 400) << "at t = " << t << ", steps of " << h;
    if (SaneStep(model, s, h, &next)) {
      s = next;
      t += h;
      h = std::min(2 * h, std::min(0.05, 1.0 - t));
    } else {
      h *= 0.5;
    }
  }
}

model::Robot Vehicle() { return tests::ControlRobot(8, 24); }

TEST(ReducedHardCases, ZeroStrainAtRest) { ExpectRuns(Vehicle(), {}, 0.0, "rest"); }

TEST(ReducedHardCases, HundredTimesSofterAndStiffer) {
  for (double factor : {0.01, 100.0}) {
    model::Robot arm = Vehicle();
    arm.arms[0].material.young_pa *= factor;
    ExpectRuns(arm, {}, 0.3, "arm, times " + std::to_string(factor));
  }
  model::Robot stiff = Vehicle();
  stiff.mantle->material.young_pa *= 100;
  Reduction r;
  r.mantle.static_pressures_pa = {16e3, 32.5e3};
  ExpectRuns(stiff, r, 0.3, "mantle, times 100");
}

TEST(ReducedHardCases, SoftMantleUnderAPressureBeyondItsCollapseIsRefusedOrFinite) {
  model::Robot soft = Vehicle();
  soft.mantle->material.young_pa *= 0.01;  // 200 Pa is then 40 times the collapse load
  Reduction r;
  r.mantle.static_pressures_pa = {1.6, 3.25};
  const ReducedPlant model(soft, r);
  ReducedState s = RandomReducedState(model, 0.3, 3), next = s;
  for (int i = 0; i < 20; ++i) {
    if (!SaneStep(model, s, 0.05, &next)) return;
    s = next;
  }
}

TEST(ReducedHardCases, AnyAddedMassRatio) {
  for (double ratio : {0.1, 1.0, 10.0, 100.0}) {
    model::Robot robot = Vehicle();
    robot.arms[0].added_mass_coefficient = ratio;
    robot.mantle->added_mass_coefficient = ratio;
    ExpectRuns(robot, {}, 0.3, "ratio " + std::to_string(ratio));
  }
}

TEST(ReducedHardCases, FullTaper) {
  for (double tip_m : {1e-3, 1e-5, 1e-7}) {
    model::Robot robot = Vehicle();
    robot.arms[0].radius_tip_m = tip_m;
    for (auto& cable : robot.arms[0].cables) cable.end_m = 0.3;
    ExpectRuns(robot, {}, 0.3, "tip of " + std::to_string(1e6 * tip_m) + " um");
  }
  model::Robot point = Vehicle();
  point.arms[0].radius_tip_m = 0.0;
  EXPECT_THROW(ReducedPlant(point, {}), model::BadRobot);
}

TEST(ReducedHardCases, StrainThroughPiAndTwoPiPerSegment) {
  constexpr double kPi = std::numbers::pi;
  for (BasisKind kind : {BasisKind::kConstant, BasisKind::kLegendre}) {
    Reduction r;
    r.arms[0].basis = kind;
    r.arms[0].segments = 2;
    r.arms[0].degree = 1;
    const ReducedPlant model(Vehicle(), r);
    for (double turn : {kPi, 2 * kPi, 6 * kPi}) {
      for (double off : {-1e-3, -1e-8, 0.0, 1e-8, 1e-3}) {
        SCOPED_TRACE(turn + off);
        ReducedState s = InitialState(model), next = s;
        s.q(2) = (turn + off) / 0.21;  // bending of the first segment, back in the second
        if (kind == BasisKind::kConstant) s.q(6) = -s.q(2);
        EXPECT_TRUE(SaneStep(model, s, 1e-3, &next));
      }
    }
  }
}

// An arm bent through a full turn has no singularity there: the residual is smooth across it.
TEST(ReducedHardCases, NothingJumpsAtPiAndTwoPi) {
  Reduction r;
  r.arms[0].segments = 2;
  const ReducedPlant model(Vehicle(), r);
  ReducedWork work(model);
  const PlantInputs inputs = SomeInputs(model);
  const model::VectorX a = tests::RandomVector(model.velocity_count(), 6);
  for (double turn : {std::numbers::pi, 2 * std::numbers::pi}) {
    ReducedState s = RandomReducedState(model, 0.3, 4);
    const auto residual = [&](double off) -> Eigen::VectorXd {
      s.q(1) = 0;
      s.q(2) = (turn + off) / 0.21;
      EXPECT_FALSE(EvaluateResidual(model, s, a, inputs, &work));
      return work.residual;
    };
    const Eigen::VectorXd below = residual(-1e-6), at = residual(0.0), above = residual(1e-6);
    constexpr double kSmooth = 1e-9;  // second difference over 1e-6: curvature times 1e-12
    EXPECT_LT((below - 2 * at + above).norm(), kSmooth * at.norm()) << turn;
  }
}

// Drag is |u| u: its derivative at rest is zero, and the limit of those nearby.
TEST(ReducedHardCases, ZeroVelocityHasFiniteDragDerivatives) {
  const ReducedPlant model(Vehicle(), {});
  model::Robot dry_robot = Vehicle();
  dry_robot.effects.drag = false;
  dry_robot.effects.lateral_drag.reset();
  dry_robot.effects.named.Get<model::RollDrag>().reset();
  dry_robot.effects.named.Get<model::RigidDrag>().reset();
  const ReducedPlant dry(dry_robot, {});
  const int n = model.velocity_count();
  const model::VectorX zero = model::VectorX::Zero(n);
  const PlantInputs inputs = SomeInputs(model);
  const auto damping = [&](const ReducedPlant& m, double speed) -> Eigen::MatrixXd {
    ReducedState s = RandomReducedState(m, 0.3, 8);
    s.v *= speed;
    ReducedWork work(m);
    ReducedJacobians j(m);
    EXPECT_FALSE(EvaluateResidual(m, s, zero, inputs, &work));
    Linearise(m, s, zero, inputs, true, &work, &j);
    EXPECT_TRUE(j.damping.allFinite() && j.stiffness.allFinite() && j.mass.allFinite());
    return j.damping;
  };
  const Eigen::MatrixXd rest = damping(model, 0.0);
  constexpr double kRoundOff = 1e-12;
  EXPECT_LT((rest - damping(dry, 0.0)).cwiseAbs().maxCoeff(),
            kRoundOff * rest.cwiseAbs().maxCoeff());
  // Linear in the speed: halving it halves the distance to that at rest.
  const double far = (damping(model, 1e-3) - rest).norm();
  const double near = (damping(model, 5e-4) - rest).norm();
  constexpr double kLinear = 0.02;
  EXPECT_NEAR(near / far, 0.5, kLinear);
  ExpectRuns(Vehicle(), {}, 0.0, "steps from rest");
}

TEST(ReducedHardCases, MantleVolumeNearZeroIsFiniteOrRefusedWithAReason) {
  const ReducedPlant model(Vehicle(), {});
  ReducedState s = InitialState(model), next = s;
  ReducedWork work(model);
  ReducedJacobians jacobians(model);
  const PlantInputs inputs = SomeInputs(model);
  const model::VectorX zero = model::VectorX::Zero(model.velocity_count());
  // Along the static shapes inwards, from open to turned inside out.
  const model::VectorX inwards = model.mantle->basis.equilibria.back();
  int refused = 0, accepted = 0;
  double smallest = std::numeric_limits<double>::infinity();
  for (double x = 0; x < 12; x += 0.02) {
    s.q.segment(model.mantle_first(), model.mantle->size) = x * inwards;
    s.v.tail(model.mantle->size) = inwards;
    const ReducedFailure failure = EvaluateResidual(model, s, zero, inputs, &work);
    if (failure) {
      ++refused;
      EXPECT_STREQ(failure.body, "mantle");
    } else {
      ++accepted;
      smallest = std::min(smallest, work.mantle[0].volume_m3);
      Linearise(model, s, zero, inputs, true, &work, &jacobians);
      EXPECT_TRUE(jacobians.stiffness.allFinite() && jacobians.damping.allFinite() &&
                  jacobians.mass.allFinite() && jacobians.input.allFinite());
    }
    const bool stepped = SaneStep(model, s, 0.01, &next);
    EXPECT_FALSE(stepped && x > 11.0) << "turned inside out";
  }
  EXPECT_GT(accepted, 10);
  EXPECT_GT(refused, 10) << "a volume or a radius below zero";
  EXPECT_LT(smallest, 0.5 * model.plant.shell->rest_volume_m3);
}

TEST(ReducedHardCases, NotANumberIsRefused) {
  const ReducedPlant model(Vehicle(), {});
  const double nan = std::nan("");
  const int n = model.velocity_count();
  ReducedState to = InitialState(model);
  for (int i = 0; i < n + model.coordinate_count(); ++i) {
    ReducedState s = InitialState(model);
    (i < n ? s.v(i) : s.q(i - n)) = nan;
    EXPECT_FALSE(SaneStep(model, s, 0.05, &to)) << i;
  }
  PlantInputs inputs = SomeInputs(model);
  inputs.cables[0].tension_n = nan;
  StepWork work(model);
  EXPECT_FALSE(
      TakeStep(model, {}, 0.05, InitialState(model), inputs, inputs, &work, &to, nullptr).ok);
}

}  // namespace
}  // namespace mantle::reduced
