#include "reduced/build/arm.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "model/arm_section.h"
#include "reduced/quadrature.h"

namespace mantle::reduced {
namespace {

using model::Arm;
using model::BadRobot;

constexpr double kSamePlace = 1e-9;  // of the arm's length
constexpr int kMusclePoints = 3;     // Gauss points per element of the plant, as the plant's
constexpr int kCablePoints = 3;      // Gauss points per piece along a cable
constexpr int kStiffnessExtra = 4;   // Gauss points beyond the basis' degree: exact for taper^4

// B(X), zero in rigid pieces.
Matrix6X BasisAt(const Arm& arm, const StrainBasis& basis, int group, double x) {
  Matrix6X b;
  basis.Evaluate(group, x, &b);
  if (model::IsRigidAt(arm, x)) b.setZero();
  return b;
}

// `ends` and the borders of the arm's pieces, ascending.
std::vector<double> WithBorders(const Arm& arm, std::vector<double> ends) {
  for (const double border : model::PieceBorders(arm, false)) {
    const bool known = std::any_of(ends.begin(), ends.end(), [&](double end) {
      return std::abs(end - border) < kSamePlace * arm.length_m;
    });
    if (!known) ends.push_back(border);
  }
  std::sort(ends.begin(), ends.end());
  return ends;
}

// Segments of equal flexible length where none are given; rigid pieces have no strains.
ArmReduction OnFlexibleLength(const Arm& arm, ArmReduction reduction) {
  if (std::none_of(arm.pieces.begin(), arm.pieces.end(),
                   [](const model::ArmPiece& p) { return p.rigid; })) {
    return reduction;
  }
  if (reduction.basis == BasisKind::kConstant && reduction.segment_ends_m.empty() &&
      reduction.segments >= 1) {
    double flexible = 0;
    for (const model::ArmPiece& p : arm.pieces) flexible += p.rigid ? 0.0 : p.length_m;
    for (int k = 1; k < reduction.segments; ++k) {
      double rest = flexible * k / reduction.segments, at = 0;
      for (const model::ArmPiece& p : arm.pieces) {
        if (!p.rigid && rest < p.length_m) {
          at += rest;
          break;
        }
        at += p.length_m;
        if (!p.rigid) rest -= p.length_m;
      }
      reduction.segment_ends_m.push_back(at);
    }
    reduction.segment_ends_m.push_back(arm.length_m);
  }
  return reduction;
}

void CheckSegments(const Arm& arm, const StrainBasis& basis) {
  for (const StrainGroup& g : basis.groups()) {
    double from = 0, flexible = 0;
    for (const model::ArmPiece& p : arm.pieces) {
      const double to = from + p.length_m;
      if (!p.rigid) flexible += std::max(std::min(to, g.to_m) - std::max(from, g.from_m), 0.0);
      from = to;
    }
    if (!arm.pieces.empty() && !(flexible > kSamePlace * arm.length_m)) {
      throw BadRobot(
          fmt::format("segment_ends: the segment from {:.6g} m to {:.6g} m lies in a "
                      "rigid piece, must reach into a flexible one",
                      g.from_m, g.to_m));
    }
  }
}

struct Station {
  double x_m;
  int section{-1};
};

// Sections by the chosen rule, and the stations (section, piece end, point load) in order.
std::vector<Station> PlaceSections(const model::Plant& plant, int a, const ArmReduction& reduction,
                                   ReducedArm* out) {
  const Arm& arm = plant.robot.arms[a];
  const model::Rod& rod = plant.rods[a];
  std::vector<Station> stations;
  const std::vector<double> ends = out->basis.PieceEnds();
  if (reduction.rule == SectionRule::kPlantNodes) {
    const int n = rod.element_count();
    out->sections = rod.nodes;
    out->sections.insert(out->sections.end(), rod.middles.begin(), rod.middles.end());
    out->base_section = 0;
    for (int i = 0; i < n; ++i) {
      stations.push_back({0.5 * (rod.x_m[i] + rod.x_m[i + 1]), n + 1 + i});
      stations.push_back({rod.x_m[i + 1], i + 1});
    }
  } else {
    const QuadratureRule rule = reduction.rule == SectionRule::kGaussRadau
                                    ? GaussRadau(reduction.points)
                                    : GaussLegendre(reduction.points);
    double from = 0;
    for (double end : WithBorders(arm, ends)) {
      for (std::size_t k = 0; k < rule.point.size(); ++k) {
        const double x = from + rule.point[k] * (end - from);
        stations.push_back({x, static_cast<int>(out->sections.size())});
        out->sections.push_back(ArmSection(arm, plant.robot.water, plant.robot.effects, x,
                                           rule.weight[k] * (end - from)));
      }
      from = end;
    }
  }
  const auto add = [&](double x) {
    const bool known = std::any_of(stations.begin(), stations.end(), [&](const Station& s) {
      return std::abs(s.x_m - x) < kSamePlace * arm.length_m;
    });
    if (!known && x > kSamePlace * arm.length_m) stations.push_back({x});
  };
  for (double end : WithBorders(arm, ends)) add(end);
  for (const auto& p : rod.payloads) add(p.payload.at_m);
  for (const auto& p : rod.points) add(p.load.at_m);
  std::stable_sort(stations.begin(), stations.end(),
                   [](const Station& p, const Station& q) { return p.x_m < q.x_m; });
  return stations;
}

Interval MakeInterval(const model::Plant& plant, int a, const ArmReduction& reduction,
                      const StrainBasis& basis, double from, const Station& to) {
  const Arm& arm = plant.robot.arms[a];
  Interval v;
  v.length_m = to.x_m - from;
  v.end_m = to.x_m;
  v.section = to.section;
  const double mid = 0.5 * (from + to.x_m);
  v.group = basis.GroupOf(mid);
  const auto at = [&](double x) { return BasisAt(arm, basis, v.group, x); };
  const bool curved = !arm.curvature_base.isApprox(arm.curvature_tip, 0.0);
  v.magnus = curved || (reduction.basis == BasisKind::kLegendre && reduction.degree > 0);
  if (v.magnus) {
    const double offset = std::sqrt(3.0) / 6.0 * v.length_m;
    v.basis1 = at(mid - offset);
    v.basis2 = at(mid + offset);
    v.rest1 = model::ArmRestStrain(arm, mid - offset);
    v.rest2 = model::ArmRestStrain(arm, mid + offset);
    v.kappa = std::sqrt(3.0) / 12.0 * v.length_m * v.length_m;
    v.basis = 0.5 * v.length_m * (v.basis1 + v.basis2);
  } else {
    v.basis = v.length_m * at(mid);
    v.reference = v.length_m * model::ArmRestStrain(arm, mid);
  }
  return v;
}

void MakeStiffness(const model::Plant& plant, int a, const ArmReduction& reduction,
                   ReducedArm* out) {
  const Arm& arm = plant.robot.arms[a];
  const int n = out->size();
  out->stiffness.setZero(n, n);
  out->damping.setZero(n, n);
  out->viscous = plant.robot.effects.viscosity;
  const int degree = reduction.basis == BasisKind::kLegendre ? reduction.degree : 0;
  const QuadratureRule rule = GaussLegendre(degree + kStiffnessExtra);
  Matrix6X b;
  if (reduction.rule == SectionRule::kPlantNodes) {
    const model::Rod& rod = plant.rods[a];
    for (int i = 0; i < rod.element_count(); ++i) {
      const model::RodElement& e = rod.elements[i];
      const double x = 0.5 * (rod.x_m[i] + rod.x_m[i + 1]);
      const int g = out->basis.GroupOf(x);
      const StrainGroup& group = out->basis.groups()[g];
      b = BasisAt(arm, out->basis, g, x);
      const auto add = [&](Eigen::MatrixXd& m, const Matrix6& law) {
        m.block(group.first, group.first, group.columns, group.columns) +=
            e.length * b.transpose() * law * b;
      };
      add(out->stiffness, e.stiffness.asDiagonal());
      if (!rod.coupling.empty()) add(out->stiffness, rod.coupling[i]);
      add(out->damping, e.viscosity.asDiagonal());
    }
    return;
  }
  for (std::size_t g = 0; g < out->basis.groups().size(); ++g) {
    const StrainGroup& group = out->basis.groups()[g];
    double from = group.from_m;
    for (const double end : WithBorders(arm, {group.to_m})) {
      if (end <= from || end > group.to_m) continue;
      for (std::size_t k = 0; k < rule.point.size(); ++k) {
        const double x = from + rule.point[k] * (end - from);
        const double w = rule.weight[k] * (end - from);
        b = BasisAt(arm, out->basis, static_cast<int>(g), x);
        const auto block = [&](Eigen::MatrixXd& m) {
          return m.block(group.first, group.first, group.columns, group.columns);
        };
        block(out->stiffness) += w * b.transpose() * ArmStiffness(arm, x).asDiagonal() * b;
        block(out->stiffness) += w * b.transpose() * ArmStiffnessCoupling(arm, x) * b;
        block(out->damping) +=
            w * b.transpose() * ArmViscosity(arm, plant.robot.effects, x).asDiagonal() * b;
      }
      from = end;
    }
  }
}

ReducedCable MakeCable(const model::Plant& plant, int a, int c, const ArmReduction& reduction,
                       const StrainBasis& basis) {
  const Arm& arm = plant.robot.arms[a];
  const model::Rod& rod = plant.rods[a];
  ReducedCable out;
  double rest = 0;
  const auto add = [&](double x, double weight, const model::CablePiece& piece) {
    CablePoint p;
    p.group = basis.GroupOf(x);
    p.piece = piece;
    p.element.length = weight;
    p.reference = weight * model::ArmRestStrain(arm, x);
    p.basis = weight * BasisAt(arm, basis, p.group, x);
    rest += CablePieceLength(p.piece, p.element, p.reference, nullptr, nullptr);
    out.points.push_back(std::move(p));
  };
  if (reduction.rule == SectionRule::kPlantNodes) {
    for (std::size_t i = 0; i < rod.cables[c].pieces.size(); ++i) {
      const model::CablePiece& piece = rod.cables[c].pieces[i];
      const double l = rod.elements[i].length;
      add(rod.x_m[i] + 0.5 * piece.share * l, l, piece);
    }
  } else {
    const QuadratureRule rule = GaussLegendre(kCablePoints);
    double from = 0;
    for (double end : basis.PieceEnds()) {
      const double to = std::min(end, arm.cables[c].end_m);
      for (std::size_t k = 0; to > from && k < rule.point.size(); ++k) {
        const double x = from + rule.point[k] * (to - from);
        add(x, rule.weight[k] * (to - from), ArmCablePath(arm, arm.cables[c], x));
      }
      from = end;
    }
  }
  out.length_offset_m = rod.cables[c].rest_length_m - rest;
  const auto& pieces = rod.cables[c].pieces;
  for (std::size_t e = 0; e < pieces.size(); ++e) {
    const double length = (rod.x_m[e + 1] - rod.x_m[e]) * pieces[e].share;
    out.offset_integral_m2 += length * pieces[e].offset_m;
    out.distance_integral_m2 += length * pieces[e].offset_m.norm();
  }
  return out;
}

// Gauss' points on the plant's elements.
void MakeMuscles(const model::Plant& plant, int a, ReducedArm* out) {
  const model::Rod& rod = plant.rods[a];
  for (const model::RodMuscle& m : rod.muscles) out->muscles.push_back(m.wave);
  if (out->muscles.empty()) return;
  const QuadratureRule rule = GaussLegendre(kMusclePoints);
  for (int i = 0; i < rod.element_count(); ++i) {
    for (std::size_t k = 0; k < rule.point.size(); ++k) {
      MusclePoint p;
      p.x_m = rod.x_m[i] + rule.point[k] * rod.elements[i].length;
      p.group = out->basis.GroupOf(p.x_m);
      p.basis = rule.weight[k] * rod.elements[i].length *
                BasisAt(plant.robot.arms[a], out->basis, p.group, p.x_m);
      out->muscle_points.push_back(std::move(p));
    }
  }
}

}  // namespace

Matrix6X ReducedBasisAt(const model::Plant& plant, int a, const StrainBasis& basis, int group,
                        double x_m) {
  return BasisAt(plant.robot.arms[a], basis, group, x_m);
}

ReducedArm MakeReducedArm(const model::Plant& plant, int a, const ArmReduction& chosen) {
  const Arm& arm = plant.robot.arms[a];
  const model::Rod& rod = plant.rods[a];
  const ArmReduction reduction = OnFlexibleLength(arm, chosen);
  if (reduction.points < 1 || reduction.points > kMaxQuadraturePoints) {
    throw BadRobot(
        fmt::format("points = {}, must be in [1, {}]", reduction.points, kMaxQuadraturePoints));
  }
  ReducedArm out{
      .reduction = reduction, .basis = StrainBasis(reduction, arm.length_m), .mount = arm.mount};
  CheckSegments(arm, out.basis);
  double from = 0;
  for (const Station& s : PlaceSections(plant, a, reduction, &out)) {
    out.intervals.push_back(MakeInterval(plant, a, reduction, out.basis, from, s));
    if (s.section >= 0) out.dynamic_intervals = static_cast<int>(out.intervals.size());
    from = s.x_m;
  }
  const auto interval_at = [&](double x_m) {
    int at = -1;
    for (std::size_t i = 0; i < out.intervals.size(); ++i) {
      if (std::abs(out.intervals[i].end_m - x_m) < kSamePlace * arm.length_m) {
        at = static_cast<int>(i);
      }
    }
    return at;
  };
  for (const auto& p : rod.payloads) {
    const int at = interval_at(p.payload.at_m);
    out.payloads.push_back({at, p.inertia, p.loads});
    out.dynamic_intervals = std::max(out.dynamic_intervals, at + 1);
    out.needs_rotation |= !p.loads.empty();
  }
  for (const auto& p : rod.points) {
    const int at = interval_at(p.load.at_m);
    out.points.push_back({at, p.load});
    out.dynamic_intervals = std::max(out.dynamic_intervals, at + 1);
    out.needs_rotation |= p.load.frame == model::LoadFrame::kWorld;
  }
  for (const model::SectionLoad& load : rod.loads) {
    if (std::visit([](const auto& l) { return l.IsNothing(); }, load)) continue;
    out.needs_rotation |= std::visit([](const auto& l) { return l.NeedsRotation(); }, load);
    out.loads.push_back(load);
  }
  for (const auto& d : rod.distributed) {
    out.distributed.push_back(d.load);
    out.needs_rotation |= d.load.frame == model::LoadFrame::kWorld;
  }
  for (std::size_t c = 0; c < rod.cables.size(); ++c) {
    out.cables.push_back(MakeCable(plant, a, static_cast<int>(c), reduction, out.basis));
  }
  MakeMuscles(plant, a, &out);
  MakeStiffness(plant, a, reduction, &out);
  return out;
}

}  // namespace mantle::reduced
