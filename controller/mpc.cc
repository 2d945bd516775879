#include "controller/mpc.h"

#include <algorithm>
#include <chrono>
#include <cmath>

#include "controller/active_set_solver.h"
#include "controller/gait.h"

namespace mantle::controller {
namespace {

/// Fallbacks in turn after which tensions decay.
constexpr int kMostFallbacks = 5;
/// What the plan did besides the gait fades beyond its end within this time.
constexpr double kFade_s = 1.0;
/// A stopped iterate may break a limit by this much [N]; the fast loop clips it.
constexpr double kFeasible_n = 1e-4;
constexpr int kGainCount = 4;
constexpr int kMostLinearisations = 60;
constexpr double kStandsStill_n = 1e-5;  // change of a converged plan

double Seconds(std::chrono::steady_clock::time_point since) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - since).count();
}

}  // namespace

Mpc::Mpc(const ReducedModel& model, const reduced::StepSettings& step,
         const ControlOptions& options, const Reference& reference)
    : model_(model),
      options_(options),
      reference_(reference),
      horizon_(MakeHorizon(options.grid, options.motors)),
      cost_(model, options_, reference),
      propagator_(model, step),
      trajectory_(model, horizon_),
      trial_(model, horizon_),
      history_(options.gait.period_s + options.period_s + 1.0),
      condensed_(model, horizon_, &cost_, options_),
      solver_(MakeActiveSetSolver(MakeSolver(), options.solver == SolverMethod::kActiveSet
                                                    ? FirstGuess::kNone
                                                    : FirstGuess::kOtherSolver)) {
  const int motors = model.input_count();
  deviation_.setZero(2 * model.velocity_count());
  moved_ = deviation_;
  change_.setZero(condensed_.variables());
  gait_.setZero(motors);
  gait_end_ = gait_;
  plan_.time_s.resize(horizon_.steps() + 1);
  plan_.tensions.setZero(motors, horizon_.steps() + 1);
  plan_.states = trajectory_.states;
}

void Mpc::Start(const ReducedState& state) {
  for (int k = 0; k <= horizon_.steps(); ++k) {
    plan_.time_s[k] = state.time_s + horizon_.time_s[k];
    GaitTensions(options_.gait, plan_.time_s[k], plan_.tensions.col(k));
    plan_.states[k] = state;
  }
  plan_.gains.clear();
  history_.Reset(state.time_s, state.root.position);
  counters_ = {};
  status_ = {};
  fallbacks_in_turn_ = 0;
  prepared_ = false;
}

// The plan's tensions at the nodes of a horizon that begins at start_s: what it holds, then the
// gait with what the plan had beside it fading.
void Mpc::Shift(double start_s, const Eigen::Ref<const VectorX>& tensions) {
  Eigen::MatrixXd& u = trajectory_.tensions;
  u.col(0) = tensions;
  GaitTensions(options_.gait, plan_.end_s(), gait_end_);
  for (int k = 1; k <= horizon_.steps(); ++k) {
    const double t = start_s + horizon_.time_s[k];
    if (t <= plan_.end_s()) {
      TensionsAt(plan_, t, u.col(k));
    } else {
      GaitTensions(options_.gait, t, gait_);
      const double share = std::exp((plan_.end_s() - t) / kFade_s);
      u.col(k) = gait_ + share * (plan_.tensions.rightCols<1>() - gait_end_);
    }
    LimitTensions(options_.motors, u.col(k - 1), horizon_.step(k - 1), u.col(k));
  }
}

void Mpc::Prepare(const ReducedState& expected, const Eigen::Ref<const VectorX>& tensions) {
  const auto begin = std::chrono::steady_clock::now();
  status_ = {};
  prepared_ = false;
  if (!IsFinite(expected) || !tensions.allFinite()) {
    status_.cause = "the expected state is not finite";
    ++counters_.bad_states;
  } else {
    Shift(expected.time_s, tensions);
    trajectory_.states[0] = expected;
    const reduced::StepOutcome outcome = propagator_.Roll(horizon_, true, &trajectory_);
    if (outcome.ok) {
      condensed_.Prepare(trajectory_, history_, options_.levenberg);
      prepared_ = true;
      status_.linearisations = 1;
    } else {
      status_.cause = outcome.cause;
    }
  }
  status_.prepare_s = Seconds(begin);
}

