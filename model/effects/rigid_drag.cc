#include "model/effects/rigid_drag.h"

#include <cmath>
#include <numbers>

#include "model/lateral_drag.h"
#include "model/rigid_body.h"

namespace mantle::model {

using schema::Quantity;

static void Describe(schema::Visitor& v, RigidDrag& drag) {
  v.Number({"lateral_coefficient"}, Quantity::kNumber, schema::kNonNegative,
           &drag.lateral_coefficient);
  v.Number({"axial_coefficient"}, Quantity::kNumber, schema::kNonNegative, &drag.axial_coefficient);
  v.Number({.name = "lateral_area", .fallback = "the cone's", .also = "needed with `inertia`"},
           Quantity::kArea, schema::kNonNegative, &drag.lateral_area_m2);
  v.Number({.name = "axial_area", .fallback = "the cone's", .also = "needed with `inertia`"},
           Quantity::kArea, schema::kNonNegative, &drag.axial_area_m2);
}

void RigidDrag::Read(schema::Visitor& v, std::optional<RigidDrag>* effect) {
  v.Effect({.name = kName, .meaning = "quadratic", .also = "a rigid body"}, effect);
}

void RigidDrag::Check(schema::Visitor& v, const RigidDrag& drag, const Bodies& bodies) {
  v.DemandAt(bodies.rigid_body.has_value(), "effects.rigid_drag",
             "named, but the scene has no rigid body for it");
  if (!bodies.rigid_body) return;
  const bool cone = std::holds_alternative<Cone>(bodies.rigid_body->shape);
  const char* needs = "is missing: must be given [m^2] where the rigid body is not a cone";
  v.DemandAt(cone || drag.lateral_area_m2, "effects.rigid_drag.lateral_area", needs);
  v.DemandAt(cone || drag.axial_area_m2, "effects.rigid_drag.axial_area", needs);
}

RigidDragGeometry DragGeometry(const RigidBody& body, const RigidDrag& drag) {
  RigidDragGeometry g{drag.lateral_area_m2.value_or(0.0), drag.axial_area_m2.value_or(0.0),
                      RigidCentre(body).z()};
  if (const Cone* cone = std::get_if<Cone>(&body.shape)) {
    g.lateral_area_m2 = drag.lateral_area_m2.value_or(cone->radius_m * cone->height_m);
    g.axial_area_m2 =
        drag.axial_area_m2.value_or(std::numbers::pi * cone->radius_m * cone->radius_m);
    g.height_m = -2.0 / 3.0 * cone->height_m;
  }
  return g;
}

std::optional<RigidDrag::RootLoad> RigidDrag::RootLoad::From(const RigidDrag& drag,
                                                             const Bodies& bodies) {
  if (!bodies.rigid_body) return std::nullopt;
  const RigidDragGeometry g = DragGeometry(*bodies.rigid_body, drag);
  return RootLoad{bodies.water.density_kg_m3, drag.lateral_coefficient, drag.axial_coefficient,
                  g.lateral_area_m2,          g.axial_area_m2,          g.height_m};
}

Vector6 RigidDrag::RootLoad::Wrench(const SectionMotion& root) const {
  const Vector6& v = root.twist;
  Vector6 w = Vector6::Zero();
  const double k = 0.5 * water_density_kg_m3;
  AddLateralDragSlice(k * lateral_coefficient * lateral_area_m2, height_m, v, &w);
  w(5) -= k * axial_coefficient * axial_area_m2 * v(5) * std::abs(v(5));
  return w;
}

void RigidDrag::RootLoad::AddTangent(const SectionMotion& root, double scale,
                                     RootTangent* t) const {
  const Vector6& v = root.twist;
  Matrix6 by_twist = Matrix6::Zero();
  Vector6 by_z = Vector6::Zero(), by_k = Vector6::Zero();
  const double k = 0.5 * water_density_kg_m3;
  AddLateralDragSliceTangent(k * lateral_coefficient * lateral_area_m2, height_m, v, &by_twist,
                             &by_z, &by_k);
  by_twist(5, 5) -= 2.0 * k * axial_coefficient * axial_area_m2 * std::abs(v(5));
  t->by_twist += scale * by_twist;
}

}  // namespace mantle::model
