#pragma once

#include "model/plant.h"
#include "reduced/arm.h"

namespace mantle::reduced {

/// Throws model::BadRobot. `arm_index` names the arm in the plant.
ReducedArm MakeReducedArm(const model::Plant& plant, int arm_index, const ArmReduction& reduction);

}  // namespace mantle::reduced
