#include "loop/loop_account.h"

#include <algorithm>
#include <cmath>

namespace mantle::loop {

using model::Vector3;
using model::VectorX;
using reduced::ReducedState;

LoopAccount::LoopAccount(const reduced::ReducedModel& model,
                         const controller::ControlOptions& control,
                         const controller::Reference& reference, double duration_s)
    : control_(control),
      reference_(reference),
      cost_(model, control, reference),
      history_(control.gait.period_s + 1.0),
      residual_(VectorX::Zero(cost_.rows())),
      half_s_(0.5 * duration_s) {}

void LoopAccount::Start(const Vector3& position, LoopResult* result) {
  history_.Reset(0.0, position);
  position_before_ = position;
  if (const auto* goal = std::get_if<controller::PathTask>(&control_.goal)) {
    result->waypoints.assign(goal->waypoints.size(), {controller::kInfinity, 0.0, false});
  }
  for (const controller::StageCost::Term& term : cost_.terms()) {
    result->cost_terms.emplace_back(term.name, 0.0);
  }
  for (const char* name : {"effort", "rate"}) result->cost_terms.emplace_back(name, 0.0);
  if (cost_.has_mean_velocity()) result->cost_terms.emplace_back("mean_velocity", 0.0);
  result->error_name = reference_.has_position() ? "position_m"
                       : reference_.has_tip()    ? "tip_m"
                                                 : "mean_speed_m_s";
}

Vector3 LoopAccount::MeanVelocityError(const ReducedState& truth) const {
  const double period = control_.gait.period_s, t = truth.time_s;
  return (truth.root.position - history_.At(t - period)) / period - reference_.At(t).velocity;
}

double LoopAccount::Look(const ReducedState& truth, const Vector3& tip, LoopResult* r) {
  const double t = truth.time_s;
  const controller::ReferencePoint ref = reference_.At(t);
  history_.Add(t, truth.root.position);
  error_counts_ = true;
  if (reference_.has_position()) {
    error_ = (truth.root.position - ref.position).norm();
    const auto& goal = std::get<controller::PathTask>(control_.goal);
    for (std::size_t i = 0; i < goal.waypoints.size(); ++i) {
      WaypointResult& w = r->waypoints[i];
      if (i > 0 && !r->waypoints[i - 1].passed) break;
      const double distance = (truth.root.position - goal.waypoints[i]).norm();
      if (distance < w.distance_m) {
        w.distance_m = distance;
        w.time_s = t;
        w.passed = distance <= goal.tolerance_m;
      }
    }
  } else if (reference_.has_tip()) {
    error_ = (tip - ref.tip).norm();
    error_counts_ = t >= reference_.SettledTime();
  } else {
    error_ = MeanVelocityError(truth).norm();
    error_counts_ = t >= control_.gait.period_s;
  }
  travelled_m_ += (truth.root.position - position_before_).norm();
  position_before_ = truth.root.position;
  r->final_error = error_;
  return error_;
}

void LoopAccount::Add(const ReducedState& truth, double dt, const VectorX& command,
                      const VectorX& before, const VectorX& actual, LoopResult* r) {
  cost_.Evaluate(truth, &residual_, nullptr);
  auto at = r->cost_terms.begin();
  const auto add = [&](double value) {
    (at++)->second += dt * value;
    r->cost += dt * value;
  };
  for (const controller::StageCost::Term& term : cost_.terms()) add(cost_.Value(residual_, term));
  add(cost_.EffortValue(command));
  add(cost_.RateValue((command - before) / dt));
  if (cost_.has_mean_velocity()) {
    add(control_.cost.mean_velocity * MeanVelocityError(truth).squaredNorm());
  }
  if (error_counts_) {
    r->mean_error += dt * error_;
    error_time_s_ += dt;
    r->max_error = std::max(r->max_error, error_);
  }
  r->effort_n2_s += dt * command.squaredNorm();
  squared_error_ += (actual - before).squaredNorm() / static_cast<double>(actual.size());
}

void LoopAccount::AddCurrent(double t_s, double dt_s, const Vector3& estimated,
                             const Vector3& actual, LoopResult* r) {
  if (!r->current) r->current.emplace();
  r->current->estimated = estimated;
  r->current->actual = actual;
  if (t_s < half_s_) return;
  const double error = (estimated - actual).norm();
  r->current->rms_error += dt_s * error * error;
  r->current->max_error = std::max(r->current->max_error, error);
  current_time_s_ += dt_s;
}

void LoopAccount::Conclude(LoopResult* r) const {
  if (r->current && current_time_s_ > 0) {
    r->current->rms_error = std::sqrt(r->current->rms_error / current_time_s_);
  }
  if (error_time_s_ > 0) r->mean_error /= error_time_s_;
  if (r->cycles == 0) return;
  r->tension_error_n = std::sqrt(squared_error_ / static_cast<double>(r->cycles));
  r->mean_speed_m_s = travelled_m_ / r->time_s;
}

}  // namespace mantle::loop
