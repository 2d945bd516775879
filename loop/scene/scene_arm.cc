#include <fmt/format.h>

#include <cmath>

#include "loop/scene/scene_parts.h"

namespace mantle::scene {
namespace {

constexpr double kOrthogonality = 1e-6;  // of a matrix's rows: written with seven digits or more
// Sine of the smallest angle between axis and normal: below, the frame is not defined.
constexpr double kParallel = 1e-6;

Matrix3 FrameOf(TomlReader* table, const Vector3& axis, std::optional<Vector3> normal) {
  if (!normal) {
    int least = 0;
    axis.cwiseAbs().minCoeff(&least);
    normal = Vector3::Unit(least);
  }
  const Vector3 z = axis.cross(*normal);
  if (z.norm() < kParallel) table->Fail("normal", "must not be parallel to `axis`");
  Matrix3 m;
  m << axis, z.normalized().cross(axis), z.normalized();
  return m;
}

DistributedWrench ReadDistributed(TomlReader table, std::size_t index) {
  DistributedWrench d;
  d.name = table.Name("name", fmt::format("load{}", index + 1));
  d.direction << table.Vector("moment", Quantity::kMomentPerLength, Vector3::Zero()),
      table.Vector("force", Quantity::kForcePerLength, Vector3::Zero());
  if (d.direction.isZero(0.0))
    table.Fail("moment", "`moment` or `force` must be given and not zero");
  d.base = table.Number("base", Quantity::kNumber, kAnyValue, 1.0);
  d.tip = table.Number("tip", Quantity::kNumber, kAnyValue, 1.0);
  d.frame = table.Choice<LoadFrame>(
      "frame", {{"body", LoadFrame::kBody}, {"world", LoadFrame::kWorld}}, LoadFrame::kBody);
  d.schedule = ReadOptionalSchedule(&table, "schedule", Quantity::kNumber, kAnyValue)
                   .value_or(ConstantSchedule{1});
  table.Finish();
  return d;
}

PointWrench ReadPoint(TomlReader table, std::size_t index, double length_m) {
  PointWrench p;
  p.name = table.Name("name", fmt::format("point{}", index + 1));
  p.at_m = table.Number("at", Quantity::kLength, Range{0, length_m}, length_m);
  p.wrench << table.Vector("moment", Quantity::kMoment, Vector3::Zero()),
      table.Vector("force", Quantity::kForce, Vector3::Zero());
  if (p.wrench.isZero(0.0)) table.Fail("force", "`force` or `moment` must be given and not zero");
  p.frame = table.Choice<LoadFrame>(
      "frame", {{"body", LoadFrame::kBody}, {"world", LoadFrame::kWorld}}, LoadFrame::kWorld);
  p.schedule = ReadOptionalSchedule(&table, "schedule", Quantity::kNumber, kAnyValue)
                   .value_or(ConstantSchedule{1});
  table.Finish();
  return p;
}

ArmCable ReadCable(TomlReader table, std::size_t index, double length_m) {
  ArmCable c;
  c.name = table.Name("name", fmt::format("cable{}", index + 1));
  c.fraction = table.Number("fraction", Quantity::kNumber, Range{0, 1}, 0.6);
  c.angle_rad = table.Number("angle", Quantity::kAngle, kAnyValue, 0.0);
  c.turns = table.Number("turns", Quantity::kNumber, kAnyValue, 0.0);
  if (std::optional<TomlReader> path = table.OptionalTable("path")) {
    for (const char* key : {"fraction", "angle", "turns"}) {
      if (table.Has(key)) table.Fail(key, "contradicts path: a cable has one way through the arm");
    }
    const std::vector<double> at = path->Numbers("at", Quantity::kLength, Range{0, length_m});
    const int count = static_cast<int>(at.size());
    const std::vector<double> y = path->Numbers("y", Quantity::kLength, kAnyValue, count);
    const std::vector<double> z = path->Numbers("z", Quantity::kLength, kAnyValue, count);
    for (int i = 0; i < count; ++i) {
      if (i > 0 && at[i] <= at[i - 1]) path->Fail("at", "must ascend");
      c.path.emplace_back(at[i], y[i], z[i]);
    }
    path->Finish();
  }
  c.end_m = table.Number("end", Quantity::kLength, Range{0, length_m, true}, length_m);
  c.drive = ReadCableDrive(&table);
  table.Finish();
  return c;
}

void ReadSections(TomlReader* table, Arm* arm) {
  const TomlValue* radius = table->Raw("radius");
  if (radius != nullptr && radius->kind == TomlValue::Kind::kArray) {
    const auto both = table->Numbers("radius", Quantity::kLength, kPositive, 2);
    arm->radius_base_m = both[0];
    arm->radius_tip_m = both[1];
  } else {
    arm->radius_base_m = arm->radius_tip_m = table->Number("radius", Quantity::kLength, kPositive);
  }
  arm->stiffness = table->OptionalDiagonal("stiffness", Quantity::kSectionStiffness, kPositive);
  arm->viscosity = table->OptionalDiagonal("damping", Quantity::kSectionDamping, kNonNegative);
  arm->inertia = table->OptionalDiagonal("inertia", Quantity::kSectionInertia, kPositive);
  // Sections that are given in full need no material.
  if (table->Has("material") || !arm->stiffness || !arm->inertia) {
    arm->material = ReadMaterial(table, "material");
  }
  arm->shear_correction = table->Number("shear_correction", Quantity::kNumber, kPositive, 1.0);
}

void ReadCurvature(TomlReader* table, Arm* arm) {
  const TomlValue* value = table->Raw("curvature");
  if (value == nullptr) return;
  if (value->kind != TomlValue::Kind::kTable) {
    arm->curvature_base = table->Vector("curvature", Quantity::kCurvature, Vector3::Zero());
    arm->curvature_tip = arm->curvature_base;
    return;
  }
  TomlReader ends = table->Table("curvature");
  arm->curvature_base = ends.Vector("base", Quantity::kCurvature, Vector3::Zero());
  arm->curvature_tip = ends.Vector("tip", Quantity::kCurvature, Vector3::Zero());
  ends.Finish();
}

}  // namespace

Pose ReadPose(TomlReader table) {
  Pose pose;
  pose.position = table.Vector("position", Quantity::kLength, Vector3::Zero());
  const auto axis = table.OptionalDirection("axis");
  const auto normal = table.OptionalDirection("normal");
  const auto rotation = table.OptionalVector("rotation", Quantity::kAngle);
  const bool matrix = table.Has("matrix");
  if (static_cast<int>(axis.has_value()) + rotation.has_value() + matrix > 1) {
    table.Fail(matrix ? "matrix" : "rotation",
               "only one of `axis`, `rotation` and `matrix` may be given");
  }
  if (normal && !axis) table.Fail("normal", "needs `axis`");
  if (axis) pose.rotation = Eigen::Quaterniond(FrameOf(&table, *axis, normal));
  if (rotation) pose.rotation = ExpSO3(*rotation);
  if (matrix) {
    const Matrix3 m = table.Matrix("matrix", Quantity::kNumber);
    if (!(m * m.transpose()).isIdentity(kOrthogonality) || m.determinant() < 0) {
      table.Fail("matrix", "must be a rotation: orthogonal to 1e-6, with determinant 1");
    }
    pose.rotation = Eigen::Quaterniond(m);
  }
  pose.rotation.normalize();
  table.Finish();
  return pose;
}

Vector6 ReadTwist(TomlReader table) {
  Vector6 twist;
  twist << table.Vector("angular", Quantity::kAngularSpeed, Vector3::Zero()),
      table.Vector("linear", Quantity::kSpeed, Vector3::Zero());
  table.Finish();
  return twist;
}

Arm ReadArm(TomlReader table, int index) {
  Arm arm;
  arm.name = table.Name("name", fmt::format("arm{}", index + 1));
  if (auto mount = table.OptionalTable("mount", "pose")) arm.mount = ReadPose(*mount);
  arm.length_m = table.Number("length", Quantity::kLength, kPositive);
  ReadSections(&table, &arm);
  ReadCurvature(&table, &arm);
  arm.drag_coefficients = table.Vector("drag_coefficients", Quantity::kNumber, Vector3::Zero());
  if (arm.drag_coefficients.minCoeff() < 0) table.Fail("drag_coefficients", "must be >= 0");
  arm.added_mass_coefficient =
      table.Number("added_mass_coefficient", Quantity::kNumber, kNonNegative, 0.0);
  arm.elements = table.Integer("elements", 1, kMaxElements, arm.elements);
  const auto cables = table.Tables("cables");
  for (std::size_t i = 0; i < cables.size(); ++i) {
    arm.cables.push_back(ReadCable(cables[i], i, arm.length_m));
  }
  const auto distributed = table.Tables("distributed");
  for (std::size_t i = 0; i < distributed.size(); ++i) {
    arm.distributed.push_back(ReadDistributed(distributed[i], i));
  }
  const auto points = table.Tables("points");
  for (std::size_t i = 0; i < points.size(); ++i) {
    arm.points.push_back(ReadPoint(points[i], i, arm.length_m));
  }
  arm.initial_mode1_tip_speed_m_s =
      table.Number("initial_mode1_tip_speed", Quantity::kSpeed, kAnyValue, 0.0);
  if (auto twist = table.OptionalTable("initial_twist", "twist")) {
    arm.initial_twist = ReadTwist(*twist);
  }
  table.Finish();
  return arm;
}

}  // namespace mantle::scene
