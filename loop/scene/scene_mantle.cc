#include <fmt/format.h>

#include <cmath>
#include <numbers>

#include "loop/scene/scene_parts.h"

namespace mantle::scene {
namespace {

constexpr double kQuarter = std::numbers::pi / 2.0;
// A dome must not close: the shell needs r > 0 or the exact axis at X = 0.
constexpr double kAxis = 1e-12;

MeridianPiece ReadPiece(TomlReader table) {
  MeridianPiece piece;
  if (table.Has("line") == table.Has("arc")) {
    table.Fail("line", "a piece must have exactly one of `line` and `arc`");
  }
  if (table.Has("line")) {
    piece.length_m = table.Number("line", Quantity::kLength, kPositive);
  } else {
    TomlReader arc = table.Table("arc");
    const double radius = arc.Number("radius", Quantity::kLength, kPositive);
    const auto angle = arc.OptionalNumber("angle", Quantity::kAngle, kAnyValue);
    const auto length = arc.OptionalNumber("length", Quantity::kLength, kPositive);
    if (angle.has_value() == length.has_value() || (angle && *angle == 0.0)) {
      arc.Fail("angle", "an arc must have exactly one of `angle` (not zero) and `length`");
    }
    piece.length_m = angle ? std::abs(*angle) * radius : *length;
    piece.curvature_1_m = (angle && *angle > 0 ? 1.0 : -1.0) / radius;
    arc.Finish();
  }
  table.Finish();
  return piece;
}

// Sphere from polar angle `hole` outwards: theta = -(polar angle), r = R sin, bending towards -e3.
void StartOnSphere(double radius, double polar, Mantle* m) {
  m->r0_m = polar < kAxis ? 0.0 : radius * std::sin(polar);
  m->theta0_rad = -polar;
}

void ReadHemisphereCylinder(TomlReader* shape, Mantle* m) {
  const double radius = shape->Number("radius", Quantity::kLength, kPositive);
  const double cylinder = shape->Number("cylinder", Quantity::kLength, kPositive);
  const double full = cylinder + kQuarter * radius;
  const double length =
      shape->Number("meridian", Quantity::kLength, Range{cylinder, full, true}, full);
  const double dome = length - cylinder;
  StartOnSphere(radius, std::max(kQuarter - dome / radius, 0.0), m);
  m->pieces = {{dome, -1.0 / radius}, {cylinder, 0.0}};
}

void ReadCap(TomlReader* shape, Mantle* m) {
  const double radius = shape->Number("radius", Quantity::kLength, kPositive);
  const double rim =
      shape->Number("rim_angle", Quantity::kAngle, Range{0, std::numbers::pi, true}, kQuarter);
  const double hole = shape->Number("hole_angle", Quantity::kAngle, Range{0, rim}, 0.0);
  if (!(hole < rim)) shape->Fail("hole_angle", fmt::format("must be < rim_angle = {} rad", rim));
  StartOnSphere(radius, hole, m);
  m->pieces = {{(rim - hole) * radius, -1.0 / radius}};
}

void ReadAnnulus(TomlReader* shape, Mantle* m) {
  const double outer = shape->Number("outer", Quantity::kLength, kPositive);
  const double inner = shape->Number("inner", Quantity::kLength, Range{0, outer}, 0.0);
  if (!(inner < outer)) shape->Fail("inner", fmt::format("must be < outer = {} m", outer));
  m->r0_m = inner;
  m->pieces = {{outer - inner, 0.0}};
}

void ReadPieces(TomlReader* shape, Mantle* m) {
  m->r0_m = shape->Number("start_radius", Quantity::kLength, kNonNegative);
  m->theta0_rad = shape->Number("start_angle", Quantity::kAngle, kAnyValue, 0.0);
  for (TomlReader& piece : shape->Tables("pieces")) m->pieces.push_back(ReadPiece(piece));
  if (m->pieces.empty()) shape->Fail("pieces", "must hold at least one `line` or `arc`");
}

ShellEnd ReadEnd(TomlReader* table, std::string_view key, ShellEnd fallback) {
  return table->Choice<ShellEnd>(key,
                                 {{"clamped", ShellEnd::kClamped},
                                  {"supported", ShellEnd::kSupported},
                                  {"symmetric", ShellEnd::kSymmetric},
                                  {"free", ShellEnd::kFree}},
                                 fallback);
}

// Bounds of a strip; whether it lies on the meridian is known once the shape is.
void ReadStrip(TomlReader* table, double length, double* from, double* to) {
  *from = table->Number("from", Quantity::kLength, Range{0, length});
  *to = table->Number("to", Quantity::kLength, Range{*from, length, true});
}

}  // namespace

void ReadMantleShape(TomlReader* mantle, Mantle* out) {
  TomlReader shape = mantle->Table("shape");
  using Read = void (*)(TomlReader*, Mantle*);
  const Read read = shape.Choice<Read>("type",
                                       {{"hemisphere_cylinder", &ReadHemisphereCylinder},
                                        {"cylinder", nullptr},
                                        {"cap", &ReadCap},
                                        {"annulus", &ReadAnnulus},
                                        {"pieces", &ReadPieces}},
                                       nullptr);
  if (!shape.Has("type")) {
    shape.Fail("type",
               "is missing: must be one of \"hemisphere_cylinder\", \"cylinder\", \"cap\", "
               "\"annulus\", \"pieces\"");
  }
  if (read != nullptr) {
    read(&shape, out);
  } else {
    out->r0_m = shape.Number("radius", Quantity::kLength, kPositive);
    out->theta0_rad = -kQuarter;
    out->pieces = {{shape.Number("length", Quantity::kLength, kPositive), 0.0}};
  }
  shape.Finish();
  out->z0_m = mantle->Number("position", Quantity::kLength, kAnyValue, 0.0);
}

Mantle ReadMantle(TomlReader table) {
  Mantle m;
  m.name = table.Name("name", "mantle");
  ReadMantleShape(&table, &m);
  double length = 0;
  for (const MeridianPiece& piece : m.pieces) length += piece.length_m;
  m.half_thickness_m = table.Number("half_thickness", Quantity::kLength, kPositive);
  m.material = ReadMaterial(&table, "material");
  m.start = ReadEnd(&table, "start", ShellEnd::kClamped);
  m.end = ReadEnd(&table, "end", ShellEnd::kFree);
  m.elements = table.Integer("elements", 2, kMaxElements, m.elements);
  m.grading = table.Number("grading", Quantity::kNumber, kPositive, 1.0);
  if (table.Has("stations")) {
    m.stations_m = table.Numbers("stations", Quantity::kLength, Range{0, length});
  }
  m.nozzle_radius_m = table.Number("nozzle_radius", Quantity::kLength, kPositive, 0.0);
  m.outlets = table.Integer("outlets", 1, 1000, m.outlets);
  m.inlets = table.Integer("inlets", 1, 1000, m.inlets);
  m.added_mass_coefficient =
      table.Number("added_mass_coefficient", Quantity::kNumber, kNonNegative, 0.0);
  m.drag_coefficient = table.Number("drag_coefficient", Quantity::kNumber, kNonNegative, 0.0);
  auto strips = table.Tables("strips");
  for (std::size_t i = 0; i < strips.size(); ++i) {
    StripPressure s;
    s.name = strips[i].Name("name", fmt::format("strip{}", i + 1));
    ReadStrip(&strips[i], length, &s.from_m, &s.to_m);
    s.pressure_pa = ReadSchedule(&strips[i], "pressure", Quantity::kPressure, kAnyValue);
    strips[i].Finish();
    m.strips.push_back(s);
  }
  auto spokes = table.Tables("spokes");
  for (std::size_t i = 0; i < spokes.size(); ++i) {
    SpokeCable s;
    s.name = spokes[i].Name("name", fmt::format("spokes{}", i + 1));
    ReadStrip(&spokes[i], length, &s.from_m, &s.to_m);
    s.spokes = spokes[i].Integer("count", 1, 1000, s.spokes);
    s.drive = ReadCableDrive(&spokes[i]);
    spokes[i].Finish();
    m.spokes.push_back(s);
  }
  m.initial_radial_speed_m_s =
      table.Number("initial_radial_speed", Quantity::kSpeed, kAnyValue, 0.0);
  table.Finish();
  return m;
}

}  // namespace mantle::scene
