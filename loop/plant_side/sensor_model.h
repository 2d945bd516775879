#pragma once

#include <deque>
#include <optional>
#include <random>

#include "controller/options.h"
#include "reduced/reduced_model.h"

namespace mantle::loop {

using reduced::ReducedModel;
using reduced::ReducedState;

/// What sensors make of the true reduced state: white noise, a constant bias drawn once, a delay,
/// lost measurements. Seeded: the same scene sees the same noise.
class SensorModel {
 public:
  /// Throws nothing; `model` must outlive it.
  SensorModel(const ReducedModel& model, const controller::SensorOptions& options);

  /// Takes the truth at its time; gives the measurement that arrives now (stamped with the time it
  /// was taken), or none.
  std::optional<ReducedState> Measure(const ReducedState& truth);
  /// A cable's length [m] and rate [m/s] as measured: white noise alone, every SYNC.
  double MeasureCable(double length_m);
  double MeasureCableRate(double rate_m_s);

 private:
  ReducedState WithNoise(const ReducedState& truth);

  const ReducedModel& model_;
  controller::SensorOptions options_;
  model::VectorX deviation_, bias_, noise_;
  std::deque<std::optional<ReducedState>> waiting_;
  std::deque<double> taken_s_;
  std::mt19937_64 random_;
};

}  // namespace mantle::loop
