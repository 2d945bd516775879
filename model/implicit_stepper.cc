#include <fmt/format.h>

#include <array>
#include <cmath>
#include <cstring>

#include "model/newton_matrix.h"
#include "model/stepper.h"

/// Singly diagonally implicit Runge-Kutta methods in a chart centred at the step's start
/// (Munthe-Kaas): with g = g_n exp(Theta^) the unknowns (Theta, v) live in a vector space,
///   Theta_dot = Jr^-1(Theta) v,   M v_dot = f,
/// so the method keeps its classical order. Stage i with known parts Theta_k, v_k:
///   Theta = Theta_k + gamma h Theta_dot,  v = Jr(Theta) (Theta - Theta_k) / (gamma h),
///   v_dot = (v - v_k) / (gamma h),        residual M v_dot - f = 0 for Theta,
/// by simplified Newton iterations with a matrix kept over stages and steps while it contracts
/// well. All methods are stiffly accurate: the last stage is the step.
///
/// A method of p stages has order p and, along a linear problem, the local error C h^(p+1) v^(p+1)
/// in v (Hairer & Wanner II, IV.3: R(z) - e^z = C z^(p+1) + ...). The divided difference of v_dot
/// over the step's start and its stages is v^(p+1) / p!. Newton's iteration stops at a share of
/// that: what it leaves of Theta is 1 / (gamma h) times as large in v, and adds up step by step.

namespace mantle::model {
namespace {

struct Tableau {
  int stages;
  double gamma;
  double error_constant;  // |C| of R(z) - e^z = C z^(p+1) + ..., p = stages the order
  std::array<double, 3> c;
  std::array<std::array<double, 3>, 3> a;  // the last row is b
};

Tableau TableauOf(Integrator kind) {
  Tableau t{};
  if (kind == Integrator::kBackwardEuler) {
    t.stages = 1;
    t.gamma = 1.0;
    t.error_constant = 0.5;
    t.c = {1, 0, 0};
    t.a[0] = {1, 0, 0};
  } else if (kind == Integrator::kSdirk2) {
    const double g = 1.0 - 1.0 / std::sqrt(2.0);
    t.stages = 2;
    t.gamma = g;
    t.error_constant = std::abs(1.0 / 6.0 - g + g * g);
    t.c = {g, 1, 0};
    t.a[0] = {g, 0, 0};
    t.a[1] = {1.0 - g, g, 0};
  } else {  // root of g^3 - 3 g^2 + 3/2 g - 1/6
    const double g = 0.43586652150845899942;
    t.stages = 3;
    t.gamma = g;
    t.error_constant = std::abs(1.0 / 24.0 - 0.5 * g + 1.5 * g * g - g * g * g);
    t.c = {g, 0.5 * (1.0 + g), 1};
    t.a[0] = {g, 0, 0};
    t.a[1] = {0.5 * (1.0 - g), g, 0};
    t.a[2] = {-1.5 * g * g + 4.0 * g - 0.25, 1.5 * g * g - 5.0 * g + 1.25, g};
  }
  return t;
}

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
        tableau_(TableauOf(settings.integrator)),
        matrix_(plant),
        work_(plant),
        stage_(InitialState(plant)),
        matrix_state_(stage_) {
    const int n = plant.velocity_size();
    for (VectorX* v : {&theta_, &theta_known_, &theta_rate_, &velocity_known_, &acceleration_,
                       &residual_, &guess_, &earlier_, &error_}) {
      v->setZero(n);
    }
    for (int i = 0; i < tableau_.stages; ++i) {
      theta_rates_[i].setZero(n);
      accelerations_[i].setZero(n);
    }
    EvaluateInputs(plant, 0.0, false, &inputs_);
  }

