#include <fmt/format.h>

#include <algorithm>

#include "loop/scene/scene_parts.h"

namespace mantle::scene {
namespace {

class Checker {
 public:
  explicit Checker(const SceneContext& context) : context_(context) {}

  void Demand(bool ok, std::string_view path, std::string_view what) const {
    if (!ok) throw BadScene(fmt::format("{}: {}: {}", context_.name, path, what));
  }

  template <typename Items>
  void DemandUniqueNames(const std::string& path, const Items& items) const {
    std::set<std::string> seen;
    for (std::size_t i = 0; i < items.size(); ++i) {
      Demand(seen.insert(items[i].name).second, fmt::format("{}[{}].name", path, i),
             fmt::format("\"{}\": must be used only once", items[i].name));
    }
  }

 private:
  const SceneContext& context_;
};

bool AnyArm(const Robot& robot, bool (*has)(const Arm&)) {
  return std::any_of(robot.arms.begin(), robot.arms.end(), has);
}

void CheckMantleEffects(const Robot& robot, const Checker& check) {
  const Effects& e = robot.effects;
  const bool mantle = robot.mantle.has_value();
  constexpr std::string_view kNeedsMantle = "named, but the scene has no mantle for it";
  check.Demand(mantle || !e.jet_thrust, "effects.jet_thrust", kNeedsMantle);
  check.Demand(mantle || !e.contained_water, "effects.contained_water", kNeedsMantle);
  check.Demand(mantle || !e.lateral_added_mass, "effects.lateral_added_mass", kNeedsMantle);
  check.Demand(mantle || !e.lateral_drag, "effects.lateral_drag", kNeedsMantle);
  check.Demand(mantle || !e.normal_pressure, "effects.normal_pressure", kNeedsMantle);
  if (!mantle) return;
  check.Demand(!e.jet_thrust || robot.mantle->nozzle_radius_m > 0, "effects.jet_thrust",
               "named, but mantle.nozzle_radius is not given: must be > 0 m");
}

void CheckCoefficients(const Robot& robot, const Checker& check) {
  const Effects& e = robot.effects;
  const bool viscous =
      AnyArm(robot,
             [](const Arm& a) {
               return a.material.viscosity_pa_s > 0 || (a.viscosity && !a.viscosity->isZero(0.0));
             }) ||
      (robot.mantle && robot.mantle->material.viscosity_pa_s > 0);
  check.Demand(!e.viscosity || viscous, "effects.viscosity",
               "named, but no material has `viscosity` > 0 Pa s and no arm `damping`");
  const bool drag = AnyArm(robot, [](const Arm& a) { return !a.drag_coefficients.isZero(0.0); }) ||
                    (robot.mantle && robot.mantle->drag_coefficient > 0);
  check.Demand(
      !e.drag || drag, "effects.drag",
      "named, but no arm has `drag_coefficients` and the mantle no `drag_coefficient` > 0");
  const bool added = AnyArm(robot, [](const Arm& a) { return a.added_mass_coefficient > 0; }) ||
                     (robot.mantle && robot.mantle->added_mass_coefficient > 0);
  check.Demand(!e.added_mass || added, "effects.added_mass",
               "named, but no body has an `added_mass_coefficient` > 0");
}

void CheckRigidBody(const Robot& robot, const Checker& check) {
  const auto& drag = robot.effects.rigid_drag;
  if (!drag) return;
  check.Demand(robot.rigid_body.has_value(), "effects.rigid_drag",
               "named, but the scene has no rigid body for it");
  const bool cone = std::holds_alternative<Cone>(robot.rigid_body->shape);
  check.Demand(cone || drag->lateral_area_m2, "effects.rigid_drag.lateral_area",
               "is missing: must be given [m^2] where the rigid body is not a cone");
  check.Demand(cone || drag->axial_area_m2, "effects.rigid_drag.axial_area",
               "is missing: must be given [m^2] where the rigid body is not a cone");
}

void CheckRoot(const Robot& robot, const Checker& check) {
  const bool frozen = robot.coupling == Coupling::kFrozen;
  check.Demand(!frozen || std::holds_alternative<FreeRoot>(robot.root), "robot.coupling",
               "\"frozen\": must be \"exact\" where the root is not free");
  check.Demand(std::holds_alternative<FreeRoot>(robot.root) || robot.root_twist.isZero(0.0),
               "robot.twist", "must be absent where the root is not free");
  check.Demand(!robot.arms.empty() || robot.mantle || robot.rigid_body, "arms",
               "the scene has no bodies: needs at least one of [[arms]], [mantle], [rigid_body]");
}

}  // namespace

void CheckScene(const Robot& robot, bool gravity_given, const SceneContext& context) {
  const Checker check(context);
  CheckRoot(robot, check);
  check.Demand(!gravity_given || robot.effects.weight || robot.effects.buoyancy, "effects.gravity",
               "given, but neither `weight` nor `buoyancy` is named");
  CheckMantleEffects(robot, check);
  CheckCoefficients(robot, check);
  CheckRigidBody(robot, check);
  check.DemandUniqueNames("arms", robot.arms);
  for (std::size_t i = 0; i < robot.arms.size(); ++i) {
    const Arm& arm = robot.arms[i];
    check.DemandUniqueNames(fmt::format("arms[{}].cables", i), arm.cables);
    check.DemandUniqueNames(fmt::format("arms[{}].distributed", i), arm.distributed);
    check.DemandUniqueNames(fmt::format("arms[{}].points", i), arm.points);
  }
  if (robot.mantle) {
    check.DemandUniqueNames("mantle.strips", robot.mantle->strips);
    check.DemandUniqueNames("mantle.spokes", robot.mantle->spokes);
  }
}

}  // namespace mantle::scene
