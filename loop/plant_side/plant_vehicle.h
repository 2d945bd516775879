#pragma once

#include "loop/plant_side/instruments.h"
#include "loop/plant_side/plant_side.h"
#include "loop/vehicle_side.h"

namespace mantle::loop {

/// The vehicle that comes along: the full plant with reels, CANopen drives and instruments.
class PlantVehicle final : public VehicleSide {
 public:
  /// `plant`, `model` and `bus` must outlive it. Throws as PlantSide and Instruments do.
  PlantVehicle(const model::Plant& plant, const reduced::ReducedPlant& model,
               const model::RunSettings& run, const std::vector<reduced::Actuator>& motors,
               const DriveOptions& drives, const controller::SensorOptions& sensors,
               firmware_sim::Bus& bus);

  void Pump(std::int64_t now_us) override { side_.Pump(now_us); }
  void Hold(std::int64_t now_us) override { side_.Hold(now_us); }
  void Release(std::int64_t now_us) override { side_.Release(now_us); }
  Status Advance(std::int64_t now_us) override { return side_.Advance(now_us); }
  int coupling_steps() const override { return side_.coupling_steps(); }
  bool braked() const override { return side_.braked(); }
  Status Look(double time_s) override { return instruments_.Look(time_s); }
  void Measure(Sensors* message) override { instruments_.Measure(message); }
  const reduced::ReducedState& truth() const override { return instruments_.truth(); }
  const model::VectorX& tension_n() const override { return instruments_.tension_n(); }
  model::Vector3 tip(int arm) const override;
  double cable_work_j(int motor) const override { return side_.winch(motor).cable_work_j; }

  PlantSide& side() { return side_; }  ///< plant and drives themselves
  const PlantSide& side() const { return side_; }

 private:
  const model::Plant& plant_;
  PlantSide side_;
  Instruments instruments_;
};

}  // namespace mantle::loop