  StepStatus Step(double h, PlantState* state, EnergyAccount* energy) override {
    if (!Attempt(h, *state, energy)) {
      matrix_valid_ = false;
      ++counters_.rejected;
      return {false, reason_};
    }
    EstimateError(h);
    for (Pose& p : stage_.pose) p.rotation.normalize();  // round-off of products, once a step
    std::swap(state->pose, stage_.pose);
    std::swap(state->shape, stage_.shape);
    state->velocity.swap(stage_.velocity);
    state->time_s += h;
    // The last two stages, this step's end last, are what the next step starts from.
    earlier_ = tableau_.stages > 1 ? accelerations_[tableau_.stages - 2] : guess_;
    earlier_s_ = tableau_.stages > 1 ? h * (1.0 - tableau_.c[tableau_.stages - 2]) : h;
    known_ = tableau_.stages > 1 || smooth_ ? 2 : 1;
    smooth_ = !settings_.input_hook;
    guess_ = accelerations_[tableau_.stages - 1];
    ++counters_.steps;
    return {};
  }

  const VectorX& acceleration() const override { return guess_; }
  const StepCounters& counters() const override { return counters_; }
  const PlantWork* end_work() const override { return &work_; }

  void Restart() override {
    matrix_valid_ = false;
    guess_.setZero();
    smooth_ = false;
    known_ = 0;
    error_rate_ = {};
  }
  void CrossBreakpoint() override { smooth_ = false; }

  std::string SaveMemory() const override {
    // The matrix is a function of the state it was made at, which is small: save that.
    std::string out;
    const auto put = [&](double x) {
      std::uint64_t bits;
      std::memcpy(&bits, &x, sizeof bits);
      out += fmt::format("{:016x} ", bits);
    };
    put(matrix_valid_ ? 1.0 : 0.0);
    put(matrix_s_);
    put(contraction_);
    put(matrix_state_.time_s);
    put(matrix_from_left_ ? 1.0 : 0.0);
    for (const Pose& p : matrix_state_.pose) {
      for (int k = 0; k < 4; ++k) put(p.rotation.coeffs()(k));
      for (int k = 0; k < 3; ++k) put(p.position(k));
    }
    for (const Vector3& q : matrix_state_.shape) {
      for (int k = 0; k < 3; ++k) put(q(k));
    }
    for (double v : matrix_state_.velocity) put(v);
    for (double v : guess_) put(v);
    for (double v : earlier_) put(v);
    for (double x : {earlier_s_, static_cast<double>(known_), smooth_ ? 1.0 : 0.0, error_rate_.root,
                     error_rate_.all}) {
      put(x);
    }
    return out;
  }

  void RestoreMemory(const std::string& memory) override {
    std::size_t at = 0;
    const auto get = [&] {
      if (at + 16 > memory.size()) throw BadRobot("checkpoint: stepper memory is too short");
      const std::uint64_t bits = std::stoull(memory.substr(at, 16), nullptr, 16);
      at += 17;
      double x;
      std::memcpy(&x, &bits, sizeof x);
      return x;
    };
    const bool valid = get() != 0.0;
    const double s = get();
    contraction_ = get();
    matrix_state_.time_s = get();
    matrix_from_left_ = get() != 0.0;
    for (Pose& p : matrix_state_.pose) {
      for (int k = 0; k < 4; ++k) p.rotation.coeffs()(k) = get();
      for (int k = 0; k < 3; ++k) p.position(k) = get();
    }
    for (Vector3& q : matrix_state_.shape) {
      for (int k = 0; k < 3; ++k) q(k) = get();
    }
    for (double& v : matrix_state_.velocity) v = get();
    for (double& v : guess_) v = get();
    for (double& v : earlier_) v = get();
    earlier_s_ = get();
    known_ = static_cast<int>(get());
    smooth_ = get() != 0.0;
    error_rate_.root = get();
    error_rate_.all = get();
    matrix_valid_ = false;
    if (!valid) return;
    Inputs(matrix_state_.time_s, matrix_from_left_);
    EvaluateForces(plant_, matrix_state_, inputs_, &work_);
    matrix_valid_ = matrix_.Factor(plant_, matrix_state_, inputs_, work_, s, 0.5);
    matrix_s_ = s;
  }

