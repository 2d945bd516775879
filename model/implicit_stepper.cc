#include <fmt/format.h>

#include <array>
#include <cmath>
#include <cstring>

#include "model/newton_matrix.h"
#include "model/reel_tensions.h"
#include "model/sdirk.h"

/// Singly diagonally implicit Runge-Kutta methods in a chart centred at the step's start
/// (Munthe-Kaas): with g = g_n exp(Theta^) the unknowns (Theta, v) live in a vector space,
///   Theta_dot = Jr^-1(Theta) v,   M v_dot = f,
/// so the method keeps its classical order. Stage i with known parts Theta_k, v_k:
///   Theta = Theta_k + gamma h Theta_dot,  v = Jr(Theta) (Theta - Theta_k) / (gamma h),
///   v_dot = (v - v_k) / (gamma h),        residual M v_dot - f = 0 for Theta,
/// by simplified Newton iterations with a matrix kept over stages and steps while it contracts
/// well. All methods are stiffly accurate: the last stage is the step.
///
/// Newton's iteration stops at a share of the step's own error (model/sdirk.h): what it leaves of
/// Theta is 1 / (gamma h) times as large in v, and adds up step by step. Reeled cables' tensions
/// are unknowns of their own (model/reel_tensions.h).

namespace mantle::model {
namespace {

// A matrix that contracts worse than kPoorContraction is made anew within the stage, one that
// contracts worse than kRefreshContraction before the next; the step is given up when even a matrix
// of the stage itself does not contract.
constexpr double kPoorContraction = 0.1;
constexpr double kRefreshContraction = 0.03;
constexpr double kFailContraction = 0.9;
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
class ImplicitStepper final : public Stepper {
 public:
  ImplicitStepper(const Plant& plant, const StepperSettings& settings)
      : plant_(plant),
        settings_(settings),
        tableau_(SdirkOf(settings.integrator)),
        matrix_(plant),
        work_(plant),
        reels_(plant),
        stage_(InitialState(plant)),
        matrix_state_(stage_) {
    const int n = plant.velocity_size();
    for (VectorX* v : {&theta_, &theta_known_, &theta_rate_, &velocity_known_, &acceleration_,
                       &residual_, &guess_, &earlier_, &error_, &start_}) {
      v->setZero(n);
    }
    for (int i = 0; i < tableau_.stages; ++i) {
      theta_rates_[i].setZero(n);
      accelerations_[i].setZero(n);
    }
    EvaluateInputs(plant, 0.0, false, &inputs_);
  }

  StepStatus Step(double h, PlantState* state, EnergyAccount* energy) override {
    if (settings_.step_tolerance > 0.0 && !FindStart(*state)) return {false, reason_};
    if (!Attempt(h, *state, energy)) {
      matrix_valid_ = false;
      reels_.Forget();
      ++counters_.rejected;
      return {false, reason_};
    }
    EstimateError(h);
    const double ratio = ErrorRatio(h, state->velocity);
    if (ratio > 1.0) {
      ++counters_.rejected;
      return {false,
              fmt::format("a step of {:.3g} s has an estimated error of {:.3g}, bound "
                          "time.tolerance = {:.3g}",
                          h, ratio * settings_.step_tolerance, settings_.step_tolerance),
              ratio};
    }
    if (energy != nullptr) energy->Commit();
    for (Pose& p : stage_.pose) p.rotation.normalize();  // round-off of products, once a step
    std::swap(state->pose, stage_.pose);
    std::swap(state->shape, stage_.shape);
    state->velocity.swap(stage_.velocity);
    state->time_s += h;
    reels_.Accept();
    // The last two stages, this step's end last, are what the next step starts from.
    earlier_ = tableau_.stages > 1 ? accelerations_[tableau_.stages - 2] : guess_;
    earlier_s_ = tableau_.stages > 1 ? h * (1.0 - tableau_.c[tableau_.stages - 2]) : h;
    known_ = tableau_.stages > 1 || smooth_ ? 2 : 1;
    smooth_ = !settings_.input_hook;
    guess_ = accelerations_[tableau_.stages - 1];
    start_ = guess_;
    ++counters_.steps;
    return {true, {}, ratio};
  }

