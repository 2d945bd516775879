#pragma once

#include "model/plant.h"
#include "reduced/mantle.h"

namespace mantle::reduced {

/// Throws model::BadRobot.
ReducedMantle MakeReducedMantle(const model::Plant& plant, const MantleReduction& reduction);

}  // namespace mantle::reduced
