#include "model/arm_section.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include <Eigen/Cholesky>

#include "model/rod.h"

namespace mantle::model {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kSameLength = 1e-9;  // of the arm's: pieces that add up to it
constexpr double kSymmetric = 1e-12;  // of the largest entry
constexpr int kTorsionTerms = 60;     // odd ones up to twice that: 1e-10 of the sum

void Demand(bool ok, const std::string& message) {
  if (!ok) throw BadRobot(message);
}

SectionArea Of(const RoundOutline& o, bool flooded, double share) {
  const double outer = o.radius_m.At(share), inner = o.inner_radius_m.At(share);
  const double whole = kPi * outer * outer, hole = kPi * inner * inner;
  SectionArea s;
  s.solid_m2 = whole - hole;
  s.displaced_m2 = flooded ? s.solid_m2 : whole;
  s.second_y_m4 = s.second_z_m4 = 0.25 * (whole * outer * outer - hole * inner * inner);
  s.torsion_m4 = 2.0 * s.second_y_m4;
  s.radius_m = outer;
  return s;
}

SectionArea Of(const RectangularOutline& o, bool, double share) {
  const double b = o.width_m.At(share), h = o.height_m.At(share);
  SectionArea s;
  s.solid_m2 = s.displaced_m2 = b * h;
  s.second_y_m4 = b * h * h * h / 12.0;
  s.second_z_m4 = h * b * b * b / 12.0;
  s.torsion_m4 = RectangleTorsion(b, h);
  // Of the circle of equal area; drag sees the perimeter along x, and across the side that faces
  // the flow.
  s.radius_m = std::sqrt(b * h / kPi);
  s.drag_shape = Vector3((b + h) / kPi, 0.5 * h, 0.5 * b) / s.radius_m;
  return s;
}

double TaperLow(const Taper& t) { return std::min(t.base, t.tip); }

void CheckTaper(const std::string& where, const char* key, const Taper& t) {
  Demand(TaperLow(t) > 0, fmt::format("{}.{} = {}, {} m, must be > 0", where, key, t.base, t.tip));
}

}  // namespace

double RectangleTorsion(double width_m, double height_m) {
  const double a = std::max(width_m, height_m), c = std::min(width_m, height_m);
  double sum = 0;
  for (int k = 0; k < kTorsionTerms; ++k) {
    const double n = 2.0 * k + 1.0;
    sum += std::tanh(0.5 * n * kPi * a / c) / std::pow(n, 5);
  }
  return a * c * c * c / 3.0 * (1.0 - 192.0 * c / (std::pow(kPi, 5) * a) * sum);
}

SectionArea AreaOf(const ArmPiece& piece, double share) {
  return std::visit([&](const auto& o) { return Of(o, piece.flooded, share); }, piece.outline);
}

std::vector<ArmPiece> PiecesOf(const Arm& arm) {
  if (!arm.pieces.empty()) return arm.pieces;
  ArmPiece piece;
  piece.length_m = arm.length_m;
  piece.outline = RoundOutline{{arm.radius_base_m, arm.radius_tip_m}, {}};
  piece.material = arm.material;
  piece.shear_correction = arm.shear_correction;
  if (arm.stiffness) piece.stiffness = Matrix6(arm.stiffness->asDiagonal());
  piece.viscosity = arm.viscosity;
  piece.inertia = arm.inertia;
  return {piece};
}

PiecePlace PieceAt(const std::vector<ArmPiece>& pieces, double x_m) {
  double from = 0;
  for (std::size_t i = 0; i + 1 < pieces.size(); ++i) {
    if (x_m < from + pieces[i].length_m) return {pieces[i], (x_m - from) / pieces[i].length_m};
    from += pieces[i].length_m;
  }
  return {pieces.back(), (x_m - from) / pieces.back().length_m};
}

std::vector<double> PieceBorders(const Arm& arm, bool nodes) {
  std::vector<double> borders;
  double at = 0;
  for (std::size_t i = 0; i + 1 < arm.pieces.size(); ++i) {
    at += arm.pieces[i].length_m;
    if (!nodes || arm.pieces[i].node_at_end) borders.push_back(at);
  }
  return borders;
}

bool IsRigidAt(const Arm& arm, double x_m) {
  return !arm.pieces.empty() && PieceAt(arm.pieces, x_m).piece.rigid;
}

Matrix6 PieceStiffness(const ArmPiece& piece, double share) {
  if (piece.stiffness) return *piece.stiffness;
  const SectionArea s = AreaOf(piece, share);
  const double e = piece.material.young_pa, g = piece.material.shear_pa();
  const double shear = piece.shear_correction * g * s.solid_m2;
  Vector6 d;
  d << g * s.torsion_m4, e * s.second_y_m4, e * s.second_z_m4, e * s.solid_m2, shear, shear;
  return d.asDiagonal();
}

Vector6 PieceViscosity(const ArmPiece& piece, double share) {
  if (piece.viscosity) return *piece.viscosity;
  const SectionArea s = AreaOf(piece, share);
  Vector6 u;
  u << s.torsion_m4, 3.0 * s.second_y_m4, 3.0 * s.second_z_m4, 3.0 * s.solid_m2, s.solid_m2,
      s.solid_m2;
  return piece.material.viscosity_pa_s * u;
}

Vector6 PieceInertia(const ArmPiece& piece, double share) {
  if (piece.inertia) return *piece.inertia;
  const SectionArea s = AreaOf(piece, share);
  Vector6 m;
  m << s.second_y_m4 + s.second_z_m4, s.second_y_m4, s.second_z_m4, s.solid_m2, s.solid_m2,
      s.solid_m2;
  return piece.material.density_kg_m3 * m;
}

void CheckPieces(const Arm& arm) {
  double sum = 0;
  bool flexible = false;
  for (std::size_t i = 0; i < arm.pieces.size(); ++i) {
    const ArmPiece& p = arm.pieces[i];
    const std::string where = fmt::format("pieces[{}]", i);
    Demand(p.length_m > 0, fmt::format("{}.length = {} m, must be > 0", where, p.length_m));
    sum += p.length_m;
    flexible |= !p.rigid;
    if (const auto* round = std::get_if<RoundOutline>(&p.outline)) {
      CheckTaper(where, "radius", round->radius_m);
      for (const double share : {0.0, 1.0}) {
        const double inner = round->inner_radius_m.At(share), outer = round->radius_m.At(share);
        Demand(inner >= 0 && inner < outer,
               fmt::format("{}.inner_radius = {} m, must be in [0, {}): inside the radius", where,
                           inner, outer));
      }
    } else {
      const auto& box = std::get<RectangularOutline>(p.outline);
      CheckTaper(where, "width", box.width_m);
      CheckTaper(where, "height", box.height_m);
    }
    if (!p.stiffness) continue;
    const Matrix6& s = *p.stiffness;
    const double largest = s.cwiseAbs().maxCoeff();
    Demand((s - s.transpose()).cwiseAbs().maxCoeff() <= kSymmetric * largest,
           where + ".stiffness: must be symmetric");
    Demand(s.llt().info() == Eigen::Success, where + ".stiffness: must be positive definite");
  }
  Demand(std::abs(sum - arm.length_m) <= kSameLength * arm.length_m,
         fmt::format("pieces: their lengths add up to {} m, must be the arm's length = {} m", sum,
                     arm.length_m));
  Demand(flexible, "pieces: all are rigid, at least one must not be: a rigid arm is a rigid body");
}

}  // namespace mantle::model
