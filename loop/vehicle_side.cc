#include "loop/vehicle_side.h"

#include <stdexcept>

#include "model/named_types.h"

namespace mantle::loop {
namespace {

model::NamedTypes<VehicleType>& Vehicles() {
  static model::NamedTypes<VehicleType> vehicles(
      "vehicle",
      {{std::string(kPlantVehicle), [](const VehicleParts&) -> std::unique_ptr<VehicleSide> {
          throw std::logic_error("the plant is made from a whole scene: ClosedLoop");
        }}});
  return vehicles;
}

}  // namespace

void RegisterVehicle(VehicleType type) { Vehicles().Add(std::move(type)); }
const VehicleType& FindVehicle(std::string_view name) { return Vehicles().Find(name); }
std::vector<std::string> VehicleNames() { return Vehicles().Names(); }

}  // namespace mantle::loop
