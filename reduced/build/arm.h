#pragma once

#include "model/plant.h"
#include "reduced/arm.h"

namespace mantle::reduced {

/// Throws model::BadRobot. `arm_index` names the arm in the plant.
ReducedArm MakeReducedArm(const model::Plant& plant, int arm_index, const ArmReduction& reduction);

/// B(X) of one group, zero in rigid pieces.
Matrix6X ReducedBasisAt(const model::Plant& plant, int arm_index, const StrainBasis& basis,
                        int group, double x_m);

}  // namespace mantle::reduced
