#include <algorithm>
#include <cmath>

#include "reduced/step_solver.h"

namespace mantle::reduced {

namespace {

constexpr double kGamma2 = 0.29289321881345254;  // 1 - 1/sqrt(2): L-stable SDIRK2 (Alexander 1977)
// Newton: a contraction above this makes a new matrix (Broyden's first corrections may overshoot
// where the jet turns round, and a matrix costs as much as several residuals); increments growing
// that much give up.
constexpr double kPoorContraction = 2.0;
constexpr double kDivergence = 1e6;
constexpr double kAssumedContraction = 0.1;
constexpr double kAssumedCurvature = 10.0;  // with a new matrix the error squares, times this
constexpr double kLargestShare = 0.8;  // of the last step that Broyden's correction may add again
constexpr int kHalvings = 8;           // of a step into a shape that cannot be
constexpr int kUpdates = 12;           // kept

}  // namespace

Scheme SchemeOf(StepScheme scheme) {
  if (scheme == StepScheme::kBackwardEuler) return {1, 1.0, 0.0};
  return {2, kGamma2, 1.0 - kGamma2};
}

double FirstStageTime(StepScheme scheme) { return SchemeOf(scheme).gamma; }

StepJacobian::StepJacobian(const ReducedModel& model) {
  const int n = model.velocity_count();
  state.setZero(2 * n, 2 * n);
  input.setZero(2 * n, model.input_count());
  step.setZero(2 * n);
  if (!model.root_free()) support.setZero(2 * n, 6);
}

StepStages::StepStages(const ReducedModel& model) {
  for (VectorX& y : increment) y.setZero(model.velocity_count());
}

StepWork::StepWork(const ReducedModel& model)
    : evaluation_(model), jacobians_(model), lu_(model.velocity_count()) {
  const int n = model.velocity_count();
  const int columns = PanelColumns(2 * n + model.input_count() + 1);
  for (Stage& s : stages_) {
    for (VectorX* v : {&s.y, &s.y_known, &s.y_rate, &s.v_known, &s.acceleration}) v->setZero(n);
    s.state = InitialState(model);
    for (Panel* m : {&s.y_by, &s.rate_by}) m->setZero(n, columns);
    s.root.setZero(6, columns);
  }
  matrix_.setZero(n, n);
  weighted_.setZero(n, n);
  left_.setZero(n, n + 6);
  right_.setZero(n + 6, columns);
  increment_.setZero(n);
  last_.setZero(n);
  steps_.setZero(n, kUpdates);
  norms_.setZero(kUpdates);
  root_rows_.setZero(6, columns);
  scale_.setOnes(n);
  scale_.segment<3>(3) /= model.body_length_m;
  for (int a = 0; a < static_cast<int>(model.arms.size()); ++a) {
    scale_.segment(6 + model.arm_first(a), model.arms[a].size())
        .setConstant(model.robot.arms[a].length_m);
  }
  if (model.mantle) {
    scale_.segment(6 + model.mantle_first(), model.mantle->size) =
        model.mantle->basis.scale.cwiseInverse();
  }
}

bool StepSolver::Solve(bool derivatives, const StepStages* guess, StepOutcome* outcome) {
  have_matrix_ = false;
  for (int i = 0; i < scheme_.stages; ++i) {
    StepWork::Stage& s = work_.stages_[i];
    if (i == 0) {
      s.y_known.setZero();
      s.v_known = from_.v;
    } else {
      const StepWork::Stage& p = work_.stages_[0];
      s.y_known = (h_ * scheme_.a21) * p.y_rate;
      s.v_known = from_.v + (h_ * scheme_.a21) * p.acceleration;
    }
    if (guess != nullptr) {
      s.y = guess->increment[i];
    } else {  // the rate goes on as it was
      s.y = s.y_known + (1.0 / sigma_) * (i == 0 ? s.v_known : work_.stages_[0].y_rate);
    }
    if (!SolveStage(i, derivatives, outcome)) return false;
    if (!derivatives) continue;
    Correct(i);
    if (!Differentiate(i)) {
      return Fail(outcome, "the stage's matrix is singular: smallest pivot", 0.0, 0.0);
    }
  }
  return true;
}

void StepSolver::Remember(StepStages* stages) const {
  for (int i = 0; i < scheme_.stages; ++i) stages->increment[i] = work_.stages_[i].y;
  stages->known = true;
}

void StepSolver::Finish(ReducedState* to) const {
  work_.end_ = scheme_.stages - 1;
  const StepWork::Stage& s = work_.stages_[work_.end_];
  to->time_s = from_.time_s + h_;
  to->root = s.state.root;
  to->root.rotation.normalize();
  to->q = s.state.q;
  to->v = s.state.v;
}

bool StepSolver::Fail(StepOutcome* outcome, const char* cause, double value, double bound) const {
  static_cast<ReducedFailure&>(*outcome) = {model_.robot.name.c_str(), -1, cause, value, bound};
  outcome->ok = false;
  return false;
}

void StepSolver::Unpack(int i) {
  StepWork::Stage& s = work_.stages_[i];
  s.y_rate = sigma_ * (s.y - s.y_known);
  s.state.q = from_.q + s.y.tail(n_ - 6);
  s.state.v = s.y_rate;
  if (free_) {
    const model::PoseAndTwist moved = model::ExpAndTangent(s.y.head<6>(), s.y_rate.head<6>());
    s.state.root = from_.root * moved.pose;
    s.state.v.head<6>() = moved.twist;
  } else {
    s.state.root = inputs_[InputIndex(i)]->root_pose;
    s.state.v.head<6>() = inputs_[InputIndex(i)]->root_twist;
  }
  s.acceleration = sigma_ * (s.state.v - s.v_known);
  if (!free_) s.acceleration.head<6>() = inputs_[InputIndex(i)]->root_acceleration;
}

bool StepSolver::SolveStage(int i, bool derivatives, StepOutcome* outcome) {
  StepWork::Stage& s = work_.stages_[i];
  double previous = 0;
  int updates = 0;
  for (int k = 0; k < settings_.max_iterations; ++k) {
    Unpack(i);
    // A shape that cannot be: go back half way, a few times.
    for (int half = 0; !Evaluate(i, outcome); ++half) {
      if (k == 0 || half == kHalvings) return false;
      outcome->ok = true;
      work_.last_ *= 0.5;
      s.y -= work_.last_;
      have_matrix_ = false;
      Unpack(i);
    }
    const bool fresh = !have_matrix_;
    if (fresh) {
      Factor(i, false);
      have_matrix_ = true;
      updates = 0;
    }
    VectorX& step = work_.increment_;
    step = -work_.evaluation_.residual;
    if (!free_) step.head<6>().setZero();
    work_.lu_.Solve(&step);
    step.array() *= work_.scale_.array();
    for (int j = 0; j + 1 < updates; ++j) {
      step += work_.steps_.col(j + 1) * (work_.steps_.col(j).dot(step) / work_.norms_(j));
    }
    if (updates > 0) {
      const double share = work_.steps_.col(updates - 1).dot(step) / work_.norms_(updates - 1);
      if (share < kLargestShare) step /= 1.0 - share;
    }
    const double size = step.cwiseAbs().maxCoeff();
    if (!std::isfinite(size) || size > kDivergence) {
      return Fail(outcome, "Newton's iteration diverges, take a shorter step: increment", size,
                  kDivergence);
    }
    work_.last_.array() = step.array() / work_.scale_.array();
    s.y += work_.last_;
    ++outcome->iterations;
    const double contraction = fresh ? std::min(kAssumedContraction, kAssumedCurvature * size)
                                     : (k > 0 ? size / previous : kAssumedContraction);
    if (contraction < 1.0 && size * contraction < settings_.tolerance * (1.0 - contraction)) {
      Unpack(i);
      return !derivatives || Evaluate(i, outcome);
    }
    if (updates == work_.steps_.cols() || (k > 0 && size > kPoorContraction * previous)) {
      have_matrix_ = false;
    } else {
      work_.steps_.col(updates) = step;
      work_.norms_(updates++) = step.squaredNorm();
    }
    previous = size;
  }
  return Fail(outcome, "Newton's iteration does not converge, take a shorter step: increment",
              previous, settings_.tolerance);
}

bool StepSolver::Evaluate(int i, StepOutcome* outcome) {
  StepWork::Stage& s = work_.stages_[i];
  const ReducedFailure failure = EvaluateResidual(model_, s.state, s.acceleration,
                                                  *inputs_[InputIndex(i)], &work_.evaluation_);
  if (!failure) return true;
  static_cast<ReducedFailure&>(*outcome) = failure;
  outcome->ok = false;
  return false;
}

StepOutcome TakeStep(const ReducedModel& model, const StepSettings& settings, double h,
                     const ReducedState& from, const PlantInputs& first, const PlantInputs& last,
                     StepWork* work, ReducedState* to, StepJacobian* jacobian, StepStages* stages) {
  StepOutcome outcome;
  if (from.q.size() != model.coordinate_count() || from.v.size() != model.velocity_count()) {
    outcome.ok = false;
    outcome.body = model.robot.name.c_str();
    outcome.cause = "the state has the wrong size for this model";
    outcome.value = static_cast<double>(from.v.size());
    outcome.bound = model.velocity_count();
    return outcome;
  }
  if (!(h > 0.0) || !std::isfinite(h)) {
    outcome.ok = false;
    outcome.body = model.robot.name.c_str();
    outcome.cause = "the step must be positive";
    outcome.value = h;
    return outcome;
  }
  StepSolver solver(model, settings, h, from, first, last, work);
  const bool derivatives = jacobian != nullptr;
  bool solved = false;
  if (stages != nullptr && stages->known) {
    stages->known = false;
    solved = solver.Solve(derivatives, stages, &outcome);
    if (!solved) {
      const int iterations = outcome.iterations;
      outcome = {};
      outcome.iterations = iterations;
    }
  }
  if (!solved && !solver.Solve(derivatives, nullptr, &outcome)) return outcome;
  if (stages != nullptr) solver.Remember(stages);
  solver.Finish(to);
  if (jacobian != nullptr) solver.FinishJacobian(jacobian);
  return outcome;
}

}  // namespace mantle::reduced
