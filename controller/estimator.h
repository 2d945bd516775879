#pragma once

#include <deque>

#include "controller/trajectory.h"
#include "model/control.h"

/// From measurements to the state a controller uses, and to the tensions' bias that explains what
/// the model did not foresee. This is the seam where another estimator fits.
///
/// Direct: the newest measurement, carried by the model from when it was taken to now. Observer:
/// the model runs along; a measurement taken at t_m moves the estimate by gain times the
/// difference to what was estimated for t_m.

namespace mantle::controller {

class Estimator {
 public:
  Estimator(const ReducedModel& model, const reduced::StepSettings& step,
            const model::EstimatorOptions& options);

  void Start(const ReducedState& state);
  /// The time is now t_s; `tensions` were pulled since the last call. `measured`, null where none
  /// came, was taken at its time_s, now or earlier; one that is not finite is ignored.
  void Update(double t_s, const Eigen::Ref<const VectorX>& tensions, const ReducedState* measured);

  const ReducedState& state() const { return state_; }
  /// Seconds since the newest measurement was taken.
  double age_s() const { return state_.time_s - measured_s_; }
  bool valid() const { return valid_; }

 private:
  struct Entry {
    double time_s;
    VectorX tensions;    ///< until time_s
    ReducedState state;  ///< estimated for time_s
  };
  const Entry* EntryAt(double t_s) const;
  void TakeDirectly(const ReducedState& measured);
  void Observe(const ReducedState& measured);
  void Predict(const ReducedState& from, double t_s, const Eigen::Ref<const VectorX>& tensions,
               ReducedState* to);

  Propagator propagator_;
  model::EstimatorOptions options_;
  ReducedState state_, next_;
  VectorX innovation_;
  std::deque<Entry> history_;
  double measured_s_{0};
  bool valid_{false};
};

/// Bias d of the tensions as the motors' share of the prediction's error: each control period,
///   e = x measured - F(x before, u + d),  d += (T / tau) (B^T W B + lambda)^-1 B^T W e
/// on the shape's coordinates, W by their scales. What is left in a free root's velocity becomes an
/// acceleration in its own frame, found alike but slower (a pulse should not show in it).
class BiasEstimator {
 public:
  BiasEstimator(const ReducedModel& model, const reduced::StepSettings& step,
                const model::EstimatorOptions& options,
                const std::vector<model::MotorLimits>& limits);

  void Start(const ReducedState& state);
  /// `tensions`: mean of what was pulled since the last call.
  void Update(const ReducedState& state, const Eigen::Ref<const VectorX>& tensions);
  const VectorX& bias() const { return bias_; }
  const model::Vector3& root_acceleration_m_s2() const {
    return propagator_.root_acceleration_m_s2();
  }

 private:
  Propagator propagator_;
  model::EstimatorOptions options_;
  VectorX bias_, most_, weight_, error_, held_, rhs_;
  Eigen::MatrixXd normal_, weighted_;
  ReducedState before_, predicted_;
  reduced::StepJacobian jacobian_;
};

}  // namespace mantle::controller
