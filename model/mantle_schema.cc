#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "model/robot_schema.h"

namespace mantle::model {
namespace {

using schema::kAnyValue;
using schema::kNonNegative;
using schema::kPositive;
using schema::Optional;
using schema::Quantity;
using schema::Range;
using schema::Required;
using schema::Visitor;

constexpr double kQuarter = std::numbers::pi / 2.0;
// A dome must not close: the shell needs r > 0 or the exact axis at X = 0.
constexpr double kAxis = 1e-12;

void DescribePiece(Visitor& v, MeridianPiece& piece) {
  v.OneOf("a piece", false,
          {{"line",
            [&] {
              v.Number(Required({"line", "length of a straight piece"}), Quantity::kLength,
                       kPositive, &piece.length_m);
            }},
           {"arc", [&] {
              v.Table({"arc", "an arc"}, [&](Visitor& arc) {
                double radius = 0, angle = -1;
                arc.Number(Required({"radius"}), Quantity::kLength, kPositive, &radius);
                arc.OneOf("an arc", false,
                          {{"angle",
                            [&] {
                              arc.Number(Required({.name = "angle",
                                                   .meaning = "turn; negative bends towards -e3",
                                                   .also = "not 0"}),
                                         Quantity::kAngle, kAnyValue, &angle);
                              arc.Demand(angle != 0.0, "angle", "must not be 0");
                              piece.length_m = std::abs(angle) * radius;
                            }},
                           {"length", [&] {
                              arc.Number(Required({"length", "arc length; bends towards -e3"}),
                                         Quantity::kLength, kPositive, &piece.length_m);
                            }}});
                piece.curvature_1_m = (angle > 0 ? 1.0 : -1.0) / radius;
              });
            }}});
}

// Sphere from polar angle `hole` outwards: theta = -(polar angle), r = R sin, bending towards -e3.
void StartOnSphere(double radius, double polar, Mantle* m) {
  m->r0_m = polar < kAxis ? 0.0 : radius * std::sin(polar);
  m->theta0_rad = -polar;
}

void DescribeHemisphereCylinder(Visitor& v, double radius, Mantle* m) {
  double cylinder = 0;
  v.Number(Required({"cylinder", "length of the cylinder"}), Quantity::kLength, kPositive,
           &cylinder);
  const double full = cylinder + kQuarter * radius;
  double length = full;
  v.Number({.name = "meridian",
            .meaning = "whole meridian; a shorter one leaves a hole at the apex",
            .fallback = "closed dome",
            .bound = "(`cylinder`, `cylinder` + pi/2 `radius`]"},
           Quantity::kLength, Range{cylinder, full, true}, &length);
  const double dome = length - cylinder;
  StartOnSphere(radius, std::max(kQuarter - dome / radius, 0.0), m);
  m->pieces = {{dome, -1.0 / radius}, {cylinder, 0.0}};
}

void DescribeCap(Visitor& v, double radius, Mantle* m) {
  double rim = kQuarter, hole = 0;
  v.Number({.name = "rim_angle",
            .meaning = "polar angle of the rim",
            .fallback = "pi/2",
            .bound = "(0, pi]"},
           Quantity::kAngle, Range{0, std::numbers::pi, true}, &rim);
  v.Number({.name = "hole_angle",
            .meaning = "polar angle of a hole at the apex",
            .bound = "[0, `rim_angle`)"},
           Quantity::kAngle, Range{0, rim}, &hole);
  v.Demand(hole < rim, "hole_angle", fmt::format("must be < rim_angle = {} rad", rim));
  StartOnSphere(radius, hole, m);
  m->pieces = {{(rim - hole) * radius, -1.0 / radius}};
}

void DescribeAnnulus(Visitor& v, Mantle* m) {
  double outer = 0, inner = 0;
  v.Number(Required({"outer"}), Quantity::kLength, kPositive, &outer);
  v.Number(
      {.name = "inner", .meaning = "a flat plate, with or without a hole", .bound = "[0, `outer`)"},
      Quantity::kLength, Range{0, outer}, &inner);
  v.Demand(inner < outer, "inner", fmt::format("must be < outer = {} m", outer));
  m->r0_m = inner;
  m->pieces = {{outer - inner, 0.0}};
}

void DescribePieces(Visitor& v, Mantle* m) {
  m->theta0_rad = 0;
  v.Number(Required({"start_radius", "r at X = 0"}), Quantity::kLength, kNonNegative, &m->r0_m);
  v.Number({"start_angle", "angle at X = 0, 0 along e_r, -pi/2 along -e3"}, Quantity::kAngle,
           kAnyValue, &m->theta0_rad);
  v.Tables(
      Required({.name = "pieces", .meaning = "lines and arcs, end to end", .also = "at least one"}),
      [&](Visitor& t, int) { DescribePiece(t, m->pieces.emplace_back()); });
  v.Demand(!m->pieces.empty(), "pieces", "must hold at least one `line` or `arc`");
}

// Start and pieces of the meridian.
void DescribeShape(Visitor& v, Mantle* m) {
  enum { kHemisphereCylinder, kCylinder, kCap, kAnnulus, kPieces };
  int type = -1;
  v.Cases(Required({"type"}), {"hemisphere_cylinder", "cylinder", "cap", "annulus", "pieces"},
          &type, [&](int which) {
            double radius = 1, length = 0;
            if (which <= kCap) {
              v.Number(Required({"radius"}), Quantity::kLength, kPositive, &radius);
            }
            switch (which) {
              case kHemisphereCylinder:
                DescribeHemisphereCylinder(v, radius, m);
                break;
              case kCylinder:
                v.Number(Required({"length"}), Quantity::kLength, kPositive, &length);
                m->r0_m = radius;
                m->theta0_rad = -kQuarter;
                m->pieces = {{length, 0.0}};
                break;
              case kCap:
                DescribeCap(v, radius, m);
                break;
              case kAnnulus:
                DescribeAnnulus(v, m);
                break;
              default:
                DescribePieces(v, m);
            }
          });
}

void DescribeEnd(Visitor& v, const schema::Key& key, ShellEnd* end) {
  v.Choice<ShellEnd>(key,
                     {{"clamped", ShellEnd::kClamped},
                      {"supported", ShellEnd::kSupported},
                      {"symmetric", ShellEnd::kSymmetric},
                      {"free", ShellEnd::kFree}},
                     end);
}

// Name and bounds of a strip.
template <typename Strip>
void DescribeStrip(Visitor& v, std::string_view kind, int index, double length, Strip& s) {
  s.name = fmt::format("{}{}", kind, index + 1);
  const std::string fallback = fmt::format("{}1, ...", kind);
  v.Name({.name = "name", .fallback = fallback, .also = "unique"}, &s.name);
  v.Number(Required({.name = "from", .bound = "on the meridian"}), Quantity::kLength,
           Range{0, length}, &s.from_m);
  v.Number(Required({.name = "to", .bound = "> `from`, on the meridian"}), Quantity::kLength,
           Range{s.from_m, length, true}, &s.to_m);
}

}  // namespace

void Describe(Visitor& v, Mantle& m) {
  m.name = "mantle";
  v.Name({"name"}, &m.name);
  v.Table(Required({"shape", "the meridian"}), [&](Visitor& t) { DescribeShape(t, &m); });
  v.Number({"position", "z of X = 0 in the root frame"}, Quantity::kLength, kAnyValue, &m.z0_m);
  double length = 0;
  for (const MeridianPiece& piece : m.pieces) length += piece.length_m;
  v.Number(Required({"half_thickness", "half of the wall's thickness"}), Quantity::kLength,
           kPositive, &m.half_thickness_m);
  DescribeMaterial(v, Required({"material"}), &m.material);
  DescribeEnd(v, {"start", "end X = 0; symmetric: a mirror plane, or the pole where r = 0"},
              &m.start);
  DescribeEnd(v, {"end", "the other end"}, &m.end);
  v.Integer({.name = "elements", .also = "one per stretch"}, 2, kMaxElements, &m.elements);
  v.Number({"grading", "last over first element length; > 1 is finer at X = 0"}, Quantity::kNumber,
           kPositive, &m.grading);
  v.Numbers(Optional({.name = "stations",
                      .meaning = "more places that must be nodes",
                      .bound = "on the meridian"}),
            Quantity::kLength, Range{0, length}, schema::kOneOrMore, &m.stations_m);
  v.Number(Optional({.name = "nozzle_radius", .meaning = "h_n", .also = "needed by `jet_thrust`"}),
           Quantity::kLength, kPositive, &m.nozzle_radius_m);
  v.Integer({"outlets", "openings that let water out"}, 1, 1000, &m.outlets);
  v.Integer({"inlets", "openings that let water in"}, 1, 1000, &m.inlets);
  v.Number({"added_mass_coefficient", "B_s; acts with `effects.added_mass`"}, Quantity::kNumber,
           kNonNegative, &m.added_mass_coefficient);
  v.Number({"drag_coefficient", "C_d; acts with `effects.drag`"}, Quantity::kNumber, kNonNegative,
           &m.drag_coefficient);
  v.Tables(Optional({"strips", "inward radial dead pressure on part of the meridian"}),
           [&](Visitor& t, int index) {
             StripPressure& s = m.strips.emplace_back();
             DescribeStrip(t, "strip", index, length, s);
             DescribeSchedule(t, Required({"pressure", "per reference area"}), Quantity::kPressure,
                              kAnyValue, &s.pressure_pa);
           });
  v.Tables(Optional({"spokes", "a cable that draws the strip in: pressure = count tension / area"}),
           [&](Visitor& t, int index) {
             SpokeCable& s = m.spokes.emplace_back();
             DescribeStrip(t, "spokes", index, length, s);
             t.Integer({"count", "spokes; the cable's length is count times the mean r"}, 1, 1000,
                       &s.spokes);
             Describe(t, s.drive);
           });
  v.Number({"initial_radial_speed", "of every free node at t = 0"}, Quantity::kSpeed, kAnyValue,
           &m.initial_radial_speed_m_s);
}

}  // namespace mantle::model