  const VectorX& acceleration() const override { return guess_; }
  const StepCounters& counters() const override { return counters_; }
  const PlantWork* end_work() const override { return &work_; }

  void Restart() override {
    matrix_valid_ = false;
    reels_.Forget();
    guess_.setZero();
    smooth_ = false;
    known_ = 0;
    error_rate_ = {};
  }
  void CrossBreakpoint() override { smooth_ = false; }

  std::string SaveMemory() const override {
    std::string out;
    const_cast<ImplicitStepper*>(this)->WalkMemory([&](double x) {
      std::uint64_t bits;
      std::memcpy(&bits, &x, sizeof bits);
      out += fmt::format("{:016x} ", bits);
    });
    return out;
  }

  void RestoreMemory(const std::string& memory) override {
    std::size_t at = 0;
    WalkMemory([&](double& x) {
      if (at + 16 > memory.size()) throw BadRobot("checkpoint: stepper memory is too short");
      const std::uint64_t bits = std::stoull(memory.substr(at, 16), nullptr, 16);
      at += 17;
      std::memcpy(&x, &bits, sizeof x);
    });
    start_ = guess_;
    if (!matrix_valid_) return;
    Inputs(matrix_state_.time_s, matrix_from_left_);
    EvaluateForces(plant_, matrix_state_, reels_.GivenOfMatrix(inputs_), &work_);
    matrix_valid_ =
        matrix_.Factor(plant_, matrix_state_, reels_.ForMatrixAgain(), work_, matrix_s_, 0.5);
  }

 private:
  // Largest components of an increment or a velocity, in rad and body lengths. The root has a
  // figure of its own: what is left there moves the whole robot, and is not to hide behind a fast
  // tip.
  struct Size {
    double root{0}, all{0};
  };

  // Every number a restart needs, to save it or to restore it. The matrix is a function of the
  // state it was made at, which is small.
  template <typename Number>
  void WalkMemory(Number number) {
    const auto flag = [&](bool* b) {
      double x = *b ? 1.0 : 0.0;
      number(x);
      *b = x != 0.0;
    };
    flag(&matrix_valid_);
    flag(&matrix_from_left_);
    flag(&smooth_);
    double known = known_;
    number(known);
    known_ = static_cast<int>(known);
    for (double* x : {&matrix_s_, &contraction_, &matrix_state_.time_s, &earlier_s_,
                      &error_rate_.root, &error_rate_.all}) {
      number(*x);
    }
    for (Pose& p : matrix_state_.pose) {
      for (int k = 0; k < 4; ++k) number(p.rotation.coeffs()(k));
      for (int k = 0; k < 3; ++k) number(p.position(k));
    }
    for (Vector3& q : matrix_state_.shape) {
      for (int k = 0; k < 3; ++k) number(q(k));
    }
    for (VectorX* v : {&matrix_state_.velocity, &guess_, &earlier_}) {
      for (double& x : *v) number(x);
    }
    reels_.Walk(number);
  }

  void Inputs(double t, bool from_left) {
    EvaluateInputs(plant_, t, from_left, &inputs_);
    if (settings_.input_hook) settings_.input_hook(t, from_left, &inputs_);
  }

