#pragma once

#include <vector>

#include "loop/messages.h"
#include "loop/plant_side/plant_side.h"
#include "loop/plant_side/sensor_model.h"
#include "reduced/build/projection.h"

namespace mantle::loop {

/// The vehicle's instruments, idealised: the plant's state projected on reduced coordinates, in the
/// earth's frame, and the cables' lengths, both with the noise, delay and losses of the table
/// [sensors].
class Instruments {
 public:
  /// Both must outlive it; `plant` is the one the model reduces, but for mismatch. Throws
  /// model::BadRobot as Projection does.
  Instruments(const reduced::ReducedPlant& model, const PlantSide& plant,
              const controller::SensorOptions& options);

  /// Takes in the plant's true state, now, at `time_s` from t = 0. Fails where it cannot be
  /// projected.
  Status Look(double time_s);
  /// The message of what was looked at last. The first one always has a state: where no measurement
  /// arrives yet, the true one, since a vehicle starts from a known place.
  void Measure(Sensors* message);

  const reduced::ReducedState& truth() const { return truth_; }
  /// True tension of every motor [N], per unit gain: u = T / G (reel.h).
  const model::VectorX& tension_n() const { return tension_; }

 private:
  const PlantSide& plant_;
  reduced::Projection projection_;
  SensorModel sensors_;
  reduced::ReducedState truth_;
  model::VectorX tension_;
  bool first_{true};
};

}  // namespace mantle::loop
