#include "model/implicit_stepper.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>

/// Steps, their error, and what a restart needs.

namespace mantle::model {

ImplicitStepper::ImplicitStepper(const Plant& plant, const StepperSettings& settings)
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
                     &residual_, &guess_, &earlier_, &error_, &start_, &matrix_acceleration_}) {
    v->setZero(n);
  }
  for (int i = 0; i < tableau_.stages; ++i) {
    theta_rates_[i].setZero(n);
    accelerations_[i].setZero(n);
  }
  EvaluateInputs(plant, 0.0, false, &inputs_);
}

StepStatus ImplicitStepper::Step(double h, PlantState* state, EnergyAccount* energy) {
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

void ImplicitStepper::Restart() {
  matrix_valid_ = false;
  reels_.Forget();
  guess_.setZero();
  smooth_ = false;
  known_ = 0;
  error_rate_ = {};
}

template <typename Number>
void ImplicitStepper::WalkMemory(Number number) {
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
  for (VectorX* v : {&matrix_state_.velocity, &matrix_acceleration_, &guess_, &earlier_}) {
    for (double& x : *v) number(x);
  }
  reels_.Walk(number);
}

std::string ImplicitStepper::SaveMemory() const {
  std::string out;
  const_cast<ImplicitStepper*>(this)->WalkMemory([&](double x) {
    std::uint64_t bits;
    std::memcpy(&bits, &x, sizeof bits);
    out += fmt::format("{:016x} ", bits);
  });
  return out;
}

void ImplicitStepper::RestoreMemory(const std::string& memory) {
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
  matrix_valid_ = matrix_.Factor(plant_, matrix_state_, reels_.ForMatrixAgain(), work_,
                                 matrix_acceleration_, matrix_s_, 0.5);
}

void ImplicitStepper::Inputs(double t, bool from_left) {
  EvaluateInputs(plant_, t, from_left, &inputs_);
  if (settings_.input_hook) settings_.input_hook(t, from_left, &inputs_);
}

bool ImplicitStepper::FindStart(const PlantState& state) {
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

void ImplicitStepper::EstimateError(double h) {
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

double ImplicitStepper::ErrorRatio(double h, const VectorX& start_velocity) {
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

ImplicitStepper::Size ImplicitStepper::Measure(const VectorX& x) const {
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

void ImplicitStepper::Guess(int stage, double h, VectorX* guess) const {
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

bool ImplicitStepper::Attempt(double h, const PlantState& start, EnergyAccount* energy) {
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

std::unique_ptr<Stepper> MakeImplicitStepper(const Plant& plant, const StepperSettings& settings) {
  return std::make_unique<ImplicitStepper>(plant, settings);
}

}  // namespace mantle::model
