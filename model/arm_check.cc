#include "model/arm_check.h"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "model/arm_section.h"

namespace mantle::model {
namespace {

void Demand(bool ok, const std::string& message) {
  if (!ok) throw BadRobot(message);
}

// Whether a point of the section lies inside it, and the bound in words.
bool IsInside(const Arm& arm, const Vector3& p) {
  constexpr double kRoundOff = 1 + 1e-12;
  if (!arm.pieces.empty()) {
    const PiecePlace at = PieceAt(arm.pieces, p.x());
    if (const auto* box = std::get_if<RectangularOutline>(&at.piece.outline)) {
      return std::abs(p.y()) <= 0.5 * box->width_m.At(at.share) * kRoundOff &&
             std::abs(p.z()) <= 0.5 * box->height_m.At(at.share) * kRoundOff;
    }
  }
  return std::hypot(p.y(), p.z()) <= ArmRadius(arm, p.x()) * kRoundOff;
}

void CheckPayloadsAndMuscles(const Arm& arm) {
  for (const Payload& p : arm.payloads) {
    Demand(p.at_m >= 0 && p.at_m <= arm.length_m * (1 + 1e-12),
           fmt::format("payloads.{}: at = {} m, must be in [0, {}]", p.name, p.at_m, arm.length_m));
    Demand(p.mass_kg > 0, fmt::format("payloads.{}: mass = {} kg, must be > 0", p.name, p.mass_kg));
    const Eigen::Vector3d moments = p.inertia_kg_m2.selfadjointView<Eigen::Lower>().eigenvalues();
    Demand(
        p.inertia_kg_m2.isApprox(p.inertia_kg_m2.transpose()) && moments(0) >= 0 &&
            moments(2) <= (moments(0) + moments(1)) * (1 + 1e-9),
        fmt::format("payloads.{}: inertia: must be symmetric with principal moments that no body "
                    "lacks: none negative, none above the sum of the other two",
                    p.name));
  }
  for (const MuscleWave& m : arm.muscles) {
    if (const auto* s = std::get_if<SineSchedule>(&m.wave_length_m)) {
      Demand(s->offset > std::abs(s->amplitude),
             fmt::format("muscles.{}: wave_length: offset = {} m, must be > its amplitude {} m: a "
                         "wave length must stay > 0",
                         m.name, s->offset, std::abs(s->amplitude)));
    }
    for (std::size_t i = 1; i < m.envelope.size(); ++i) {
      Demand(m.envelope[i].at_m > m.envelope[i - 1].at_m,
             fmt::format("muscles.{}: envelope: at must ascend; {} m after {} m", m.name,
                         m.envelope[i].at_m, m.envelope[i - 1].at_m));
    }
  }
}

}  // namespace

void CheckArm(const Arm& arm) {
  Demand(arm.length_m > 0, fmt::format("length = {} m, must be > 0", arm.length_m));
  Demand(arm.elements >= 1, fmt::format("elements = {}, must be >= 1", arm.elements));
  if (arm.pieces.empty()) {
    Demand(arm.radius_base_m > 0 && arm.radius_tip_m > 0,
           fmt::format("radius = {}, {} m, must be > 0", arm.radius_base_m, arm.radius_tip_m));
  } else {
    CheckPieces(arm);
  }
  CheckPayloadsAndMuscles(arm);
  const double turn =
      arm.length_m / arm.elements * std::max(arm.curvature_base.norm(), arm.curvature_tip.norm());
  Demand(turn < 1.0, fmt::format("elements = {}: an element at rest turns {:.3g} rad, must be < 1; "
                                 "the mesh is too coarse for the reference curvature",
                                 arm.elements, turn));
  for (const ArmCable& c : arm.cables) {
    Demand(c.fraction >= 0 && c.fraction <= 1,
           fmt::format("cables.{}: fraction = {}, must be in [0, 1]: the cable must lie inside the "
                       "section",
                       c.name, c.fraction));
    for (const Vector3& p : c.path) {
      const double distance = std::hypot(p.y(), p.z());
      Demand(
          IsInside(arm, p),
          fmt::format("cables.{}: path: {:.6g} m from the centreline at X = {:.6g} m, must be <= "
                      "{:.6g} m: the cable must lie inside the section",
                      c.name, distance, p.x(), ArmRadius(arm, p.x())));
    }
    if (c.path.empty()) {
      for (std::size_t i = 0; i < arm.pieces.size(); ++i) {
        Demand(std::holds_alternative<RoundOutline>(arm.pieces[i].outline),
               fmt::format("cables.{}: fraction: needs round sections, pieces[{}] is rectangular; "
                           "give the cable a `path`",
                           c.name, i));
      }
    }
    Demand(c.end_m > 0 && c.end_m <= arm.length_m * (1 + 1e-12),
           fmt::format("cables.{}: end = {} m, must be in (0, {}]", c.name, c.end_m, arm.length_m));
  }
  for (const PointWrench& p : arm.points) {
    Demand(p.at_m >= 0 && p.at_m <= arm.length_m * (1 + 1e-12),
           fmt::format("points.{}: at = {} m, must be in [0, {}]", p.name, p.at_m, arm.length_m));
  }
}

}  // namespace mantle::model
