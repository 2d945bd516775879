#include "model/robot_schema.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "model/arm_section.h"

namespace mantle::model {
namespace {

using schema::kAnyValue;
using schema::kPositive;
using schema::Optional;
using schema::Quantity;
using schema::Visitor;

constexpr double kOrthogonality = 1e-6;  // of a matrix's rows: written with seven digits or more
// Sine of the smallest angle between axis and normal: below, the frame is not defined.
constexpr double kParallel = 1e-6;

Matrix3 FrameOf(Visitor& v, const Vector3& axis, std::optional<Vector3> normal) {
  if (!normal) {
    int least = 0;
    axis.cwiseAbs().minCoeff(&least);
    normal = Vector3::Unit(least);
  }
  const Vector3 z = axis.cross(*normal);
  v.Demand(z.norm() >= kParallel, "normal", "must not be parallel to `axis`");
  Matrix3 m;
  m << axis, z.normalized().cross(axis), z.normalized();
  return m;
}

void DescribePrescribed(Visitor& v, PrescribedRoot& root) {
  DescribeSchedule(v,
                   {.name = "x",
                    .meaning = "displacement along world x",
                    .also = "at least one of `x`, `y`, `z`, `angle`"},
                   Quantity::kLength, kAnyValue, &root.x_m);
  DescribeSchedule(v, {"y", "along world y"}, Quantity::kLength, kAnyValue, &root.y_m);
  DescribeSchedule(v, {"z", "along world z"}, Quantity::kLength, kAnyValue, &root.z_m);
  DescribeSchedule(v, {"angle", "rotation about `axis`"}, Quantity::kAngle, kAnyValue,
                   &root.angle_rad);
  v.Direction({"axis", "fixed axis in the world"}, &root.rotation_axis);
  v.Demand(root.x_m || root.y_m || root.z_m || root.angle_rad, "x",
           "a prescribed root needs at least one of `x`, `y`, `z`, `angle`");
}

bool AnyArm(const Robot& robot, bool (*has)(const Arm&)) {
  return std::any_of(robot.arms.begin(), robot.arms.end(), has);
}

void CheckMantleEffects(Visitor& v, const Robot& robot) {
  const Effects& e = robot.effects;
  const bool mantle = robot.mantle.has_value();
  const char* needs = "named, but the scene has no mantle for it";
  v.DemandAt(mantle || !e.jet_thrust, "effects.jet_thrust", needs);
  v.DemandAt(mantle || !e.contained_water, "effects.contained_water", needs);
  v.DemandAt(mantle || !e.lateral_added_mass, "effects.lateral_added_mass", needs);
  v.DemandAt(mantle || !e.lateral_drag, "effects.lateral_drag", needs);
  v.DemandAt(mantle || !e.normal_pressure, "effects.normal_pressure", needs);
  v.DemandAt(!mantle || !e.jet_thrust || robot.mantle->nozzle_radius_m > 0, "effects.jet_thrust",
             "named, but mantle.nozzle_radius is not given: must be > 0 m");
}

void CheckCoefficients(Visitor& v, const Robot& robot) {
  const Effects& e = robot.effects;
  const bool viscous = AnyArm(robot,
                              [](const Arm& a) {
                                for (const ArmPiece& p : PiecesOf(a)) {
                                  const bool given = p.viscosity && !p.viscosity->isZero(0.0);
                                  if (!p.rigid && (given || p.material.viscosity_pa_s > 0))
                                    return true;
                                }
                                return false;
                              }) ||
                       (robot.mantle && robot.mantle->material.viscosity_pa_s > 0);
  v.DemandAt(!e.viscosity || viscous, "effects.viscosity",
             "named, but no material has `viscosity` > 0 Pa s and no arm `damping`");
  const bool drag = AnyArm(robot, [](const Arm& a) { return !a.drag_coefficients.isZero(0.0); }) ||
                    (robot.mantle && robot.mantle->drag_coefficient > 0);
  v.DemandAt(!e.drag || drag, "effects.drag",
             "named, but no arm has `drag_coefficients` and the mantle no `drag_coefficient` > 0");
  const bool added = AnyArm(robot, [](const Arm& a) { return a.added_mass_coefficient > 0; }) ||
                     (robot.mantle && robot.mantle->added_mass_coefficient > 0);
  v.DemandAt(!e.added_mass || added, "effects.added_mass",
             "named, but no body has an `added_mass_coefficient` > 0");
}

void CheckNamedEffects(Visitor& v, const Robot& robot) {
  robot.effects.named.ForEach([&](const auto& effect) {
    using Effect = EffectType<decltype(effect)>;
    if constexpr (requires { &Effect::Check; }) {
      if (effect) Effect::Check(v, *effect, robot);
    }
  });
}

template <typename Items>
void DemandUniqueNames(Visitor& v, const std::string& path, const Items& items) {
  std::set<std::string> seen;
  for (std::size_t i = 0; i < items.size(); ++i) {
    v.DemandAt(seen.insert(items[i].name).second, fmt::format("{}[{}].name", path, i),
               fmt::format("\"{}\": must be used only once", items[i].name));
  }
}

void CheckRobot(Visitor& v, const Robot& robot) {
  const bool free = std::holds_alternative<FreeRoot>(robot.root);
  v.DemandAt(robot.coupling != Coupling::kFrozen || free, "robot.coupling",
             "\"frozen\": must be \"exact\" where the root is not free");
  v.DemandAt(robot.initial == InitialShape::kReference || !free, "robot.initial",
             "\"static\": must be \"rest\" where the root is free: a free robot has no unique "
             "equilibrium; robot.root = \"clamped\" or a prescribed motion holds it");
  v.DemandAt(free || robot.root_twist.isZero(0.0), "robot.twist",
             "must be absent where the root is not free");
  v.DemandAt(!robot.arms.empty() || robot.mantle || robot.rigid_body, "arms",
             "the scene has no bodies: needs at least one of [[arms]], [mantle], [rigid_body]");
  CheckMantleEffects(v, robot);
  CheckCoefficients(v, robot);
  CheckNamedEffects(v, robot);
  DemandUniqueNames(v, "arms", robot.arms);
  for (std::size_t i = 0; i < robot.arms.size(); ++i) {
    const Arm& arm = robot.arms[i];
    DemandUniqueNames(v, fmt::format("arms[{}].cables", i), arm.cables);
    DemandUniqueNames(v, fmt::format("arms[{}].distributed", i), arm.distributed);
    DemandUniqueNames(v, fmt::format("arms[{}].points", i), arm.points);
    DemandUniqueNames(v, fmt::format("arms[{}].muscles", i), arm.muscles);
    DemandUniqueNames(v, fmt::format("arms[{}].payloads", i), arm.payloads);
    v.DemandAt(robot.initial == InitialShape::kReference || !arm.initial_strain,
               fmt::format("arms[{}].initial_strain", i),
               "contradicts robot.initial = \"static\": a run starts in one shape");
  }
  if (robot.mantle) {
    DemandUniqueNames(v, "mantle.strips", robot.mantle->strips);
    DemandUniqueNames(v, "mantle.spokes", robot.mantle->spokes);
  }
}

// All of [materials] is read for its errors alone: an unused one may not be wrong either.
void CheckMaterials(Visitor& v) {
  v.NamedTables(Optional({.name = "materials", .meaning = "that bodies name", .type = "material"}),
                [](Visitor& t) {
                  Material material;
                  Describe(t, material);
                });
}

}  // namespace

void Describe(Visitor& v, Pose& pose) {
  v.Vector({"position", "origin"}, Quantity::kLength, kAnyValue, &pose.position);
  std::optional<Vector3> normal;
  v.OneOf("a pose", true,
          {{"axis",
            [&] {
              Vector3 axis = Vector3::UnitX(), y = Vector3::UnitY();
              v.Direction(Optional({"axis", "direction of the frame's x axis"}), &axis);
              if (v.Direction(Optional({.name = "normal",
                                        .meaning = "direction of its y axis, made perpendicular",
                                        .fallback = "the unit vector least along `axis`",
                                        .bound = "with `axis`, not parallel to it"}),
                              &y)) {
                normal = y;
              }
              if (!v.describing()) pose.rotation = Eigen::Quaterniond(FrameOf(v, axis, normal));
            }},
           {"rotation",
            [&] {
              Vector3 rotation = Vector3::Zero();
              v.Vector(
                  Optional({.name = "rotation", .meaning = "rotation vector", .fallback = "zero"}),
                  Quantity::kAngle, kAnyValue, &rotation);
              pose.rotation = ExpSO3(rotation);
            }},
           {"matrix", [&] {
              Matrix3 m = Matrix3::Identity();
              v.Matrix(Optional({.name = "matrix",
                                 .meaning = "rotation matrix, columns are the axes",
                                 .also = "orthogonal, determinant 1"}),
                       Quantity::kNumber, &m);
              v.Demand((m * m.transpose()).isIdentity(kOrthogonality) && !(m.determinant() < 0),
                       "matrix", "must be a rotation: orthogonal to 1e-6, with determinant 1");
              pose.rotation = Eigen::Quaterniond(m);
            }}});
  v.Demand(v.Has("axis") || !v.Has("normal"), "normal", "needs `axis`");
  pose.rotation.normalize();
}

void DescribeTwist(Visitor& v, Vector6& twist) {
  Vector3 angular = twist.head<3>(), linear = twist.tail<3>();
  v.Vector({"angular", "angular velocity"}, Quantity::kAngularSpeed, kAnyValue, &angular);
  v.Vector({"linear", "velocity"}, Quantity::kSpeed, kAnyValue, &linear);
  twist << angular, linear;
}

void Describe(Visitor& v, Water& water) {
  v.Number({"density", "density of the water"}, Quantity::kDensity, kPositive,
           &water.density_kg_m3);
}

void Describe(Visitor& v, Mismatch& m) {
  constexpr schema::Range kFactor{0.01, 100};
  v.Number({"young"}, Quantity::kNumber, kFactor, &m.young);
  v.Number({"viscosity"}, Quantity::kNumber, kFactor, &m.viscosity);
  v.Number({"drag"}, Quantity::kNumber, kFactor, &m.drag);
  v.Number({"added_mass"}, Quantity::kNumber, kFactor, &m.added_mass);
  v.Number({"jet", "thrust"}, Quantity::kNumber, kFactor, &m.jet);
}

void DescribeRoot(Visitor& v, Robot& robot) {
  const schema::Key key = {
      "root",
      "how the root moves; a table prescribes its motion, by schedules that may have kinks but not "
      "jump"};
  v.Either(
      key, schema::Form::kTable,
      [&] {
        v.Table(key, [&](Visitor& t) {
          PrescribedRoot root;
          DescribePrescribed(t, root);
          robot.root = root;
        });
      },
      [&] {
        bool clamped = false;
        v.Choice<bool>(key, {{"free", false}, {"clamped", true}}, &clamped);
        if (clamped) {
          robot.root = ClampedRoot{};
        } else {
          robot.root = FreeRoot{};
        }
      });
  v.Object({.name = "pose",
            .meaning = "root in the world at t = 0",
            .fallback = "identity",
            .type = "pose"},
           &robot.root_pose);
  v.Table({.name = "twist",
           .meaning = "its twist at t = 0, body frame",
           .fallback = "zero",
           .also = "free root only",
           .type = "twist"},
          [&](Visitor& t) { DescribeTwist(t, robot.root_twist); });
  v.Choice<Coupling>({.name = "coupling",
                      .meaning = "one momentum balance, or the paper's frozen shapes",
                      .also = "frozen: free root only"},
                     {{"exact", Coupling::kExact}, {"frozen", Coupling::kFrozen}}, &robot.coupling);
  v.Choice<InitialShape>(
      {.name = "initial",
       .meaning = "shape at t = 0: at rest, or the equilibrium under all loads at t = 0",
       .also = "static: not a free root"},
      {{"rest", InitialShape::kReference}, {"static", InitialShape::kEquilibrium}}, &robot.initial);
  v.Number(Optional({.name = "body_length",
                     .meaning = "what relative errors refer to",
                     .fallback = "extent of the shape"}),
           Quantity::kLength, kPositive, &robot.body_length_m);
}

void Describe(Visitor& v, Robot& robot) {
  v.Object({"water", "around the bodies"}, &robot.water);
  CheckMaterials(v);
  v.Table({"robot", "the root that carries the bodies"},
          [&](Visitor& t) { DescribeRoot(t, robot); });
  v.Tables(Optional({.name = "arms", .meaning = "Cosserat rods", .also = "one body at least"}),
           [&](Visitor& t, int index) { DescribeArm(t, index, robot.arms.emplace_back()); });
  Mantle mantle;
  if (v.Object(Optional({"mantle", "an axisymmetric shell"}), &mantle)) robot.mantle = mantle;
  RigidBody body;
  if (v.Object(Optional({"rigid_body", "fixed to the root"}), &body)) robot.rigid_body = body;
  v.Object({"effects", "what acts on the bodies"}, &robot.effects);
  CheckRobot(v, robot);
}

}  // namespace mantle::model
