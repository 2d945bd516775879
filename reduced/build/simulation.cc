#include "reduced/build/simulation.h"

#include <fmt/format.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "model/start_state.h"

namespace mantle::reduced {
namespace {

constexpr double kSameTime_s = 1e-12;
constexpr int kSettling = 60;       // Newton's iterations to the model's own equilibrium
constexpr double kSettled = 1e-12;  // relative change of the coordinates
// A start that the coordinates miss by more is told of: share of the body's length, and rad.
constexpr double kMissedLength = 0.01, kMissedAngle_rad = 0.05;
constexpr double kMoving = 1e-12;  // velocity relative to a rigid robot's: above round-off

}  // namespace

ReducedRunSettings RunSettingsOf(const model::RunSettings& run, const Reduction& reduction) {
  ReducedRunSettings s;
  s.duration_s = run.duration_s;
  s.step_s = reduction.step_s;
  s.min_step_s = std::min(run.min_step_s, reduction.step_s);
  s.output_interval_s = run.output_interval_s;
  s.statics = run.statics;
  s.step.scheme = reduction.scheme;
  s.step.tolerance = reduction.tolerance;
  return s;
}

ReducedSimulation::ReducedSimulation(const ReducedPlant& model, const ReducedRunSettings& settings)
    : model_(model),
      settings_(settings),
      state_(InitialState(model)),
      next_(state_),
      work_(model),
      evaluation_(model),
      jacobians_(model),
      projection_(model),
      lifted_(InitialState(model.plant)),
      plant_work_(model.plant),
      acceleration_(VectorX::Zero(model.velocity_count())),
      plant_acceleration_(VectorX::Zero(model.plant.velocity_size())),
      step_cap_(settings.step_s),
      guard_(model) {
  const model::PlantState start = model::StartState(model.plant, settings.statics);
  projection_.Lift(state_, &lifted_);
  double moved = (start.velocity - lifted_.velocity).cwiseAbs().maxCoeff();
  for (std::size_t i = 0; i < start.pose.size(); ++i) {
    const Vector6 d = model::LogSE3(model::Inverse(lifted_.pose[i]) * start.pose[i]);
    moved = std::max(moved, d.cwiseAbs().maxCoeff());
  }
  for (std::size_t j = 0; j < start.shape.size(); ++j) {
    moved = std::max(moved, (start.shape[j] - lifted_.shape[j]).cwiseAbs().maxCoeff());
  }
  if (moved <= kMoving) return;
  if (!projection_.Project(start, &state_)) {
    throw model::BadRobot(
        "initial shape and velocities: cannot be projected onto the reduced coordinates");
  }
  if (model.robot.initial == model::InitialShape::kEquilibrium) {
    Settle();
  } else {
    CompareStart(start);
  }
}

// How far the shape that the run starts in is from the one that the scene gives.
void ReducedSimulation::CompareStart(const model::PlantState& start) {
  projection_.Lift(state_, &lifted_);
  double distance_m = 0, angle_rad = 0;
  for (std::size_t i = 0; i < start.pose.size(); ++i) {
    const Vector6 d = model::LogSE3(model::Inverse(lifted_.pose[i]) * start.pose[i]);
    angle_rad = std::max(angle_rad, d.head<3>().norm());
    distance_m = std::max(distance_m, (start.pose[i].position - lifted_.pose[i].position).norm());
  }
  if (distance_m < kMissedLength * model_.plant.body_length_m && angle_rad < kMissedAngle_rad) {
    return;
  }
  start_warnings_.push_back(fmt::format(
      "initial shape: the reduced coordinates miss it by {:.3g} m and {:.3g} rad, bounds {:.3g} m "
      "and {:.3g} rad: the run starts in the nearest shape that they have; more of reduced.arms' "
      "strains or segments come nearer",
      distance_m, angle_rad, kMissedLength * model_.plant.body_length_m, kMissedAngle_rad));
}

// From the plant's equilibrium to the model's own: R(q) = 0 at rest in the earth, by Newton.
void ReducedSimulation::Settle() {
  const int n = model_.coordinate_count();
  const VectorX rest = VectorX::Zero(model_.velocity_count());
  const VectorX moving = state_.v;
  EvaluateInputs(model_.plant, state_.time_s, false, &first_);
  const model::WaterMotion water = EvaluateWater(model_.robot.effects, state_.time_s);
  first_.water_acceleration_m_s2.setZero();
  state_.v.setZero();
  state_.v.segment<3>(3) = -(state_.root.rotation.conjugate() * water.velocity_m_s);
  for (int k = 0; k < kSettling; ++k) {
    if (const ReducedFailure failure =
            EvaluateResidual(model_, state_, rest, first_, &evaluation_)) {
      throw model::BadRobot("robot.initial = \"static\": reduced model: " + failure.Message());
    }
    Linearise(model_, state_, rest, first_, false, &evaluation_, &jacobians_);
    const VectorX step = jacobians_.stiffness.bottomRightCorner(n, n).partialPivLu().solve(
        evaluation_.residual.tail(n));
    if (!step.allFinite()) break;
    state_.q -= step;
    const double size = step.cwiseAbs().maxCoeff() / (1.0 + state_.q.cwiseAbs().maxCoeff());
    if (size < kSettled) {
      state_.v = moving;
      return;
    }
  }
  throw model::BadRobot(
      "robot.initial = \"static\": the reduced model finds no equilibrium of its own near the "
      "plant's; more segments, or another basis, bring it nearer");
}

model::StepStatus ReducedSimulation::AdvanceTo(double t_s) {
  if (const std::string complaint = SizeComplaint(model_, state_); !complaint.empty()) {
    return {false, fmt::format("{}: state: {}", model_.plant.robot.name, complaint)};
  }
  const double share = FirstStageTime(settings_.step.scheme);
  while (state_.time_s < t_s - kSameTime_s) {
    const double breakpoint = NextBreakpoint(model_.plant, state_.time_s);
    // A limit that misses the break point by round-off must not hide it.
    const bool at_breakpoint = breakpoint <= t_s + kSameTime_s;
    const double next = at_breakpoint ? breakpoint : t_s;
    const double remaining = next - state_.time_s;
    const double count = std::max(std::ceil(remaining / step_cap_.now_s() - 1e-9), 1.0);
    const double h = remaining / count;
    EvaluateInputs(model_.plant, state_.time_s + share * h, share == 1.0, &first_);
    EvaluateInputs(model_.plant, state_.time_s + h, true, &last_);
    const StepOutcome outcome =
        TakeStep(model_, settings_.step, h, state_, first_, last_, &work_, &next_, nullptr);
    counters_.newton_iterations += outcome.iterations;
    if (outcome.ok) {
      std::swap(state_, next_);
      if (count <= 1.0) state_.time_s = next;
      ++counters_.steps;
      step_cap_.Hold();
      stepped_ = true;
      if (auto status = guard_.Judge(state_, last_); !status.ok) return status;
      if (count > 1.0 || !at_breakpoint) continue;
      projection_.Lift(state_, &lifted_);
      for (const model::PayloadDrop& drop : DropsAt(model_.plant, lifted_)) drops_.push_back(drop);
      stepped_ = false;
      EvaluateInputs(model_.plant, state_.time_s, false, &first_);
      if (const ReducedFailure failure =
              CrossRootKink(model_, first_, &evaluation_, &jacobians_, &state_)) {
        return {false, fmt::format("t = {:.6g} s: after the kink of the root's motion: {}",
                                   state_.time_s, failure.Message())};
      }
      continue;
    }
    ++counters_.rejected;
    if (0.5 * h < settings_.min_step_s) {
      return {false, fmt::format("t = {:.6g} s: {}", state_.time_s, outcome.Message())};
    }
    step_cap_.Fail(h);
  }
  return {};
}

model::Sample ReducedSimulation::Observe() {
  EvaluateInputs(model_.plant, state_.time_s, false, &first_);
  // The last stage of a step ends where the sample is, and solves for the acceleration there; at a
  // break point inputs may differ from its.
  if (stepped_) {
    acceleration_ = work_.end_acceleration();
  } else {
    SolveAcceleration(model_, state_, first_, &evaluation_, &jacobians_, &acceleration_);
  }
  projection_.Lift(state_, &lifted_);
  lifted_failure_ = EvaluateForces(model_.plant, lifted_, first_, &plant_work_);
  if (!lifted_failure_) validity_.Add(model_.plant, first_, plant_work_, state_.time_s);
  plant_acceleration_.head<6>() = acceleration_.head<6>();
  return ObserveState(model_.plant, lifted_, plant_work_, plant_acceleration_);
}

model::RunResult ReducedSimulation::Run(const std::function<bool(const model::Sample&)>& observer) {
  model::RunResult result;
  model::Sample sample = Observe();
  bool go = !observer || observer(sample);
  model::StepStatus status;
  while (go && status.ok && state_.time_s < settings_.duration_s - kSameTime_s) {
    const double interval = settings_.output_interval_s;
    const double due = (std::floor(state_.time_s / interval + 1e-9) + 1.0) * interval;
    status = AdvanceTo(std::min(due, settings_.duration_s));
    if (!status.ok) break;
    sample = Observe();
    if (lifted_failure_) {
      status = {false, fmt::format("t = {:.6g} s: the plant's nodes in this shape: {}",
                                   state_.time_s, lifted_failure_.Message())};
      break;
    }
    if (observer) go = observer(sample);
  }
  result.ok = status.ok;
  result.reason = status.reason;
  result.sim_time_s = state_.time_s;
  result.counters = counters_;
  result.last = Observe();
  result.balance_defined = false;
  result.warnings = start_warnings_;
  AddValidity(model_.plant, validity_, &result);
  for (std::string& w : guard_.Warnings()) result.warnings.push_back(std::move(w));
  result.drops = drops_;
  return result;
}

}  // namespace mantle::reduced