void Mpc::Restart(const ReducedState& start, const Eigen::Ref<const VectorX>& tensions) {
  const double before_s = status_.prepare_s;
  Prepare(start, tensions);
  status_.prepare_s += before_s;
  ++counters_.restarts;
}

const MpcStatus& Mpc::Solve(const ReducedState& start, std::int64_t deadline_ns) {
  const auto begin = std::chrono::steady_clock::now();
  ++counters_.solves;
  if (!IsFinite(start)) {
    status_.cause = "the measured state is not finite";
    ++counters_.bad_states;
    prepared_ = false;
  }
  if (!prepared_) {
    FallBack();
  } else if (options_.mode == MpcMode::kConverged) {
    SolveConverged(start, deadline_ns);
  } else {
    StateDifference(trajectory_.states[0], start, deviation_);
    condensed_.SetInitialDeviation(deviation_);
    SolveOnce(deadline_ns);
    if (status_.outcome <= Outcome::kStoppedBetter) {
      Accept(result_.x, start);
    } else {
      FallBack();
    }
  }
  prepared_ = false;
  status_.solve_s = Seconds(begin);
  Count();
  return status_;
}

void Mpc::SolveOnce(std::int64_t deadline_ns) {
  SolveOptions o;
  o.max_iterations = options_.max_iterations;
  o.deadline_ns = deadline_ns;
  solver_->Solve(condensed_, o, &result_);
  status_.solver = result_.status;
  status_.iterations += result_.iterations;
  status_.stationarity = result_.stationarity;
  status_.infeasibility = result_.infeasibility;
  status_.complementarity = result_.complementarity;
  if (result_.usable()) {
    status_.outcome = Outcome::kSolved;
  } else if (result_.x.allFinite() && condensed_.Violation(result_.x) < kFeasible_n &&
             condensed_.Model(result_.x) < 0.0) {
    status_.outcome = Outcome::kStoppedBetter;
  } else {
    status_.outcome = Outcome::kShifted;
    status_.cause = "the solver's iterate is no better than the shifted plan";
  }
}

// Gauss-Newton with the true cost as judge: a change that does not lower it is damped and solved
// again.
void Mpc::SolveConverged(const ReducedState& start, std::int64_t deadline_ns) {
  trajectory_.states[0] = start;
  double levenberg = options_.levenberg;
  bool better = false;
  status_.outcome = Outcome::kShifted;
  status_.cause = "the plan could not be improved";
  deviation_.setZero();
  const auto roll = [&](Trajectory* t) { return propagator_.Roll(horizon_, true, t).ok; };
  if (!roll(&trajectory_)) {
    status_.cause = "the model could not be rolled from the measured state";
    FallBack();
    return;
  }
  double cost = condensed_.Cost(trajectory_, history_);
  condensed_.Prepare(trajectory_, history_, levenberg);
  for (int i = 0; i < kMostLinearisations; ++i) {
    condensed_.SetInitialDeviation(deviation_);
    SolveOnce(deadline_ns);
    ++status_.linearisations;
    if (status_.outcome > Outcome::kStoppedBetter) break;
    const double size = result_.x.cwiseAbs().maxCoeff();
    trial_.states[0] = trajectory_.states[0];
    trial_.tensions = trajectory_.tensions;
    AddChange(horizon_, result_.x, &trial_.tensions);
    const bool rolled = roll(&trial_);
    const double now = rolled ? condensed_.Cost(trial_, history_) : kInfinity;
    if (now <= cost) {
      std::swap(trajectory_, trial_);
      cost = now;
      better = true;
      levenberg = std::max(0.25 * levenberg, 1e-6);
    } else if (size > kStandsStill_n) {
      levenberg = 8 * levenberg + 1e-6;
    }
    condensed_.Prepare(trajectory_, history_, levenberg);
    if (size < kStandsStill_n) break;
    if (status_.solver == SolveStatus::kDeadline) break;
  }
  if (status_.outcome == Outcome::kShifted) {
    if (!better) {
      FallBack();
      return;
    }
    status_.outcome = Outcome::kStoppedBetter;
  }
  change_.setZero();
  condensed_.SetInitialDeviation(deviation_);
  Accept(change_, start);
  status_.cost = cost;
}

