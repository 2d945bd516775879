#pragma once

#include "model/robot.h"
#include "model/schema.h"
#include "reduced/reduction.h"

/// @file
/// The keys of the table [reduced].

namespace mantle::reduced {

/// Names of arms, cables, loads and strips are those of `robot`. `reduction.arms` gets one entry
/// per arm (one where there is none).
void Describe(schema::Visitor& v, const model::Robot& robot, Reduction& reduction);

/// One actuator per cable of the robot, named ARM.CABLE or MANTLE.SPOKES, in the plant's order.
std::vector<Actuator> CableActuators(const model::Robot& robot);

}  // namespace mantle::reduced
