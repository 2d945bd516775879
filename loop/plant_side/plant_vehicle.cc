#include "loop/plant_side/plant_vehicle.h"

#include "model/observation.h"

namespace mantle::loop {

PlantVehicle::PlantVehicle(const model::Plant& plant, const reduced::ReducedPlant& model,
                           const model::RunSettings& run,
                           const std::vector<reduced::Actuator>& motors, const DriveOptions& drives,
                           const controller::SensorOptions& sensors, firmware_sim::Bus& bus)
    : plant_(plant), side_(plant, run, motors, drives, bus), instruments_(model, side_, sensors) {}

model::Vector3 PlantVehicle::tip(int arm) const {
  const model::WaterMotion water =
      EvaluateWater(plant_.robot.effects, side_.state().time_s);  // with which the state drifts
  return AbsolutePose(plant_, side_.state(), arm, plant_.rods[arm].element_count()).position +
         water.drift_m;
}

}  // namespace mantle::loop
