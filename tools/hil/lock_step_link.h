#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "loop/counted_bus.h"
#include "loop/vehicle_side.h"
#include "loop/wire.h"
#include "tools/mantle/lcm_bridge.h"

/// Lock-step between two programs: the control side asks (MANTLE_STEP) for what loop::LockStep
/// would call within one process, the plant side does it and answers (MANTLE_STEPPED). Each waits
/// for every CAN frame that the other has sent, so that the frames and the sensor messages are
/// those of a run in one process, to the last bit. What is lost is asked for again.

namespace mantle::tools {

enum class StepAction : std::int8_t {
  kFrames = 1,
  kHold = 2,
  kRelease = 3,
  kAdvance = 4,
  kMeasure = 5,
  kEnd = 6
};

/// A vehicle in another program, and the control side's end of the bus to it.
class RemoteVehicle final : public loop::DrivenVehicle, public loop::StepBus {
 public:
  /// `station` and `model` must outlive it. The plant may take `patience_us` to appear.
  RemoteVehicle(const std::string& url, const std::string& spec, firmware_sim::Bus& station,
                const reduced::ReducedModel& model, std::int64_t patience_us);
  ~RemoteVehicle() override;

  firmware_sim::Bus& bus() { return bus_; }
  /// Asks for the sensor message of now.
  loop::Status Measure(loop::Sensors* message);
  /// Nothing more is asked for.
  void End() { Ask(StepAction::kEnd, now_us_); }
  std::int64_t repeated() const { return repeated_; }  ///< questions that were asked again

  void Pump(std::int64_t now_us) override { Ask(StepAction::kFrames, now_us); }
  void Hold(std::int64_t now_us) override { Ask(StepAction::kHold, now_us); }
  void Release(std::int64_t now_us) override { Ask(StepAction::kRelease, now_us); }
  loop::Status Advance(std::int64_t now_us) override { return Ask(StepAction::kAdvance, now_us); }
  bool braked() const override { return braked_; }

  void AdvanceTo(std::int64_t now_us) override {
    now_us_ = now_us;
    bus_.AdvanceTo(now_us);
  }
  loop::Status Check() const override;
  const std::string& spec() const override { return spec_; }

 private:
  class Answers;
  loop::Status Ask(StepAction action, std::int64_t now_us);

  std::string spec_;
  loop::CountedBus bus_;
  std::unique_ptr<Answers> answers_;
  std::unique_ptr<LcmLink> link_;
  StepTelemetry question_;
  std::int64_t patience_us_, now_us_{0}, repeated_{0};
  loop::Status failed_;
  bool braked_{false};
};

/// The other end: does what is asked for, until kEnd, a failure, or `stop`. `on_period` is called
/// after every measurement. Fails where the vehicle does, and where the control side or a frame of
/// it stays away.
class StepServer {
 public:
  StepServer(const std::string& url, loop::VehicleSide& vehicle, loop::CountedBus& bus,
             std::int64_t period_us);
  loop::Status Run(const std::function<bool()>& stop,
                   const std::function<void(double time_s)>& on_period);

 private:
  class Questions;
  loop::Status Do(const StepTelemetry& question);

  loop::VehicleSide& vehicle_;
  loop::CountedBus& bus_;
  std::int64_t period_us_, now_us_{0}, origin_us_{0};
  std::unique_ptr<LcmLink> link_;
  loop::Sensors message_;
  loop::Status status_;
  double time_s_{0};
};

}  // namespace mantle::tools
