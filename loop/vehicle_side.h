#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "loop/messages.h"
#include "loop/options.h"

/// @file
/// The far end of the wire by the name that a scene gives it, `drives.vehicle`: the full plant with
/// its drives comes along as "plant" (loop/plant_side/plant_vehicle.h). One of a user's own,
/// another model or a real vehicle, is registered before the scene that names it is read:
///
///   RegisterVehicle({"mine", [](const VehicleParts& parts) {
///     return std::make_unique<MyVehicle>(parts);
///   }});
///   ... [drives] vehicle = "mine"
///
/// Not to be called from several threads at once.

namespace mantle::firmware_sim {
class Bus;
}
namespace mantle::controller {
struct SensorOptions;
}

namespace mantle::loop {

/// Drives on a bus and what they pull, in steps of time. The control side knows it by frames alone,
/// where motor i is the CiA 402 drive of node i + 1:
///
///   before t = 0     Hold: it stands at its initial state, the drives run
///   t = 0            Release
///   after it         Advance, coupling_steps() times a SYNC period
///   at any instant   Pump: frames that came are handed to the drives, their answers sent
///
/// Times are of the drives' clocks.
class DrivenVehicle {
 public:
  virtual ~DrivenVehicle() = default;

  /// Frames both ways at `now_us`.
  virtual void Pump(std::int64_t now_us) = 0;
  /// Before Release: the drives alone run to `now_us`.
  virtual void Hold(std::int64_t now_us) = 0;
  /// `now_us`, to which Hold came last, is t = 0.
  virtual void Release(std::int64_t now_us) = 0;
  /// To `now_us`. Fails where it cannot go on.
  virtual Status Advance(std::int64_t now_us) = 0;
  /// Calls of Advance per SYNC period, evenly spaced.
  virtual int coupling_steps() const { return 1; }
  /// Every drive let go of its cable and closed its brake.
  virtual bool braked() const = 0;
};

/// The seam: a vehicle with its instruments, whose message the control side gets every SYNC.
class VehicleSide : public DrivenVehicle {
 public:
  /// Takes in the state of now, `time_s` from t = 0. Fails where it cannot be told.
  virtual Status Look(double time_s) = 0;
  /// The message of what was looked at last; the first one has a state.
  virtual void Measure(Sensors* message) = 0;

  // What figures of a run are taken from: the truth, or the best that is known of it.

  /// Of the last Look, in the earth's frame.
  virtual const reduced::ReducedState& truth() const = 0;
  /// Tension of every motor [N], per unit gain, at the last Look.
  virtual const model::VectorX& tension_n() const = 0;
  /// Place of an arm's tip at the last Look [m], world.
  virtual model::Vector3 tip(int arm) const = 0;
  /// Work that a motor's drum did on its cables so far [J].
  virtual double cable_work_j(int motor) const = 0;
};

/// What a vehicle is made of; all must outlive it.
struct VehicleParts {
  const reduced::ReducedModel& model;  ///< as the controller knows it
  const model::Mismatch& mismatch;     ///< by which the scene has it differ from the model
  const std::vector<reduced::Actuator>& motors;  ///< motor i is node i + 1
  const DriveOptions& drives;
  const controller::SensorOptions& sensors;
  firmware_sim::Bus& bus;  ///< its station
};

/// A vehicle that scenes may name: drives.vehicle = "NAME".
struct VehicleType {
  std::string name;  ///< letters, digits, "_" and "-"
  std::function<std::unique_ptr<VehicleSide>(const VehicleParts&)> make;
};

/// The vehicle that comes along; ClosedLoop makes it from the whole scene.
inline constexpr std::string_view kPlantVehicle = "plant";

/// Throws std::invalid_argument where the name is no name or taken, or there is nothing to make.
void RegisterVehicle(VehicleType type);
/// One of a user's own. Throws std::invalid_argument, listing the known names, where there is none.
const VehicleType& FindVehicle(std::string_view name);
/// "plant", then in the order of their registration.
std::vector<std::string> VehicleNames();

}  // namespace mantle::loop
