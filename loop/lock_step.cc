#include "loop/lock_step.h"

#include <fmt/format.h>

#include <vector>

namespace mantle::loop {
namespace {

constexpr std::int64_t kTick_us = 1000;
// A stop ramps, pays out and brakes; each step of the master has its own time-out of 2 s.
constexpr std::int64_t kStopLimit_us = 8'000'000;

}  // namespace

LockStep::LockStep(DrivenVehicle& vehicle, MotorMaster& motors, StepBus& wire)
    : vehicle_(vehicle), motors_(motors), wire_(wire) {}

void LockStep::Exchange() {
  vehicle_.Pump(now_us_);
  motors_.Poll(now_us_);
}

void LockStep::AdvanceTo(std::int64_t now_us) {
  now_us_ = now_us;
  wire_.AdvanceTo(now_us);
}

Status LockStep::CheckBus() const {
  if (Status status = wire_.Check(); !status.ok) return status;
  if (motors_.counters().send_failures > 0) {
    return {false, fmt::format("bus {}: refused to send", wire_.spec())};
  }
  return {};
}

void LockStep::HeldPeriod() {
  motors_.Sync(now_us_);
  Exchange();
  for (const std::int64_t end_us = now_us_ + motors_.period_us(); now_us_ < end_us;) {
    vehicle_.Hold(now_us_ + kTick_us);
    AdvanceTo(now_us_ + kTick_us);
    Exchange();
  }
}

Status LockStep::BringUp() {
  AdvanceTo(now_us_);
  Exchange();
  for (;;) {
    if (Status status = CheckBus(); !status.ok) return status;
    if (Status status = motors_.BringUp(now_us_); !status.ok) return status;
    if (motors_.ready()) break;
    HeldPeriod();
  }
  origin_us_ = now_us_;
  vehicle_.Release(now_us_);
  return CheckBus();
}

Status LockStep::Cycle() {
  motors_.Sync(now_us_);
  Exchange();
  return AdvancePeriod(true);
}

Status LockStep::CycleWithoutControl() { return AdvancePeriod(false); }

Status LockStep::AdvancePeriod(bool with_control) {
  const std::int64_t start_us = now_us_;
  const int steps = vehicle_.coupling_steps();
  for (int i = 1; i <= steps; ++i) {
    const std::int64_t to_us = start_us + i * motors_.period_us() / steps;
    const Status status = vehicle_.Advance(to_us);
    AdvanceTo(to_us);
    if (!status.ok) return status;
  }
  if (with_control) {
    Exchange();
  } else {
    vehicle_.Pump(now_us_);
  }
  return CheckBus();
}

Status LockStep::Stop() {
  motors_.RequestStop(now_us_);
  motors_.SetTorques(std::vector<MotorCommand>(static_cast<std::size_t>(motors_.motor_count())));
  for (const std::int64_t end_us = now_us_ + kStopLimit_us;
       !(motors_.stopped() && vehicle_.braked());) {
    if (now_us_ >= end_us) return {false, "drives did not stop:\n" + motors_.Describe()};
    if (Status status = Cycle(); !status.ok) return status;
  }
  return motors_.CheckStopped();
}

}  // namespace mantle::loop
