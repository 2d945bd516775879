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

/// Of the controller's plan; `mpc` is not null. The time of solving is told in real time alone.
PlanTelemetry PlanMessage(const reduced::ReducedModel& model, const loop::LoopStep& step,
                          bool real_time);

/// What the drives reported last and were told last. A tension is that per unit gain of the motor's
/// cables.
DrivesTelemetry DrivesMessage(const std::vector<reduced::Actuator>& motors,
                              const loop::LoopStep& step);

EnergyTelemetry EnergyMessage(const model::Sample& sample, const model::EnergyAccount& energy);

/// `iterations` of the solver so far.
StatusTelemetry StatusMessage(const std::string& controller, const loop::LoopStep& step,
                              long iterations);

/// What the controller acts on: `covariance` as Estimator::covariance.
ControlTelemetry ControlMessage(const std::vector<reduced::Actuator>& motors,
                                const loop::LoopStep& step, const controller::Reference& reference,
                                const Eigen::MatrixXd* covariance);

/// Of a run that publishes; `results` is its folder.
SessionTelemetry SessionMessage(const scene::Scene& scene, const model::Plant& plant,
                                const std::string& controller, const std::string& bus,
                                bool real_time, const std::string& results);

}  // namespace mantle::tools
