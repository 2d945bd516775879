#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "firmware_sim/bus/candump_log.h"
#include "firmware_sim/bus/loop_bus.h"
#include "firmware_sim/bus/recording_bus.h"
#include "loop/lock_step_bus.h"
#include "loop/messages.h"
#include "loop/metered_bus.h"

namespace mantle::loop {

/// The CAN bus between the two sides of a loop that run in one process, each with its own station.
/// Time is simulated whatever the bus: with one that takes wall time every exchange is waited for
/// (lock_step_bus.h).
class Wire {
 public:
  /// `spec` as OpenBus takes it. A frame of a bus that takes wall time is waited for `timeout_us`.
  /// `record`, null for none, gets every frame of the control side's station. Throws
  /// std::invalid_argument, or std::system_error where the bus cannot be opened.
  explicit Wire(const std::string& spec, std::int64_t timeout_us = 2'000'000,
                firmware_sim::CandumpWriter* record = nullptr);

  firmware_sim::Bus& control_station() { return *control_bus_; }
  firmware_sim::Bus& plant_station() { return *plant_bus_; }
  /// Frames sent from now on carry this time.
  void AdvanceTo(std::int64_t now_us);

  /// Fails, naming the frame, once one has not come within the time-out.
  Status Check() const;
  const std::string& spec() const { return spec_; }
  const BusTraffic& traffic() const { return meter_->traffic(); }
  firmware_sim::BusCounters counters() const { return control_bus_->counters(); }

 private:
  std::string spec_;
  std::int64_t timeout_us_;
  std::unique_ptr<firmware_sim::LoopMedium> medium_;
  std::unique_ptr<firmware_sim::Bus> control_end_, plant_end_;
  std::unique_ptr<LockStepBus> control_link_, plant_link_;
  std::unique_ptr<MeteredBus> meter_;
  std::unique_ptr<firmware_sim::RecordingBus> recorder_;
  firmware_sim::Bus* control_bus_{nullptr};  ///< outermost
  firmware_sim::Bus* plant_bus_{nullptr};
};

}  // namespace mantle::loop
