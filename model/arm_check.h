#pragma once

#include "model/rod.h"

namespace mantle::model {

/// Throws BadRobot for an arm that cannot be discretised: lengths, elements, cables, points,
/// payloads and muscles beyond their bounds.
void CheckArm(const Arm& arm);

/// Radius of the circle that encloses an arm's section at arc length x [m].
double ArmRadius(const Arm& arm, double x_m);

}  // namespace mantle::model
