#include "model/static_newton.h"

#include <fmt/format.h>

#include <cmath>
#include <utility>

namespace mantle::model {
namespace {

constexpr double kSmallestDamping = 1.0 / 16.0;
// Increments this small that no longer shrink are round-off: of positions of size 1 under strains
// that are 1e-8 to 1e-10 of what they move. Above it round-off cannot be the reason.
constexpr double kRoundOff = 1e-8;
constexpr double kStalled = 0.5;  // an iteration that leaves more of an increment has stalled

}  // namespace

StaticNewton::StaticNewton(const StaticProblem& problem, double tolerance, int max_iterations)
    : state(problem.Reference()),
      problem_(problem),
      tolerance_(tolerance),
      max_iterations_(max_iterations),
      matrix_(problem.plant()),
      work_(problem.plant()),
      next_work_(problem.plant()),
      probe_work_(problem.plant()),
      trial_(state),
      next_(state) {
  const int n = problem.plant().velocity_size();
  load_force_.setZero(n);
  for (VectorX* v : {&path_step_, &path_by_load_, &way_, &foreseen_, &travelled_}) {
    v->setZero(problem.path_size());
  }
}

StaticNewton::Outcome StaticNewton::Fail(Outcome outcome, std::string reason) {
  reason_ = std::move(reason);
  return outcome;
}

bool StaticNewton::Factor(double shift_1_s) {
  return matrix_.FactorAtRest(problem_.plant(), trial_, inputs_, work_, shift_1_s);
}

// df/dlambda at trial_, by central differences of loads that are linear in lambda.
void StaticNewton::LoadDerivative(double factor) {
  constexpr double kProbe = 1e-4;
  load_force_.setZero();
  for (double sign : {1.0, -1.0}) {
    problem_.Evaluate(factor + sign * kProbe, &trial_, &next_inputs_, &probe_work_);
    load_force_ += (sign / (2.0 * kProbe)) * probe_work_.force;
  }
  problem_.Evaluate(factor, &trial_, &inputs_, &work_);
}

// Newton's step for a force; on a plane the returned change of the load factor keeps (or
// brings) the iterate there.
double StaticNewton::Solve(const Plane* plane, const VectorX& force, StaticStep* step) {
  problem_.Solve(force, &matrix_, step);
  if (plane == nullptr) return 0.0;
  problem_.PathIncrement(*step, &path_step_);
  const double load =
      (plane_left_ - plane->normal->dot(path_step_)) / plane->normal->dot(path_by_load_);
  step->zeta += load * by_load_.zeta;
  step->strain += load * by_load_.strain;
  return load;
}

StaticNewton::Outcome StaticNewton::Iterate(double factor, const Plane* plane) {
  last_ = 0;
  if (const auto failure = problem_.Evaluate(factor, &trial_, &inputs_, &work_)) {
    return Fail(Outcome::kNotAState, failure.Message());
  }
  plane_left_ = plane != nullptr ? plane->length - plane->normal->dot(travelled_) : 0.0;
  for (int k = 0; k < max_iterations_; ++k) {
    if (plane != nullptr) LoadDerivative(factor);
    if (!Factor(shift_1_s)) return Fail(Outcome::kSingular, "the stiffness matrix is singular");
    ++iterations_;
    ++last_;
    if (plane != nullptr) {
      problem_.Solve(load_force_, &matrix_, &by_load_);
      problem_.PathIncrement(by_load_, &path_by_load_);
    }
    const double load = Solve(plane, work_.force, &step_);
    size_ = problem_.Size(step_.zeta);
    if (!std::isfinite(size_)) return Fail(Outcome::kSingular, "an increment is not finite");
    problem_.PathIncrement(step_, &path_step_);
    if (k == 0 && plane == nullptr) foreseen_ = path_step_;
    way_ = path_step_;
    const double left = plane_left_;
    double alpha = 1.0, bar = 0.0;
    EvaluationFailure failure;
    while (true) {
      problem_.Move(trial_, step_, alpha, &next_);
      failure = problem_.Evaluate(factor + alpha * load, &next_, &next_inputs_, &next_work_);
      bar = std::numeric_limits<double>::infinity();
      if (!failure) {
        plane_left_ = 0.0;
        Solve(plane, next_work_.force, &bar_);
        plane_left_ = (1.0 - alpha) * left;
        bar = problem_.Size(bar_.zeta);
        const bool small = size_ < tolerance_ || (size_ < kRoundOff && bar < kRoundOff);
        if (small || bar <= (1.0 - 0.25 * alpha) * size_) break;
      }
      // The largest step that a quadratic model of the level allows (Deuflhard, eq. 3.48).
      const double quadratic = (bar_.zeta - (1.0 - alpha) * step_.zeta).cwiseAbs().maxCoeff();
      const double best = failure || !(quadratic > 0.0)
                              ? 0.0
                              : 0.5 * alpha * alpha * step_.zeta.cwiseAbs().maxCoeff() / quadratic;
      alpha = std::max(std::min(best, 0.5 * alpha), 0.2 * alpha);
      if (alpha < kSmallestDamping) {
        if (failure) return Fail(Outcome::kNotAState, failure.Message());
        contraction_ = bar / size_;
        return Fail(
            Outcome::kDiverged,
            fmt::format("no part of Newton's step brings it nearer (increment {:.2g} rad or "
                        "body lengths, then {:.2g})",
                        size_, bar));
      }
    }
    travelled_ += alpha * way_;
    factor += alpha * load;
    std::swap(trial_, next_);
    std::swap(work_, next_work_);
    std::swap(inputs_, next_inputs_);
    contraction_ = size_ > 0.0 ? bar / size_ : 0.0;
    const bool stalled = size_ < kRoundOff && bar > kStalled * size_;
    if ((alpha == 1.0 && bar < tolerance_) || size_ < tolerance_ || stalled) {
      state = trial_;
      load_factor = factor;
      return Outcome::kConverged;
    }
  }
  if (contraction_ > kStalled && size_ < 1e-5) {
    return Fail(Outcome::kRoundOff,
                fmt::format("increments stay at {:.1e} rad or body lengths", size_));
  }
  return Fail(Outcome::kIterations,
              fmt::format("{} iterations leave an increment of {:.1e} rad or body lengths "
                          "(contraction {:.2g})",
                          max_iterations_, size_, contraction_));
}

StaticNewton::Outcome StaticNewton::AtLoad(double factor) {
  trial_ = state;
  travelled_.setZero();
  return Iterate(factor, nullptr);
}

StaticNewton::Outcome StaticNewton::AlongPath(const VectorX& normal, double length,
                                              const StaticStep& tangent, double load_step) {
  trial_ = state;
  if (const auto failure = problem_.Evaluate(load_factor, &trial_, &inputs_, &work_)) {
    return Fail(Outcome::kNotAState, failure.Message());
  }
  problem_.PathIncrement(tangent, &foreseen_);
  foreseen_ *= load_step;
  travelled_ = foreseen_;
  problem_.Move(state, tangent, load_step, &trial_);
  const Plane plane{&normal, length};
  return Iterate(load_factor + load_step, &plane);
}

bool StaticNewton::Tangent(StaticStep* by_load, VectorX* path) {
  trial_ = state;
  if (problem_.Evaluate(load_factor, &trial_, &inputs_, &work_)) return false;
  LoadDerivative(load_factor);
  if (!Factor(shift_1_s)) return false;
  problem_.Solve(load_force_, &matrix_, by_load);
  problem_.PathIncrement(*by_load, path);
  return path->allFinite();
}

int StaticNewton::NegativeEigenvalues() {
  trial_ = state;
  if (problem_.Evaluate(load_factor, &trial_, &inputs_, &work_) || !Factor(shift_1_s)) return -1;
  return matrix_.NegativeEigenvalues();
}

}  // namespace mantle::model
