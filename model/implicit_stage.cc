#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "model/implicit_stepper.h"

/// Newton's iteration of a stage.

namespace mantle::model {
namespace {

// A matrix that contracts worse than kPoorContraction is made anew within the stage, at most
// kMostMatrices times; one that contracts worse than kRefreshContraction before the next. Far from
// the solution a matrix of the stage's own start contracts poorly too; one made where the iteration
// has come to then converges quadratically. The step is given up when even such a matrix does not
// contract.
constexpr double kPoorContraction = 0.1;
constexpr double kRefreshContraction = 0.03;
constexpr double kFailContraction = 0.9;
constexpr int kMostMatrices = 3;
// What the first iteration of a stage is taken to contract by at best, before it has been seen.
constexpr double kAssumedContraction = 0.1;
// A first step, of which nothing is known yet, is solved to kFirstTolerance in increments [rad,
// body lengths], in proportion to the cube of the step (what is left in the velocity falls with the
// square); steps whose inputs come from a hook, which may jump every time, to kHookTolerance in
// proportion to the step. Both are meant for steps of kToleranceStep_s and longer.
constexpr double kFirstTolerance = 1e-11;
constexpr double kHookTolerance = 1e-8;
constexpr double kToleranceStep_s = 0.01;
// A root that (nearly) rests by symmetry is not solved below this share of what moves.
constexpr double kRootShare = 1e-3;
// Increments are not solved below this, nor below kRoundOff of themselves.
constexpr double kFloor = 1e-15;
constexpr double kRoundOff = 1e-14;
// An iteration that stalls below this stalls at the round-off of the forces.
constexpr double kStall = 1e-12;
// Steps whose sizes differ by less share a matrix.
constexpr double kSameStep = 1e-9;

}  // namespace

ImplicitStepper::Size ImplicitStepper::Tolerance(double h) const {
  const double length = std::min(1.0, h / kToleranceStep_s);
  const double unknown =
      settings_.input_hook ? kHookTolerance * length : kFirstTolerance * length * length * length;
  Size out{unknown, unknown};
  if (error_rate_.all > 0.0) {
    const double share =
        settings_.newton_tolerance * tableau_.gamma * h * std::pow(h, tableau_.stages + 1);
    out = {share * std::max(error_rate_.root, kRootShare * error_rate_.all),
           share * error_rate_.all};
  }
  const double floor = std::max(kFloor, kRoundOff * theta_.cwiseAbs().maxCoeff());
  return {std::max(out.root, floor), std::max(out.all, floor)};
}

void ImplicitStepper::Unpack(const PlantState& start, double t, double s) {
  stage_.time_s = t;
  theta_rate_ = s * (theta_ - theta_known_);
  VectorX& v = stage_.velocity;
  const auto move = [&](int pose, int at) {
    const PoseAndTwist m = ExpAndTangent(theta_.segment<6>(at), theta_rate_.segment<6>(at));
    stage_.pose[pose] = start.pose[pose] * m.pose;
    v.segment<6>(at) = m.twist;
  };
  move(0, 0);
  for (int a = 0; a < static_cast<int>(plant_.rods.size()); ++a) {
    const Rod& rod = plant_.rods[a];
    stage_.pose[plant_.ArmPose(a, 0)] = plant_.exact() ? stage_.pose[0] * rod.mount : rod.mount;
    for (int k = 1; k <= rod.element_count(); ++k) {
      move(plant_.ArmPose(a, k), plant_.ArmVelocity(a, k));
    }
  }
  for (int j = 0; j < plant_.shape_count(); ++j) {
    stage_.shape[j] = start.shape[j] + theta_.segment<3>(plant_.ShellVelocity(j));
  }
  const int shape = 3 * plant_.shape_count();
  v.tail(shape) = theta_rate_.tail(shape);
  ImposeRoot(plant_, inputs_, &stage_);
  acceleration_ = s * (v - velocity_known_);
  if (!plant_.root_free()) acceleration_.head<6>() = inputs_.root_acceleration;
}

ImplicitStepper::Size ImplicitStepper::Correct() {
  const auto pose = [&](int at) {
    const Vector6 zeta = residual_.segment<6>(at);
    const Vector6 theta = theta_.segment<6>(at);
    theta_.segment<6>(at) -= TangentOperatorInverseTimes(theta, zeta);
  };
  if (plant_.root_free()) pose(0);
  for (int a = 0; a < static_cast<int>(plant_.rods.size()); ++a) {
    for (int k = 1; k <= plant_.rods[a].element_count(); ++k) pose(plant_.ArmVelocity(a, k));
  }
  for (int j = 0; j < plant_.shape_count(); ++j) {
    const int at = plant_.ShellVelocity(j);
    theta_.segment<3>(at) -= residual_.segment<3>(at);
  }
  return Measure(residual_);
}

bool ImplicitStepper::Evaluate() {
  ++counters_.evaluations;
  const EvaluationFailure failure = EvaluateForces(plant_, stage_, reels_.Given(), &work_);
  if (failure) reason_ = failure.Message();
  return !failure;
}

bool ImplicitStepper::Factor(double t, bool from_left, double s) {
  matrix_state_.pose = stage_.pose;
  matrix_state_.shape = stage_.shape;
  matrix_state_.velocity = stage_.velocity;
  matrix_state_.time_s = t;
  matrix_acceleration_ = acceleration_;
  matrix_from_left_ = from_left;
  matrix_s_ = s;
  ++counters_.factorisations;
  matrix_valid_ = matrix_.Factor(plant_, stage_, reels_.ForMatrix(), work_, acceleration_, s, 0.5);
  if (!matrix_valid_) reason_ = "iteration matrix is singular";
  reels_.TakeWeights(plant_, matrix_);
  return matrix_valid_;
}

bool ImplicitStepper::SolveStage(const PlantState& start, double t, bool from_left, double s) {
  const Size tolerance = Tolerance(1.0 / (s * tableau_.gamma));
  double previous = 0;
  bool verified = false;
  int matrices = 0;
  int since = 0;  // iterations since the set of taut cables changed
  reels_.Begin(inputs_);
  for (int k = 0; k <= settings_.newton_max_iterations; ++k, ++since) {
    Unpack(start, t, s);
    if (!Evaluate()) return false;
    if (reels_.Switch(work_)) {
      matrix_valid_ = false;
      since = 0;
      if (!Evaluate()) return false;
    }
    if (!matrix_valid_ || std::abs(matrix_s_ / s - 1.0) > kSameStep) {
      if (!Factor(t, from_left, s)) return false;
      ++matrices;
    }
    ApplyMass(plant_, work_, acceleration_, &residual_);
    residual_ -= work_.force;
    if (!plant_.root_free()) residual_.head<6>().setZero();
    if (residual_.isZero(0.0) && reels_.residual_vanishes()) return true;
    matrix_.Solve(plant_, &residual_, reels_.residual());
    const Size sizes = Correct();
    const double size = sizes.all;
    ++counters_.newton_iterations;
    if (!std::isfinite(size)) {
      reason_ = "Newton iteration: an increment is not finite";
      return false;
    }
    const double contraction =
        since > 0 ? size / previous : std::max(contraction_, kAssumedContraction);
    // What this correction leaves: contraction / (1 - contraction) of it.
    const double left = contraction / (1.0 - contraction);
    const bool stalled = since > 0 && size < kStall && contraction > kFailContraction;
    bool done =
        contraction < 1.0 && sizes.all * left < tolerance.all && sizes.root * left < tolerance.root;
    // Poses are seen, and tensions with them, at the step's end.
    const bool ends = from_left;
    done = reels_.Correct(left, ends ? left * size * plant_.body_length_m : 0.0, s) && done;
    if (done || stalled) {
      if (verified || !reels_.MaySwitch(work_, s, size * plant_.body_length_m)) {
        Unpack(start, t, s);
        if (since > 0) contraction_ = contraction;
        if (since > 0 && contraction > kRefreshContraction) matrix_valid_ = false;
        return true;
      }
      verified = true;
    }
    if (since > 0 && contraction > kPoorContraction && matrices < kMostMatrices) {
      matrix_valid_ = false;
    } else if (since > 1 && contraction > kFailContraction && size > 1e3 * tolerance.all) {
      reason_ = fmt::format(
          "Newton iteration does not converge at t = {:.6g} s, h = {:.3g} s (contraction {:.2g}, "
          "last increment {:.2g})",
          t, 1.0 / (s * tableau_.gamma), contraction, size);
      return false;
    }
    previous = size;
  }
  reason_ = fmt::format("Newton iteration: {} iterations at t = {:.6g} s did not reach {:.1g}",
                        settings_.newton_max_iterations, t, tolerance.all);
  return false;
}

}  // namespace mantle::model
