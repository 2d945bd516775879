#include "loop/plant_side/instruments.h"

#include "reduced/water_frame.h"

namespace mantle::loop {

Instruments::Instruments(const reduced::ReducedPlant& model, const PlantSide& plant,
                         const controller::SensorOptions& options)
    : plant_(plant),
      projection_(model),
      sensors_(model, options),
      truth_(InitialState(model)),
      tension_(model::VectorX::Zero(plant.motor_count())) {}

Status Instruments::Look(double time_s) {
  if (!projection_.Project(plant_.state(), &truth_)) {
    return {false, "the plant's state could not be projected: an element turned too far"};
  }
  // The plant's state drifts with the water.
  reduced::ToEarth(
      model::EvaluateWater(plant_.simulation().plant().robot.effects, plant_.state().time_s),
      &truth_);
  truth_.time_s = time_s;
  for (int i = 0; i < plant_.motor_count(); ++i) {
    tension_(i) = plant_.drum_tension_n(i) / plant_.reel(i).gain_square;
  }
  return {};
}

void Instruments::Measure(Sensors* message) {
  message->time_s = truth_.time_s;
  const auto measured = sensors_.Measure(truth_);
  message->has_state = measured.has_value() || first_;
  if (message->has_state) message->state = measured ? *measured : truth_;
  first_ = false;
  message->cables.resize(static_cast<std::size_t>(plant_.motor_count()));
  for (int i = 0; i < plant_.motor_count(); ++i) {
    const double length_m =
        sensors_.MeasureCable(plant_.length_m(i) - plant_.reel(i).rest_length_m);
    message->cables[static_cast<std::size_t>(i)] = {
        length_m, sensors_.MeasureCableRate(plant_.length_rate_m_s(i))};
  }
}

}  // namespace mantle::loop
