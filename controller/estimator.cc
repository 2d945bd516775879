#include "controller/estimator.h"

#include <algorithm>

#include "reduced/outputs.h"

namespace mantle::controller {
namespace {

constexpr double kKept_s = 1.0;  // of what was commanded; older measurements are of no use
constexpr double kSameTime_s = 1e-9;
/// The filter waits this long beyond the sensors' delay for a measurement, then goes on without.
constexpr double kPatience_s = 0.2;

}  // namespace

ModelEstimator::ModelEstimator(const EstimatorParts& parts)
    : propagator_(parts.model, parts.step),
      observer_(parts.options.observer),
      patience_s_(parts.sensors.delay_s + kPatience_s),
      state_(InitialState(parts.model)),
      next_(state_) {
  if (parts.options.observer || parts.options.disturbance || parts.options.current) {
    filter_.emplace(parts.model, parts.step, parts.options, parts.sensors, parts.limits);
  }
}

void ModelEstimator::Start(const ReducedState& state) {
  state_ = state;
  measured_s_ = state.time_s;
  pulls_.clear();
  counters_ = {};
  propagator_.SetDisturbance(Disturbance(propagator_.model().input_count()));
  if (filter_) filter_->Start(state);
  valid_ = true;
}

void ModelEstimator::Update(double t_s, const Eigen::Ref<const VectorX>& tensions,
                            const ReducedState* measured) {
  const bool newest = measured != nullptr && measured->time_s > measured_s_ - kSameTime_s;
  const ReducedState* usable = newest && IsFinite(*measured) ? measured : nullptr;
  if (!pulls_.empty() && pulls_.front().until_s < t_s - patience_s_ - kKept_s) {
    std::rotate(pulls_.begin(), pulls_.begin() + 1, pulls_.end());  // the oldest makes room
  } else {
    pulls_.emplace_back();
  }
  pulls_.back().until_s = t_s;
  pulls_.back().tensions = tensions;
  const Heard heard = filter_ ? Filter(t_s, usable) : Heard::kNothing;
  if (heard == Heard::kTaken) propagator_.SetDisturbance(filter_->disturbance());
  if (heard == Heard::kRefused) usable = nullptr;
  const bool fresh = usable != nullptr && (heard == Heard::kTaken || !observer_);
  if (usable != nullptr) measured_s_ = std::max(measured_s_, usable->time_s);
  if (fresh) ++counters_.taken;
  if (measured != nullptr && !fresh && heard != Heard::kRefused) ++counters_.useless;
  if (!fresh) {
    Carry(t_s, tensions);
    return;
  }
  state_ = observer_ ? filter_->state() : *usable;
  for (const Pull& pull : pulls_) Carry(pull.until_s, pull.tensions);
}

EstimatorCounters ModelEstimator::counters() const {
  EstimatorCounters c = counters_;
  if (filter_) {
    c.refused = filter_->refused() - filter_->restarts();  // a restart takes what it refused
    c.restarts = filter_->restarts();
  }
  return c;
}

// Brings the filter to the measurement's time and tells it, unless it is past that.
ModelEstimator::Heard ModelEstimator::Filter(double t_s, const ReducedState* measured) {
  const bool tells =
      measured != nullptr && measured->time_s > filter_->state().time_s - kSameTime_s;
  const double until = tells ? measured->time_s : t_s - patience_s_;
  for (const Pull& pull : pulls_) {
    if (pull.until_s > until + kSameTime_s) break;
    if (pull.until_s > filter_->state().time_s + kSameTime_s) {
      filter_->Predict(pull.until_s, pull.tensions);
    }
  }
  if (!tells) return Heard::kNothing;
  return filter_->Correct(*measured) ? Heard::kTaken : Heard::kRefused;
}

// The state on to a later time. A model that cannot be stepped keeps it: the next measurement
// mends it.
void ModelEstimator::Carry(double t_s, const Eigen::Ref<const VectorX>& tensions) {
  if (t_s < state_.time_s + kSameTime_s) return;
  if (propagator_.Step(state_, t_s - state_.time_s, tensions, &next_, nullptr).ok) {
    std::swap(state_, next_);
  }
  state_.time_s = t_s;
}

}  // namespace mantle::controller