// The plan becomes the trajectory changed by w, its states moved by the linearised dynamics.
void Mpc::Accept(const Eigen::Ref<const VectorX>& w, const ReducedState& start) {
  status_.cause = nullptr;
  fallbacks_in_turn_ = 0;
  plan_.tensions = trajectory_.tensions;
  AddChange(horizon_, w, &plan_.tensions);
  for (int k = 1; k <= horizon_.steps(); ++k) {
    LimitTensions(options_.motors, plan_.tensions.col(k - 1), horizon_.step(k - 1),
                  plan_.tensions.col(k));
  }
  StateDifference(trajectory_.states[0], start, deviation_);
  plan_.states[0] = start;
  plan_.time_s[0] = trajectory_.states[0].time_s;
  for (int k = 0; k < horizon_.steps(); ++k) {
    const reduced::StepJacobian& j = trajectory_.jacobians[k];
    gait_ = 0.5 * (plan_.tensions.col(k) + plan_.tensions.col(k + 1) - trajectory_.tensions.col(k) -
                   trajectory_.tensions.col(k + 1));
    moved_.noalias() = j.state * deviation_;
    moved_.noalias() += j.input * gait_;
    deviation_ = moved_;
    MoveState(trajectory_.states[k + 1], deviation_, &plan_.states[k + 1]);
    plan_.time_s[k + 1] = plan_.time_s[0] + horizon_.time_s[k + 1];
  }
  condensed_.Gains(w, result_, kGainCount, &plan_.gains);
  status_.cost = condensed_.Model(w);
}

// The old plan goes on (its nodes lie where they lay); after too many in turn, it ends gently.
void Mpc::FallBack() {
  ++fallbacks_in_turn_;
  status_.outcome = fallbacks_in_turn_ > kMostFallbacks ? Outcome::kSafe : Outcome::kShifted;
}

void Mpc::Count() {
  counters_.fallbacks_in_turn = static_cast<std::uint64_t>(fallbacks_in_turn_);
  switch (status_.outcome) {
    case Outcome::kSolved:
      ++counters_.solved;
      break;
    case Outcome::kStoppedBetter:
      ++counters_.stopped_better;
      break;
    case Outcome::kShifted:
      ++counters_.shifted;
      break;
    case Outcome::kSafe:
      ++counters_.safe;
      break;
  }
  if (status_.solver == SolveStatus::kDeadline) ++counters_.deadline_misses;
  constexpr double kBin_s = 0.125e-3;
  const double bins = std::max((status_.solve_s + status_.prepare_s) / kBin_s, 1.0);
  const auto bin = std::min<std::size_t>(static_cast<std::size_t>(std::log2(bins)),
                                         counters_.time_histogram.size() - 1);
  ++counters_.time_histogram[bin];
  ++counters_.iteration_histogram[std::min<std::size_t>(
      static_cast<std::size_t>(status_.iterations), counters_.iteration_histogram.size() - 1)];
}

std::string_view ToString(Outcome outcome) {
  switch (outcome) {
    case Outcome::kSolved:
      return "solved";
    case Outcome::kStoppedBetter:
      return "stopped, better than the shifted plan";
    case Outcome::kShifted:
      return "shifted plan";
    case Outcome::kSafe:
      break;
  }
  return "tensions decay";
}

}  // namespace mantle::controller
