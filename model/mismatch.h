#pragma once

#include "model/robot.h"

namespace mantle::model {

/// The robot with the bodies' own factors of Robot::mismatch applied (materials: young, viscosity;
/// bodies: added_mass) and set back to one; factors on loads remain, for the loads to take.
Robot WithActualBodies(const Robot& described);

}  // namespace mantle::model
