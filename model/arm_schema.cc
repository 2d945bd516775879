#include <fmt/format.h>

#include <algorithm>

#include "model/arm_section.h"
#include "model/robot_schema.h"
#include "model/rod.h"

namespace mantle::model {
namespace {

using schema::kAnyValue;
using schema::Key;
using schema::kNonNegative;
using schema::kOneOrMore;
using schema::kPositive;
using schema::Optional;
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
  v.Vector({.name = "moment", .also = "this or `force`"}, Quantity::kMomentPerLength, kAnyValue,
           &moment);
  v.Vector({"force"}, Quantity::kForcePerLength, kAnyValue, &force);
  d.direction << moment, force;
  v.Demand(v.describing() || v.Has("moment") || v.Has("force"), "moment",
           "`moment` or `force` must be given");
  v.Number({"base", "shape at the base"}, Quantity::kNumber, kAnyValue, &d.base);
  v.Number({"tip", "shape at the tip"}, Quantity::kNumber, kAnyValue, &d.tip);
  DescribeFrame(v, "turns with the section (follower), or not (dead)", &d.frame);
  int source = -1;
  v.Pick(Optional({.name = "source",
                   .meaning = "an actuator's, its reaction on the root; or the world's",
                   .fallback = "`internal` in frame `body`, `external` in `world`"}),
         {"internal", "external"}, &source);
  if (source >= 0) d.internal = source == 0;
  DescribeFactor(v, &d.schedule);
}

void DescribeMuscle(Visitor& v, int index, double length_m, MuscleWave& m) {
  DescribeName(v, "muscle", index, &m.name);
  v.Direction({"axis", "section axis that it bends about, towards positive curvature (x: twist)"},
              &m.axis);
  DescribeSchedule(v,
                   Required({"amplitude",
                             "internal moment amplitude e(X) sin(2 pi (turns - X / wave_length) + "
                             "phase), turns the integral of `frequency`"}),
                   Quantity::kMoment, kAnyValue, &m.amplitude_n_m);
  DescribeSchedule(v, Required({"wave_length"}), Quantity::kLength, kPositive, &m.wave_length_m);
  DescribeSchedule(v, Required({"frequency", "towards the tip where positive"}),
                   Quantity::kFrequency, kAnyValue, &m.frequency_hz);
  v.Number({"phase"}, Quantity::kAngle, kAnyValue, &m.phase_rad);
  v.Tables(
      Optional({.name = "envelope",
                .meaning = "e(X): points, linear between, constant beyond",
                .fallback = "1 everywhere"}),
      [&](Visitor& t, int) {
        MuscleWave::Envelope& e = m.envelope.emplace_back();
        t.Number(
            Required({.name = "at", .meaning = "arc length", .bound = "[0, `length`], ascending"}),
            Quantity::kLength, Range{0, length_m}, &e.at_m);
        DescribeSchedule(t, Required({"factor"}), Quantity::kNumber, kAnyValue, &e.factor);
        const std::size_t n = m.envelope.size();
        t.Demand(t.describing() || n < 2 || e.at_m > m.envelope[n - 2].at_m, "at",
                 fmt::format("{} m: must ascend", e.at_m));
      });
}

void DescribePayload(Visitor& v, int index, double length_m, Payload& p) {
  DescribeName(v, "payload", index, &p.name);
  p.at_m = length_m;
  v.Number(
      {.name = "at", .meaning = "arc length", .fallback = "`length`", .bound = "[0, `length`]"},
      Quantity::kLength, Range{0, length_m}, &p.at_m);
  v.Vector({"offset", "of its centre from the section's, section frame"}, Quantity::kLength,
           kAnyValue, &p.offset_m);
  v.Number(Required({"mass"}), Quantity::kMass, kPositive, &p.mass_kg);
  v.Matrix(Optional({.name = "inertia",
                     .meaning = "about its centre, axes of the section",
                     .fallback = "zero: a point mass",
                     .also = "a body's"}),
           Quantity::kInertia, &p.inertia_kg_m2);
  v.Number({"volume", "displaced"}, Quantity::kVolume, kNonNegative, &p.volume_m3);
  v.Number({.name = "drop", .meaning = "time at which it leaves the arm", .fallback = "never"},
           Quantity::kTime, kPositive, &p.drop_s);
}

void DescribeInitialMode(Visitor& v, InitialMode& mode) {
  v.Integer(Required({"mode",
                      "number, by frequency, of the arm clamped alone; of two with one "
                      "frequency the first moves the tip along y"}),
            1, 1000, &mode.number);
  v.Number(Required({"speed", "of the fastest node"}), Quantity::kSpeed, kAnyValue,
           &mode.speed_m_s);
}

void DescribeInitialStrain(Visitor& v, const Arm& arm, StrainTable& table) {
  v.Numbers(Required({.name = "at", .meaning = "arc lengths", .bound = "[0, `length`], ascending"}),
            Quantity::kLength, Range{0, arm.length_m}, kOneOrMore, &table.at_m);
  for (std::size_t i = 0; i < table.at_m.size(); ++i) {
    v.Demand(i == 0 || table.at_m[i] > table.at_m[i - 1], "at", "must ascend");
    table.strain.push_back(ArmRestStrain(arm, table.at_m[i]));
  }
  const int count = v.describing() ? kOneOrMore : static_cast<int>(table.at_m.size());
  const auto component = [&](const char* name, const char* meaning, Quantity quantity, int k) {
    std::vector<double> values;
    const schema::Range range = k == 3 ? kPositive : kAnyValue;
    if (!v.Numbers(Optional({.name = name, .meaning = meaning, .fallback = "as at rest"}), quantity,
                   range, count, &values)) {
      return;
    }
    for (std::size_t i = 0; i < values.size(); ++i) table.strain[i](k) = values[i];
  };
  component("twist", "one per `at`, as all below; linear between, constant beyond",
            Quantity::kCurvature, 0);
  component("bending_y", "curvature about y", Quantity::kCurvature, 1);
  component("bending_z", "curvature about z", Quantity::kCurvature, 2);
  component("stretch", "1: none", Quantity::kNumber, 3);
  component("shear_y", "", Quantity::kNumber, 4);
  component("shear_z", "", Quantity::kNumber, 5);
}

void DescribePoint(Visitor& v, int index, double length_m, PointWrench& p) {
  DescribeName(v, "point", index, &p.name);
  p.at_m = length_m;
  v.Number(
      {.name = "at", .meaning = "arc length", .fallback = "`length`", .bound = "[0, `length`]"},
      Quantity::kLength, Range{0, length_m}, &p.at_m);
  Vector3 moment = p.wrench.head<3>(), force = p.wrench.tail<3>();
  v.Vector({.name = "moment", .also = "this or `force`"}, Quantity::kMoment, kAnyValue, &moment);
  v.Vector({"force"}, Quantity::kForce, kAnyValue, &force);
  p.wrench << moment, force;
  v.Demand(v.describing() || v.Has("moment") || v.Has("force"), "force",
           "`force` or `moment` must be given");
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
  DescribeList(v,
               {"muscles",
                "internal moments that travel along the arm as waves; no cable, no "
                "reaction but through the arm's base"},
               &arm.muscles,
               [&](Visitor& t, int i, MuscleWave& m) { DescribeMuscle(t, i, arm.length_m, m); });
  DescribeList(v, {"payloads", "rigid bodies carried by a section; a node is moved there"},
               &arm.payloads,
               [&](Visitor& t, int i, Payload& p) { DescribePayload(t, i, arm.length_m, p); });
  StrainTable strain;
  if (v.Table(Optional({.name = "initial_strain",
                        .meaning = "shape at t = 0",
                        .fallback = "as at rest",
                        .also = "not with `robot.initial`"}),
              [&](Visitor& t) { DescribeInitialStrain(t, arm, strain); })) {
    arm.initial_strain = strain;
  }
  DescribeList(v, {"initial_modes", "velocities at t = 0 in modes of vibration; they add up"},
               &arm.initial_modes,
               [](Visitor& t, int, InitialMode& m) { DescribeInitialMode(t, m); });
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
