#include "reduced/build/simulation.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace mantle::reduced {
namespace {

constexpr double kSameTime_s = 1e-12;
constexpr double kRecovery = 2.0;  // growth of a reduced step per success
constexpr double kMoving = 1e-12;  // velocity relative to a rigid robot's: above round-off

}  // namespace

ReducedRunSettings RunSettingsOf(const model::RunSettings& run, const Reduction& reduction) {
  ReducedRunSettings s;
  s.duration_s = run.duration_s;
  s.step_s = reduction.step_s;
  s.min_step_s = std::min(run.min_step_s, reduction.step_s);
  s.output_interval_s = run.output_interval_s;
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
      step_cap_s_(settings.step_s),
      guard_(model) {
  const model::PlantState start = model::StartState(model.plant);
  projection_.Lift(state_, &lifted_);
  if ((start.velocity - lifted_.velocity).cwiseAbs().maxCoeff() <= kMoving) return;
  if (!projection_.Project(start, &state_)) {
    throw model::BadRobot("initial velocities: cannot be projected onto the reduced coordinates");
  }
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
    const double count = std::max(std::ceil(remaining / step_cap_s_ - 1e-9), 1.0);
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
      step_cap_s_ = std::min(settings_.step_s, kRecovery * step_cap_s_);
      if (auto status = guard_.Judge(state_, last_); !status.ok) return status;
      if (count > 1.0 || !at_breakpoint) continue;
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
    step_cap_s_ = 0.5 * h;
  }
  return {};
}

model::Sample ReducedSimulation::Observe() {
  EvaluateInputs(model_.plant, state_.time_s, false, &first_);
  SolveAcceleration(model_, state_, first_, &evaluation_, &jacobians_, &acceleration_);
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
  AddValidity(model_.plant, validity_, &result);
  for (std::string& w : guard_.Warnings()) result.warnings.push_back(std::move(w));
  return result;
}

}  // namespace mantle::reduced
