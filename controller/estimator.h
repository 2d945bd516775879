#pragma once

#include <optional>
#include <vector>

#include "controller/state_filter.h"

/// From measurements to the state a controller uses, and to the disturbances that explain what the
/// model did not foresee. This is the seam where another estimator fits.
///
/// The state: the newest measurement, or (observer) what the filter makes of all of them; carried
/// by the model from when it was taken to now, with what was pulled meanwhile.

namespace mantle::controller {

class Estimator {
 public:
  /// `model` must outlive it.
  Estimator(const ReducedModel& model, const reduced::StepSettings& step,
            const EstimatorOptions& options, const SensorOptions& sensors,
            const std::vector<MotorLimits>& limits);

  void Start(const ReducedState& state);
  /// The time is now t_s; `tensions` were pulled since the last call. `measured`, null where none
  /// came, was taken at its time_s, now or earlier; one that is not finite,
  /// or older than one before it, is ignored. Allocates
  /// in the first two seconds alone (and as much longer as sensors are late).
  void Update(double t_s, const Eigen::Ref<const VectorX>& tensions, const ReducedState* measured);

  const ReducedState& state() const { return state_; }
  /// None where it is not wanted.
  const Disturbance& disturbance() const { return propagator_.disturbance(); }
  /// Seconds since the newest measurement was taken.
  double age_s() const { return state_.time_s - measured_s_; }
  bool valid() const { return valid_; }

 private:
  struct Pull {
    double until_s;
    VectorX tensions;
  };
  bool Filter(double t_s, const ReducedState* measured);
  void Carry(double t_s, const Eigen::Ref<const VectorX>& tensions);

  Propagator propagator_;
  bool observer_;
  double patience_s_;
  std::optional<StateFilter> filter_;
  ReducedState state_, next_;
  std::vector<Pull> pulls_;  ///< the oldest first
  double measured_s_{0};
  bool valid_{false};
};

}  // namespace mantle::controller
