#pragma once

#include "controller/options.h"
#include "model/robot.h"
#include "model/schema.h"

/// @file
/// The keys of the table [control.goal].

namespace mantle::controller {

void DescribeGoal(schema::Visitor& v, const model::Robot& robot, ControlGoal& goal);

}  // namespace mantle::controller
