#pragma once

#include "controller/options.h"
#include "model/robot.h"
#include "model/schema.h"
#include "reduced/reduction.h"

/// @file
/// The keys of the tables [control] and [sensors].

namespace mantle::controller {

/// `motors` are the actuators of [reduced], all on cables.
void Describe(schema::Visitor& v, const model::Robot& robot,
              const std::vector<reduced::Actuator>& motors, ControlOptions& control);

void Describe(schema::Visitor& v, SensorOptions& sensors);

}  // namespace mantle::controller
