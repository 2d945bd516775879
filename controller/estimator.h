#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "controller/state_filter.h"

/// From measurements to the state a controller uses, and to the disturbances that explain what the
/// model did not foresee.

namespace mantle::controller {

/// What became of an estimator's measurements since Start. Those that were not taken are counted
/// under their reason, none is lost silently.
struct EstimatorCounters {
  long taken{0};
  long refused{0};   ///< by the gate: too far from what was expected (state_filter.h)
  long useless{0};   ///< not finite, or older than one before
  long restarts{0};  ///< of a filter whose gate had refused for too long
};

/// The seam: an estimator of a user's own derives from it (registry.h gives it a name).
class Estimator {
 public:
  virtual ~Estimator() = default;

  /// At the beginning of a run, with the first state that was measured.
  virtual void Start(const ReducedState& state) = 0;
  /// Every SYNC. The time is now t_s; `tensions` [N, one per motor] were commanded since the last
  /// call. `measured`, null where none came, was taken at its time_s, now or earlier; it need not
  /// be finite.
  virtual void Update(double t_s, const Eigen::Ref<const VectorX>& tensions,
                      const ReducedState* measured) = 0;
  /// Of the last Update's time.
  virtual const ReducedState& state() const = 0;
  /// What the model misses, sized for its motors; all zero where it is not estimated.
  virtual const Disturbance& disturbance() const = 0;
  /// Covariance of the error of state(), its first 2 velocity_count rows laid out as
  /// reduced::StateDifference; as of the newest measurement. Null where it is not estimated.
  virtual const Eigen::MatrixXd* covariance() const { return nullptr; }
  /// All zero where it does not count.
  virtual EstimatorCounters counters() const { return {}; }
};

/// What an estimator is made of; all must outlive it.
struct EstimatorParts {
  const ReducedModel& model;
  const reduced::StepSettings& step;
  const EstimatorOptions& options;
  const SensorOptions& sensors;            ///< what is known of the sensors' noise and delay
  const std::vector<MotorLimits>& limits;  ///< one per motor
};

/// What options.type names (registry.h). Throws std::invalid_argument, listing the known names,
/// where there is none.
std::unique_ptr<Estimator> MakeEstimator(const EstimatorParts& parts);

/// Ours, "model". States are the earth's. The state: the newest measurement, or (observer) what the
/// filter makes of all of them; carried by the model from when it was taken to now, with what was
/// commanded meanwhile. A measurement that is not finite, or older than one before it, or that the
/// filter's gate refuses, is not used: the model goes on without. Allocates in the first
/// two seconds alone (and as much longer as sensors are late).
class ModelEstimator final : public Estimator {
 public:
  explicit ModelEstimator(const EstimatorParts& parts);

  void Start(const ReducedState& state) override;
  void Update(double t_s, const Eigen::Ref<const VectorX>& tensions,
              const ReducedState* measured) override;
  const ReducedState& state() const override { return state_; }
  const Disturbance& disturbance() const override { return propagator_.disturbance(); }
  const Eigen::MatrixXd* covariance() const override {
    return observer_ ? &filter_->covariance() : nullptr;
  }
  EstimatorCounters counters() const override;
  /// Seconds since the newest measurement was taken.
  double age_s() const { return state_.time_s - measured_s_; }
  bool valid() const { return valid_; }  ///< Start was called

 private:
  struct Pull {
    double until_s;
    VectorX tensions;
  };
  enum class Heard { kNothing, kTaken, kRefused };
  Heard Filter(double t_s, const ReducedState* measured);
  void Carry(double t_s, const Eigen::Ref<const VectorX>& tensions);

  Propagator propagator_;
  bool observer_;
  double patience_s_;
  std::optional<StateFilter> filter_;
  ReducedState state_, next_;
  std::vector<Pull> pulls_;  ///< the oldest first
  double measured_s_{0};
  EstimatorCounters counters_;
  bool valid_{false};
};

}  // namespace mantle::controller
