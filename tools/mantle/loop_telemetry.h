#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "loop/closed_loop.h"
#include "model/simulation.h"
#include "tools/mantle/telemetry.h"

/// Messages (docs/telemetry.md) of what happens in a closed loop.

namespace mantle::tools {

/// Simulated time [us].
std::int64_t TelemetryTime(double time_s);

StateTelemetry StateMessage(const model::Plant& plant, const model::Sample& sample);

ReducedStateTelemetry ReducedStateMessage(const reduced::ReducedState& state);

/// Of the controller's plan; `plan` is not null. The time of solving is told in real time alone.
PlanTelemetry PlanMessage(const reduced::ReducedModel& model, const loop::LoopStep& step,
                          bool real_time);

/// Of a planner's report, in real time.
PlanTelemetry PlanMessageOf(const reduced::ReducedModel& model, const loop::PlanReport& report);

/// Appends what one drive reported last and was told last; `gain_square` as Reel::gain_square.
void AddDrive(const std::string& motor, const firmware_sim::DriveReport& report,
              std::int16_t target_permille, const controller::WinchMap& winch, double gain_square,
              double reeled_length_m, DrivesTelemetry* message);

/// What the drives reported last and were told last. A tension is that per unit gain of the motor's
/// cables.
DrivesTelemetry DrivesMessage(const std::vector<reduced::Actuator>& motors,
                              const controller::WinchMap& winch, const loop::LoopStep& step);

EnergyTelemetry EnergyMessage(const model::Sample& sample, const model::EnergyAccount& energy);

/// `iterations` of the solver so far; `period_s` of SYNC.
StatusTelemetry StatusMessage(const std::string& controller, const loop::LoopStep& step,
                              long iterations, double period_s);
/// The part of it that a loop in real time has.
void AddTiming(const loop::FastLoopCounters& counters, double period_s, StatusTelemetry* message);

/// The sensor message between programs, to its last bit, and back. False where it is not of this
/// model's size, or its time is not finite.
SensorsTelemetry SensorsMessage(const loop::Sensors& sensors);
bool SensorsOf(const SensorsTelemetry& message, const reduced::ReducedModel& model,
               loop::Sensors* sensors);

/// What the controller acts on.
ControlTelemetry ControlMessage(const std::vector<reduced::Actuator>& motors,
                                const loop::LoopStep& step, const controller::Reference& reference);

/// Of a run that publishes; `results` is its folder.
SessionTelemetry SessionMessage(const scene::Scene& scene, const model::Plant& plant,
                                const std::string& controller, const std::string& bus,
                                bool real_time, const std::string& results);

}  // namespace mantle::tools
