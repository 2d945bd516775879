#include "controller/estimator.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "reduced/outputs.h"

namespace mantle::controller {
namespace {

constexpr double kKept_s = 1.0;  // of the history; older measurements are of no use
constexpr double kSameTime_s = 1e-9;
// Sizes that an error of a coordinate and of its rate is compared with.
constexpr double kBend_1_m = 1.0, kStretch = 0.02, kRates_1_s = 5.0;
constexpr double kRegular = 1e-3;  // of the normal matrix, over its largest entry
constexpr double kRootTime = 3.0;  // over the tensions' time
constexpr double kMostAcceleration_m_s2 = 0.1;
constexpr double kMostBias = 0.5;  // share of a motor's largest tension

bool Finite(const ReducedState& s) {
  return s.q.allFinite() && s.v.allFinite() && s.root.position.allFinite() &&
         s.root.rotation.coeffs().allFinite();
}

}  // namespace

Estimator::Estimator(const ReducedModel& model, const reduced::StepSettings& step,
                     const model::EstimatorOptions& options)
    : propagator_(model, step),
      options_(options),
      state_(InitialState(model)),
      next_(state_),
      innovation_(VectorX::Zero(2 * model.velocity_count())) {}

void Estimator::Start(const ReducedState& state) {
  state_ = state;
  measured_s_ = state.time_s;
  history_.clear();
  valid_ = true;
}

void Estimator::Predict(const ReducedState& from, double t_s,
                        const Eigen::Ref<const VectorX>& tensions, ReducedState* to) {
  if (t_s - from.time_s < kSameTime_s) {
    *to = from;
    return;
  }
  // A model that cannot be stepped keeps the last state: the next measurement mends it.
  if (!propagator_.Step(from, t_s - from.time_s, tensions, to, nullptr).ok) *to = from;
  to->time_s = t_s;
}

void Estimator::Update(double t_s, const Eigen::Ref<const VectorX>& tensions,
                       const ReducedState* measured) {
  const bool usable = measured != nullptr && Finite(*measured);
  const bool now = usable && std::abs(measured->time_s - t_s) < kSameTime_s;
  if (options_.observer || !now) {
    Predict(state_, t_s, tensions, &next_);
    std::swap(state_, next_);
  }
  state_.time_s = t_s;
  history_.push_back({t_s, tensions, state_});
  while (history_.front().time_s < t_s - kKept_s) history_.pop_front();
  if (!usable) return;
  measured_s_ = measured->time_s;
  if (options_.observer) {
    Observe(*measured);
  } else {
    TakeDirectly(*measured);
  }
  state_.time_s = t_s;
}

const Estimator::Entry* Estimator::EntryAt(double t_s) const {
  for (auto entry = history_.rbegin(); entry != history_.rend(); ++entry) {
    if (std::abs(entry->time_s - t_s) < kSameTime_s) return &*entry;
  }
  return nullptr;
}

void Estimator::TakeDirectly(const ReducedState& measured) {
  state_ = measured;
  for (const Entry& entry : history_) {
    if (entry.time_s <= state_.time_s + kSameTime_s) continue;
    Predict(state_, entry.time_s, entry.tensions, &next_);
    std::swap(state_, next_);
  }
}

void Estimator::Observe(const ReducedState& measured) {
  const Entry* then = EntryAt(measured.time_s);
  StateDifference(then == nullptr ? state_ : then->state, measured, innovation_);
  innovation_ *= options_.gain;
  MoveState(state_, innovation_, &next_);
  std::swap(state_, next_);
  for (Entry& entry : history_) {
    if (entry.time_s < measured.time_s - kSameTime_s) continue;
    MoveState(entry.state, innovation_, &next_);
    std::swap(entry.state, next_);
  }
}

BiasEstimator::BiasEstimator(const ReducedModel& model, const reduced::StepSettings& step,
                             const model::EstimatorOptions& options,
                             const std::vector<model::MotorLimits>& limits)
    : propagator_(model, step),
      options_(options),
      before_(InitialState(model)),
      predicted_(before_),
      jacobian_(model) {
  const int n = model.velocity_count(), motors = model.input_count();
  bias_.setZero(motors);
  held_ = rhs_ = most_ = bias_;
  for (int i = 0; i < motors; ++i) most_(i) = kMostBias * limits[i].max_tension_n;
  error_.setZero(2 * n);
  weight_.setZero(2 * n);
  const auto set = [&](int at, double scale) {
    weight_(6 + at) = 1.0 / (scale * scale);
    weight_(n + 6 + at) = 1.0 / std::pow(kRates_1_s * scale, 2);
  };
  for (std::size_t a = 0; a < model.arms.size(); ++a) {
    const reduced::ReducedArm& arm = model.arms[a];
    const int first = model.arm_first(static_cast<int>(a));
    for (std::size_t g = 0; g < arm.basis.groups().size(); ++g) {
      const auto& group = arm.basis.groups()[g];
      reduced::Matrix6X basis;
      arm.basis.Evaluate(static_cast<int>(g), 0.5 * (group.from_m + group.to_m), &basis);
      for (int c = 0; c < group.columns; ++c) {
        const bool bends = basis.col(c).head<3>().norm() > 0;
        set(first + group.first + c, bends ? kBend_1_m : kStretch);
      }
    }
  }
  if (model.mantle) {
    for (int i = 0; i < model.mantle->size; ++i) {
      set(model.mantle_first() + i, model.mantle->basis.scale(i));
    }
  }
  normal_.setZero(motors, motors);
  weighted_.setZero(2 * n, motors);
}

void BiasEstimator::Start(const ReducedState& state) {
  before_ = state;
  bias_.setZero();
  propagator_.SetRootAcceleration(model::Vector3::Zero());
}

void BiasEstimator::Update(const ReducedState& state, const Eigen::Ref<const VectorX>& tensions) {
  const double elapsed = state.time_s - before_.time_s;
  if (elapsed > kSameTime_s && options_.disturbance) {
    held_ = tensions + bias_;
    if (propagator_.Step(before_, elapsed, held_, &predicted_, &jacobian_).ok) {
      StateDifference(predicted_, state, error_);
      weighted_.noalias() = weight_.asDiagonal() * jacobian_.input;
      normal_.noalias() = jacobian_.input.transpose() * weighted_;
      normal_.diagonal().array() += kRegular * normal_.diagonal().maxCoeff() + 1e-12;
      rhs_.noalias() = weighted_.transpose() * error_;
      Eigen::LLT<Eigen::Ref<Eigen::MatrixXd>>(normal_).solveInPlace(rhs_);
      const double share = std::min(elapsed / options_.disturbance_time_s, 1.0);
      const model::Vector3 missed = error_.segment<3>(error_.size() / 2 + 3);
      if (missed.allFinite() && propagator_.model().plant.root_free()) {
        const double slow = std::min(elapsed / (kRootTime * options_.disturbance_time_s), 1.0);
        const model::Vector3 a = root_acceleration_m_s2() + slow / elapsed * missed;
        propagator_.SetRootAcceleration(
            a.cwiseMax(-kMostAcceleration_m_s2).cwiseMin(kMostAcceleration_m_s2));
      }
      if (rhs_.allFinite()) {
        bias_ = (bias_ + share * rhs_).cwiseMax(-most_).cwiseMin(most_);
      }
    }
  }
  before_ = state;
}

}  // namespace mantle::controller