  // Of increments, from the error of the steps so far.
  Size Tolerance(double h) const {
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

  // Error-controlled steps need the acceleration at their start also where it is not the last
  // step's.
  bool FindStart(const PlantState& state) {
    if (smooth_) return true;
    Inputs(state.time_s, false);
    ++counters_.evaluations;
    if (const EvaluationFailure failure = EvaluateForces(plant_, state, inputs_, &work_)) {
      reason_ = failure.Message();
      return false;
    }
    SolveAcceleration(plant_, inputs_, &work_, &start_);
    return true;
  }

  // Local error of v in error_. Across a break point there is no derivative to take it from: what
  // Newton's iteration goes by stays.
  void EstimateError(double h) {
    if (!smooth_ && settings_.step_tolerance == 0.0) return;
    error_ = (h * tableau_.error[0]) * start_;
    for (int i = 0; i < tableau_.stages; ++i)
      error_ += (h * tableau_.error[i + 1]) * accelerations_[i];
    if (!smooth_) return;
    const double power = std::pow(h, tableau_.stages + 1);
    error_rate_ = Measure(error_);
    error_rate_.root /= power;
    error_rate_.all /= power;
  }

  // Of the step's error to step_tolerance. What is faster than the step is damped by the method,
  // and in the estimate by A^-1 s^2 M (Hairer & Wanner II, IV.8).
  double ErrorRatio(double h, const VectorX& start_velocity) {
    if (settings_.step_tolerance == 0.0) return 0.0;
    const double s = 1.0 / (tableau_.gamma * h);
    ApplyMass(plant_, work_, error_, &residual_);
    residual_ *= s * s;
    if (!plant_.root_free()) residual_.head<6>().setZero();
    matrix_.Solve(plant_, &residual_);
    theta_known_ = (h * tableau_.error[0]) * start_velocity;
    for (int i = 0; i < tableau_.stages; ++i)
      theta_known_ += (h * tableau_.error[i + 1]) * theta_rates_[i];
    return std::max(Measure(residual_).all, Measure(theta_known_).all) / settings_.step_tolerance;
  }

  Size Measure(const VectorX& x) const {
    double angular = 0, linear = 0;
    Size size;
    const auto pose = [&](int at) {
      angular = std::max(angular, x.segment<3>(at).cwiseAbs().maxCoeff());
      linear = std::max(linear, x.segment<3>(at + 3).cwiseAbs().maxCoeff());
    };
    if (plant_.root_free()) pose(0);
    size.root = std::max(angular, linear / plant_.body_length_m);
    for (int a = 0; a < static_cast<int>(plant_.rods.size()); ++a) {
      for (int k = 1; k <= plant_.rods[a].element_count(); ++k) pose(plant_.ArmVelocity(a, k));
    }
    for (int j = 0; j < plant_.shape_count(); ++j) {
      const int at = plant_.ShellVelocity(j);
      linear = std::max(linear, x.segment<2>(at).cwiseAbs().maxCoeff());
      angular = std::max(angular, std::abs(x(at + 2)));
    }
    size.all = std::max(angular, linear / plant_.body_length_m);
    return size;
  }

  // v_dot at time c h of the step, extrapolated through the last two stages.
  void Guess(int stage, double h, VectorX* guess) const {
    const VectorX& last = stage == 0 ? guess_ : accelerations_[stage - 1];
    *guess = last;
    if (stage == 0) {
      if (!smooth_ || known_ < 2) return;
      *guess += (tableau_.c[0] * h / earlier_s_) * (guess_ - earlier_);
    } else {
      const double from = stage > 1 ? tableau_.c[stage - 2] : 0.0;
      if (stage == 1 && (!smooth_ || known_ < 1)) return;
      const VectorX& before = stage > 1 ? accelerations_[stage - 2] : guess_;
      *guess += ((tableau_.c[stage] - tableau_.c[stage - 1]) / (tableau_.c[stage - 1] - from)) *
                (last - before);
    }
  }

  bool Attempt(double h, const PlantState& start, EnergyAccount* energy) {
    if (energy != nullptr) energy->Begin();
    const double s = 1.0 / (tableau_.gamma * h);
    for (int i = 0; i < tableau_.stages; ++i) {
      theta_known_.setZero();
      velocity_known_ = start.velocity;
      for (int j = 0; j < i; ++j) {
        theta_known_ += (h * tableau_.a[i][j]) * theta_rates_[j];
        velocity_known_ += (h * tableau_.a[i][j]) * accelerations_[j];
      }
      const bool from_left = tableau_.c[i] == 1.0;
      const double t = start.time_s + tableau_.c[i] * h;
      Inputs(t, from_left);
      Guess(i, h, &acceleration_);
      theta_ = theta_known_ + (1.0 / s) * (velocity_known_ + (1.0 / s) * acceleration_);
      if (!SolveStage(start, t, from_left, s)) return false;
      theta_rates_[i] = theta_rate_;
      accelerations_[i] = acceleration_;
      if (energy != nullptr) {
        energy->EvaluatePowers(plant_, stage_, inputs_, work_, acceleration_);
        energy->Accumulate(h * tableau_.a[tableau_.stages - 1][i]);
      }
    }
    return true;
  }

  // From theta_: stage_ (pose, shape, velocity), theta_rate_ and acceleration_.
  void Unpack(const PlantState& start, double t, double s) {
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

  // theta_ -= Jr^-1(theta) zeta, zeta in residual_; returns its scaled size.
  Size Correct() {
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

  bool SolveStage(const PlantState& start, double t, bool from_left, double s) {
    const Size tolerance = Tolerance(1.0 / (s * tableau_.gamma));
    double previous = 0;
    bool fresh = false, verified = false;
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
        fresh = true;
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
      bool done = contraction < 1.0 && sizes.all * left < tolerance.all &&
                  sizes.root * left < tolerance.root;
      done = reels_.Correct(left) && done;
      if (done || stalled) {
        if (verified || !reels_.MaySwitch(work_, s, size * plant_.body_length_m)) {
          Unpack(start, t, s);
          if (since > 0) contraction_ = contraction;
          if (since > 0 && contraction > kRefreshContraction) matrix_valid_ = false;
          return true;
        }
        verified = true;
      }
      if (since > 0 && contraction > kPoorContraction && !fresh) {
        matrix_valid_ = false;
      } else if (since > 1 && fresh && contraction > kFailContraction &&
                 size > 1e3 * tolerance.all) {
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

  // Forces at stage_ under the tensions as they are taken.
  bool Evaluate() {
    ++counters_.evaluations;
    const EvaluationFailure failure = EvaluateForces(plant_, stage_, reels_.Given(), &work_);
    if (failure) reason_ = failure.Message();
    return !failure;
  }

  bool Factor(double t, bool from_left, double s) {
    matrix_state_.pose = stage_.pose;
    matrix_state_.shape = stage_.shape;
    matrix_state_.velocity = stage_.velocity;
    matrix_state_.time_s = t;
    matrix_from_left_ = from_left;
    matrix_s_ = s;
    ++counters_.factorisations;
    matrix_valid_ = matrix_.Factor(plant_, stage_, reels_.ForMatrix(), work_, s, 0.5);
    if (!matrix_valid_) reason_ = "iteration matrix is singular";
    reels_.TakeWeights(plant_, matrix_);
    return matrix_valid_;
  }

  const Plant& plant_;
  StepperSettings settings_;
  Sdirk tableau_;
  NewtonMatrix matrix_;
  PlantWork work_;
  PlantInputs inputs_;
  ReelTensions reels_;
  PlantState stage_, matrix_state_;
  VectorX theta_, theta_known_, theta_rate_, velocity_known_, acceleration_, residual_;
  // v_dot at the end of the last step and earlier_s_ before it, as far as they are known (known_ of
  // them), and whether the next step continues them.
  VectorX guess_, earlier_, error_;
  VectorX start_;  // v_dot where the step starts, from the right
  double earlier_s_{0};
  int known_{0};
  bool smooth_{false};
  Size error_rate_;  // local error of v over h^(p+1); zero where it is not known
  std::array<VectorX, 3> theta_rates_, accelerations_;
  StepCounters counters_;
  std::string reason_;
  double matrix_s_{0}, contraction_{0.1};
  bool matrix_valid_{false}, matrix_from_left_{false};
};

}  // namespace

std::unique_ptr<Stepper> MakeImplicitStepper(const Plant& plant, const StepperSettings& settings) {
  return std::make_unique<ImplicitStepper>(plant, settings);
}

}  // namespace mantle::model
