#pragma once

#include "model/plant.h"
#include "reduced/reduced_model.h"

namespace mantle::reduced {

/// A reduced model together with the full model whose functions it projects. What only runs the
/// reduced model takes it as a ReducedModel; lifting, projecting and comparing need the plant too.
class ReducedPlant : public ReducedModel {
 public:
  /// Throws model::BadRobot: frozen coupling, a basis that cannot be, an actuator without a target.
  ReducedPlant(const model::Robot& robot, const Reduction& reduction);

  const model::Plant plant;
};

}  // namespace mantle::reduced
