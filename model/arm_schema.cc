#include <fmt/format.h>

#include "model/robot_schema.h"

namespace mantle::model {
namespace {

using schema::kAnyValue;
using schema::Key;
using schema::kNonNegative;
using schema::kOneOrMore;
using schema::kPositive;
using schema::Optional;
using schema::Presence;
using schema::Quantity;
using schema::Range;
using schema::Required;
using schema::Visitor;

constexpr std::string_view kUnique = "unique in the arm";

// Name of the n-th of its kind where the scene gives none.
void DescribeName(Visitor& v, std::string_view kind, int index, std::string* name) {
  *name = fmt::format("{}{}", kind, index + 1);
  const std::string fallback = fmt::format("{}1, ...", kind);
  v.Name({.name = "name", .fallback = fallback, .also = kUnique}, name);
}

void DescribeFrame(Visitor& v, std::string_view meaning, LoadFrame* frame) {
  v.Choice<LoadFrame>({"frame", meaning},
                      {{"body", LoadFrame::kBody}, {"world", LoadFrame::kWorld}}, frame);
}

void DescribeFactor(Visitor& v, Schedule* schedule) {
  *schedule = ConstantSchedule{1};
  DescribeSchedule(v, {"schedule", "factor in time"}, Quantity::kNumber, kAnyValue, schedule);
}

void DescribeDistributed(Visitor& v, int index, DistributedWrench& d) {
  DescribeName(v, "load", index, &d.name);
  Vector3 moment = d.direction.head<3>(), force = d.direction.tail<3>();
  v.Vector({.name = "moment", .also = "one of both not zero"}, Quantity::kMomentPerLength,
           kAnyValue, &moment);
  v.Vector({"force"}, Quantity::kForcePerLength, kAnyValue, &force);
  d.direction << moment, force;
  v.Demand(!d.direction.isZero(0.0), "moment", "`moment` or `force` must be given and not zero");
  v.Number({"base", "shape at the base"}, Quantity::kNumber, kAnyValue, &d.base);
  v.Number({"tip", "shape at the tip"}, Quantity::kNumber, kAnyValue, &d.tip);
  DescribeFrame(v,
                "an actuator's: turns with the section, its reaction on the root; or dead and "
                "external",
                &d.frame);
  DescribeFactor(v, &d.schedule);
}

void DescribePoint(Visitor& v, int index, double length_m, PointWrench& p) {
  DescribeName(v, "point", index, &p.name);
  p.at_m = length_m;
  v.Number(
      {.name = "at", .meaning = "arc length", .fallback = "`length`", .bound = "[0, `length`]"},
      Quantity::kLength, Range{0, length_m}, &p.at_m);
  Vector3 moment = p.wrench.head<3>(), force = p.wrench.tail<3>();
  v.Vector({.name = "moment", .also = "one of both not zero"}, Quantity::kMoment, kAnyValue,
           &moment);
  v.Vector({"force"}, Quantity::kForce, kAnyValue, &force);
  p.wrench << moment, force;
  v.Demand(!p.wrench.isZero(0.0), "force", "`force` or `moment` must be given and not zero");
  DescribeFrame(v, "follower, or dead", &p.frame);
  DescribeFactor(v, &p.schedule);
}

void DescribePath(Visitor& v, double length_m, std::vector<Vector3>* path) {
  std::vector<double> at, y, z;
  v.Numbers(Required({.name = "at",
                      .meaning = "arc lengths of the path's points",
                      .bound = "[0, `length`], ascending"}),
            Quantity::kLength, Range{0, length_m}, kOneOrMore, &at);
  const int count = v.describing() ? kOneOrMore : static_cast<int>(at.size());
  v.Numbers(Required({.name = "y",
                      .meaning = "offsets at these points, linear between them, constant beyond",
                      .bound = "inside the section"}),
            Quantity::kLength, kAnyValue, count, &y);
  v.Numbers(Required({.name = "z", .bound = "inside the section"}), Quantity::kLength, kAnyValue,
            count, &z);
  for (std::size_t i = 0; i < at.size(); ++i) {
    v.Demand(i == 0 || at[i] > at[i - 1], "at", "must ascend");
    path->emplace_back(at[i], y[i], z[i]);
  }
}

void DescribeCable(Visitor& v, int index, double length_m, ArmCable& c) {
  DescribeName(v, "cable", index, &c.name);
  if (v.Has("path")) {
    for (const char* key : {"fraction", "angle", "turns"}) {
      v.Demand(!v.Has(key), key, "contradicts path: a cable has one way through the arm");
    }
  } else {
    v.Number({"fraction", "distance from the centreline over the section's radius"},
             Quantity::kNumber, schema::kShare, &c.fraction);
    v.Number({"angle", "where in the section, from y towards z"}, Quantity::kAngle, kAnyValue,
             &c.angle_rad);
    v.Number({"turns", "turns about the arm over its whole length"}, Quantity::kNumber, kAnyValue,
             &c.turns);
  }
  v.Table(Optional({.name = "path",
                    .meaning = "any path: `at`, `y`, `z`, arrays of one length",
                    .also = "instead of `fraction`, `angle`, `turns`"}),
          [&](Visitor& t) { DescribePath(t, length_m, &c.path); });
  c.end_m = length_m;
  v.Number({.name = "end",
            .meaning = "arc length at which it ends",
            .fallback = "`length`",
            .bound = "(0, `length`]"},
           Quantity::kLength, Range{0, length_m, true}, &c.end_m);
  Describe(v, c.drive);
}

void DescribeSections(Visitor& v, Arm& arm) {
  const Key radius = Required({"radius", "constant, or [base, tip]"});
  v.Either(
      radius, schema::Form::kArray,
      [&] {
        std::vector<double> both(2);
        v.Numbers(radius, Quantity::kLength, kPositive, 2, &both);
        arm.radius_base_m = both[0];
        arm.radius_tip_m = both[1];
      },
      [&] {
        v.Number(radius, Quantity::kLength, kPositive, &arm.radius_base_m);
        arm.radius_tip_m = arm.radius_base_m;
      });
  v.Diagonal({"stiffness", "diagonal, constant along the arm", "from material"},
             Quantity::kSectionStiffness, kPositive, &arm.stiffness);
  v.Diagonal({"damping", "diagonal; acts with `effects.viscosity`", "from material"},
             Quantity::kSectionDamping, kNonNegative, &arm.viscosity);
  v.Diagonal({"inertia", "diagonal", "from material"}, Quantity::kSectionInertia, kPositive,
             &arm.inertia);
  // Sections that are given in full need no material.
  const bool needed = !v.describing() && (!arm.stiffness || !arm.inertia);
  DescribeMaterial(v,
                   {.name = "material",
                    .also = "unless `stiffness` and `inertia` are given",
                    .presence = needed ? Presence::kRequired : Presence::kOptional},
                   &arm.material);
  v.Number({"shear_correction", "factor on the shear stiffness"}, Quantity::kNumber, kPositive,
           &arm.shear_correction);
}

void DescribeCurvature(Visitor& v, Arm& arm) {
  const Key key = {.name = "curvature",
                   .meaning = "twist and curvatures at rest",
                   .also = "an element turns < 1 rad"};
  v.Either(
      key, schema::Form::kTable,
      [&] {
        v.Table(key, [&](Visitor& ends) {
          ends.Vector({"base", "at the base, linear in between"}, Quantity::kCurvature, kAnyValue,
                      &arm.curvature_base);
          ends.Vector({"tip", "at the tip"}, Quantity::kCurvature, kAnyValue, &arm.curvature_tip);
        });
      },
      [&] {
        v.Vector(key, Quantity::kCurvature, kAnyValue, &arm.curvature_base);
        arm.curvature_tip = arm.curvature_base;
      });
}

template <typename Item, typename Visit>
void DescribeList(Visitor& v, const Key& key, std::vector<Item>* items, Visit visit) {
  v.Tables(Optional(key), [&](Visitor& t, int index) { visit(t, index, items->emplace_back()); });
}

}  // namespace

void DescribeArm(Visitor& v, int index, Arm& arm) {
  arm.name = fmt::format("arm{}", index + 1);
  v.Name({.name = "name", .fallback = "arm1, arm2, ...", .also = "unique"}, &arm.name);
  v.Object({.name = "mount",
            .meaning = "base frame in the root frame",
            .fallback = "identity",
            .type = "pose"},
           &arm.mount);
  v.Number(Required({"length"}), Quantity::kLength, kPositive, &arm.length_m);
  DescribeSections(v, arm);
  DescribeCurvature(v, arm);
  v.Vector({"drag_coefficients", "C_x, C_y, C_z; act with `effects.drag`"}, Quantity::kNumber,
           kNonNegative, &arm.drag_coefficients);
  v.Number({"added_mass_coefficient", "B, lateral; acts with `effects.added_mass`"},
           Quantity::kNumber, kNonNegative, &arm.added_mass_coefficient);
  v.Integer({"elements"}, 1, kMaxElements, &arm.elements);
  DescribeList(v, {"cables", "pull along a path through the arm"}, &arm.cables,
               [&](Visitor& t, int i, ArmCable& c) { DescribeCable(t, i, arm.length_m, c); });
  DescribeList(v,
               {"distributed", "wrench per length, direction (base + (tip - base) X/L) schedule"},
               &arm.distributed, DescribeDistributed);
  DescribeList(v, {"points", "wrenches at one place; a node is moved there"}, &arm.points,
               [&](Visitor& t, int i, PointWrench& p) { DescribePoint(t, i, arm.length_m, p); });
  v.Number(
      {"initial_mode1_tip_speed", "velocity at t = 0: first bending mode, tip speed along base y"},
      Quantity::kSpeed, kAnyValue, &arm.initial_mode1_tip_speed_m_s);
  v.Table({.name = "initial_twist",
           .meaning = "rigid velocity at t = 0 relative to the root, about the base frame",
           .fallback = "zero",
           .type = "twist"},
          [&](Visitor& t) { DescribeTwist(t, arm.initial_twist); });
}

}  // namespace mantle::model
