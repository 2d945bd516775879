#include "reduced/build/arm.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "reduced/quadrature.h"

namespace mantle::reduced {
namespace {

using model::Arm;
using model::BadRobot;

constexpr double kSamePlace = 1e-9;  // of the arm's length
constexpr int kCablePoints = 3;      // Gauss points per piece along a cable
constexpr int kStiffnessExtra = 4;   // Gauss points beyond the basis' degree: exact for taper^4

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
    for (double end : ends) {
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
  for (double end : ends) add(end);
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
  const auto at = [&](double x) {
    Matrix6X b;
    basis.Evaluate(v.group, x, &b);
    return b;
  };
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
      out->basis.Evaluate(g, x, &b);
      const auto add = [&](Eigen::MatrixXd& m, const Vector6& diagonal) {
        m.block(group.first, group.first, group.columns, group.columns) +=
            e.length * b.transpose() * diagonal.asDiagonal() * b;
      };
      add(out->stiffness, e.stiffness);
      add(out->damping, e.viscosity);
    }
    return;
  }
  for (std::size_t g = 0; g < out->basis.groups().size(); ++g) {
    const StrainGroup& group = out->basis.groups()[g];
    for (std::size_t k = 0; k < rule.point.size(); ++k) {
      const double x = group.from_m + rule.point[k] * (group.to_m - group.from_m);
      const double w = rule.weight[k] * (group.to_m - group.from_m);
      out->basis.Evaluate(static_cast<int>(g), x, &b);
      const auto block = [&](Eigen::MatrixXd& m) {
        return m.block(group.first, group.first, group.columns, group.columns);
      };
      block(out->stiffness) += w * b.transpose() * ArmStiffness(arm, x).asDiagonal() * b;
      block(out->damping) +=
          w * b.transpose() * ArmViscosity(arm, plant.robot.effects, x).asDiagonal() * b;
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
    Matrix6X b;
    basis.Evaluate(p.group, x, &b);
    p.basis = weight * b;
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

}  // namespace

ReducedArm MakeReducedArm(const model::Plant& plant, int a, const ArmReduction& reduction) {
  const Arm& arm = plant.robot.arms[a];
  const model::Rod& rod = plant.rods[a];
  if (reduction.points < 1 || reduction.points > kMaxQuadraturePoints) {
    throw BadRobot(
        fmt::format("points = {}, must be in [1, {}]", reduction.points, kMaxQuadraturePoints));
  }
  ReducedArm out{reduction, StrainBasis(reduction, arm.length_m),
                 arm.mount, {},
                 0,         {},
                 -1,        {},
                 {},        {},
                 {},        false,
                 {},        {},
                 false};
  double from = 0;
  for (const Station& s : PlaceSections(plant, a, reduction, &out)) {
    out.intervals.push_back(MakeInterval(plant, a, reduction, out.basis, from, s));
    if (s.section >= 0) out.dynamic_intervals = static_cast<int>(out.intervals.size());
    from = s.x_m;
  }
  for (const auto& p : rod.points) {
    int at = -1;
    for (std::size_t i = 0; i < out.intervals.size(); ++i) {
      if (std::abs(out.intervals[i].end_m - p.load.at_m) < kSamePlace * arm.length_m) {
        at = static_cast<int>(i);
      }
    }
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
  MakeStiffness(plant, a, reduction, &out);
  return out;
}

}  // namespace mantle::reduced
