#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "firmware_sim/bus/candump_log.h"
#include "firmware_sim/bus/loop_bus.h"
#include "firmware_sim/bus/pair_bus.h"
#include "firmware_sim/bus/recording_bus.h"
#include "loop/lock_step_bus.h"
#include "loop/messages.h"
#include "loop/metered_bus.h"
#include "loop/tap_bus.h"
#include "loop/watching_bus.h"

namespace mantle::loop {

/// What a loop in lock-step needs to know of its bus.
class StepBus {
 public:
  virtual ~StepBus() = default;
  /// Frames sent from now on carry this time.
  virtual void AdvanceTo(std::int64_t now_us) = 0;
  /// Fails, naming the frame, where one has not come in time or is foreign.
  virtual Status Check() const = 0;
  virtual const std::string& spec() const = 0;
};

/// How time goes on a wire.
enum class WireTime : std::uint8_t {
  kLockStep,  ///< simulated, both sides in one thread: every exchange is waited for
              ///< (lock_step_bus.h)
  kReal,      ///< the wall clock's, each side in a thread of its own
};

/// The CAN bus between the two sides of a loop that run in one process, each with its own station.
class Wire final : public StepBus {
 public:
  /// `spec` as OpenBus takes it. A frame of a bus that takes wall time is waited for `timeout_us`.
  /// `record`, null for none, gets every frame of the control side's station. Throws
  /// std::invalid_argument, or std::system_error where the bus cannot be opened.
  explicit Wire(const std::string& spec, std::int64_t timeout_us = 2'000'000,
                firmware_sim::CandumpWriter* record = nullptr, WireTime time = WireTime::kLockStep);

  firmware_sim::Bus& control_station() { return *control_bus_; }
  firmware_sim::Bus& plant_station() { return *plant_bus_; }
  void AdvanceTo(std::int64_t now_us) override;
  Status Check() const override;
  const std::string& spec() const override { return spec_; }
  const BusTraffic& traffic() const { return meter_->traffic(); }
  std::uint64_t peak_worst_bits() const { return meter_->peak_worst_bits(); }
  void RestartPeak() { meter_->RestartPeak(); }
  /// In real time: writes what was recorded meanwhile; from one thread that is neither side's.
  void WriteRecord();
  firmware_sim::BusCounters counters() const { return control_bus_->counters(); }

 private:
  std::string spec_;
  std::int64_t timeout_us_;
  void OpenRealTime();

  std::unique_ptr<firmware_sim::LoopMedium> medium_;
  std::unique_ptr<firmware_sim::PairBus> pair_;
  std::unique_ptr<firmware_sim::Bus> control_end_, plant_end_;
  std::unique_ptr<LockStepBus> control_link_, plant_link_;
  std::unique_ptr<MeteredBus> meter_;
  std::unique_ptr<firmware_sim::RecordingBus> recorder_;
  firmware_sim::CandumpWriter* record_;
  // In real time.
  std::unique_ptr<WatchingBus> control_watch_, plant_watch_;
  std::unique_ptr<firmware_sim::SpscRing<firmware_sim::CanFrame>> recorded_;
  std::unique_ptr<TapBus> tap_;
  firmware_sim::Bus* control_bus_{nullptr};  ///< outermost
  firmware_sim::Bus* plant_bus_{nullptr};
};

}  // namespace mantle::loop
