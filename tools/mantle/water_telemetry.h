#pragma once

#include "model/plant.h"
#include "tools/mantle/telemetry.h"

/// Drag of the water as messages MANTLE_WATER (docs/telemetry.md), by the plant's own loads:
///
///   arms: the force of DragLoad::Density per length at each node; mantle and rigid body together:
///   AxialDragLoad, LateralDragLoad and RigidDrag::RootLoad (model/loads.h, mantle_loads.h, effects/rigid_drag.h)

namespace mantle::tools {

class WaterMessages {
 public:
  /// `plant` must outlive it; `thinning` is ShapeMessages::thinning, so that nodes are the shape's.
  WaterMessages(const model::Plant& plant, int thinning);

  /// Whether any of the plant's loads is drag: else there is nothing to say.
  bool active() const { return active_; }

  /// Of a state of the plant. Throws std::logic_error where its forces cannot be evaluated, which
  /// no step leaves.
  const WaterTelemetry& Of(const model::PlantState& state);

 private:
  model::Vector3 BodyDrag(const model::PlantState& state) const;

  const model::Plant& plant_;
  int thinning_;
  bool active_{false};
  model::PlantInputs inputs_;
  model::PlantWork work_;
  WaterTelemetry message_;
};

}  // namespace mantle::tools