 private:
  // Largest components of an increment or a velocity, in rad and body lengths. The root has a
  // figure of its own: what is left there moves the whole robot, and is not to hide behind a fast
  // tip.
  struct Size {
    double root{0}, all{0};
  };

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

  // Local error of v. Across a break point there is no such derivative: the last estimate stays.
  void EstimateError(double h) {
    if (!smooth_) return;
    const int p = tableau_.stages;
    double scale = tableau_.error_constant * h;
    for (int k = 2; k <= p; ++k) scale *= k;
    const auto weight = [&](int i) {  // of the divided difference over 0, c_1 ... c_p
      const double at = i < 0 ? 0.0 : tableau_.c[i];
      double product = i < 0 ? 1.0 : at;
      for (int k = 0; k < p; ++k) {
        if (k != i) product *= at - tableau_.c[k];
      }
      return scale / product;
    };
    error_ = weight(-1) * guess_;
    for (int i = 0; i < p; ++i) error_ += weight(i) * accelerations_[i];
    const double power = std::pow(h, p + 1);
    error_rate_ = Measure(error_);
    error_rate_.root /= power;
    error_rate_.all /= power;
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
    if (energy != nullptr) energy->Commit();
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
    bool fresh = false;
    for (int k = 0; k <= settings_.newton_max_iterations; ++k) {
      Unpack(start, t, s);
      ++counters_.evaluations;
      if (const EvaluationFailure failure = EvaluateForces(plant_, stage_, inputs_, &work_)) {
        reason_ = failure.Message();
        return false;
      }
      if (!matrix_valid_ || std::abs(matrix_s_ / s - 1.0) > kSameStep) {
        matrix_state_.pose = stage_.pose;
        matrix_state_.shape = stage_.shape;
        matrix_state_.velocity = stage_.velocity;
        matrix_state_.time_s = t;
        matrix_from_left_ = from_left;
        matrix_s_ = s;
        ++counters_.factorisations;
        if (!matrix_.Factor(plant_, stage_, inputs_, work_, s, 0.5)) {
          reason_ = "iteration matrix is singular";
          matrix_valid_ = false;
          return false;
        }
        matrix_valid_ = fresh = true;
      }
      ApplyMass(plant_, work_, acceleration_, &residual_);
      residual_ -= work_.force;
      if (!plant_.root_free()) residual_.head<6>().setZero();
      if (residual_.isZero(0.0)) return true;
      matrix_.Solve(plant_, &residual_);
      const Size sizes = Correct();
      const double size = sizes.all;
      ++counters_.newton_iterations;
      if (!std::isfinite(size)) {
        reason_ = "Newton iteration: an increment is not finite";
        return false;
      }
      const double contraction =
          k > 0 ? size / previous : std::max(contraction_, kAssumedContraction);
      // What this correction leaves: contraction / (1 - contraction) of it.
      const double left = contraction / (1.0 - contraction);
      if ((contraction < 1.0 && sizes.all * left < tolerance.all &&
           sizes.root * left < tolerance.root) ||
          (k > 0 && size < kStall && contraction > kFailContraction)) {
        Unpack(start, t, s);
        if (k > 0) contraction_ = contraction;
        if (k > 0 && contraction > kRefreshContraction) matrix_valid_ = false;
        return true;
      }
      if (k > 0 && contraction > kPoorContraction && !fresh) {
        matrix_valid_ = false;
      } else if (k > 1 && fresh && contraction > kFailContraction && size > 1e3 * tolerance.all) {
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

  const Plant& plant_;
  StepperSettings settings_;
  Tableau tableau_;
  NewtonMatrix matrix_;
  PlantWork work_;
  PlantInputs inputs_;
  PlantState stage_, matrix_state_;
  VectorX theta_, theta_known_, theta_rate_, velocity_known_, acceleration_, residual_;
  // v_dot at the end of the last step and earlier_s_ before it, as far as they are known (known_ of
  // them), and whether the next step continues them.
  VectorX guess_, earlier_, error_;
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
