#include "model/rod.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace mantle::model {
namespace {

// Gauss-Legendre, 5 points on [0, 1]: exact to degree 9 (sections are of degree 4, times 1).
constexpr std::array<double, 5> kGaussPoint = {0.04691007703066800, 0.23076534494715845, 0.5,
                                               0.76923465505284155, 0.95308992296933200};
constexpr std::array<double, 5> kGaussWeight = {0.11846344252809454, 0.23931433524968324,
                                                0.28444444444444444, 0.23931433524968324,
                                                0.11846344252809454};
constexpr int kReferenceSubsteps = 16;  // of the curved reference per element
constexpr double kNodalRotary = 2.0 / 3;

void Demand(bool ok, const std::string& message) {
  if (!ok) throw BadRobot(message);
}

double Radius(const Arm& arm, double x) {
  return arm.radius_base_m + (arm.radius_tip_m - arm.radius_base_m) * x / arm.length_m;
}

// Uniform nodes, the nearest interior one moved onto each station.
std::vector<double> NodesOf(const Arm& arm) {
  const int n = arm.elements;
  std::vector<double> x(n + 1);
  for (int i = 0; i <= n; ++i) x[i] = arm.length_m * i / n;
  std::vector<bool> taken(n + 1, false);
  taken.front() = taken.back() = true;
  for (const PointWrench& p : arm.points) {
    const int i = static_cast<int>(std::lround(p.at_m / arm.length_m * n));
    if (std::abs(x[i] - p.at_m) < 1e-9 * arm.length_m) {
      taken[i] = true;
      continue;
    }
    Demand(!taken[i], fmt::format("points: at = {} m falls between nodes that other points or the "
                                  "ends hold; use more elements than {}",
                                  p.at_m, n));
    x[i] = p.at_m;
    taken[i] = true;
  }
  return x;
}

// Fourth-order Magnus steps along the reference centreline.
Pose AdvanceReference(const Arm& arm, Pose g, double x0, double x1) {
  const double h = (x1 - x0) / kReferenceSubsteps;
  const double offset = std::sqrt(3.0) / 6.0;
  for (int i = 0; i < kReferenceSubsteps; ++i) {
    const double mid = x0 + (i + 0.5) * h;
    const Vector6 a = ArmRestStrain(arm, mid - offset * h);
    const Vector6 b = ArmRestStrain(arm, mid + offset * h);
    g = g * ExpSE3(0.5 * h * (a + b) + (std::sqrt(3.0) / 12.0) * h * h * SmallAdjointTimes(a, b));
  }
  return g;
}

RodElement ElementOf(const Arm& arm, const Effects& effects, const Pose& relative, double x0,
                     double x1) {
  RodElement e;
  e.length = x1 - x0;
  const bool straight = arm.curvature_base.isZero(0.0) && arm.curvature_tip.isZero(0.0);
  e.reference_strain = straight ? ArmRestStrain(arm, 0) : Vector6(LogSE3(relative) / e.length);
  for (int k = 0; k < 5; ++k) {
    const double x = x0 + kGaussPoint[k] * e.length;
    e.stiffness += kGaussWeight[k] * ArmStiffness(arm, x);
    e.viscosity += kGaussWeight[k] * ArmViscosity(arm, effects, x);
  }
  AddResidualBending(&e);
  return e;
}

// Place of an element's inner mass, as a share of its length.
double MiddlePlace(const Arm& arm, const Water& water, const Effects& effects, double x0,
                   double x1) {
  double mass = 0, moment = 0;
  for (int k = 0; k < 5; ++k) {
    const double s = kGaussPoint[k];
    const RodNode section = ArmSection(arm, water, effects, x0 + s * (x1 - x0), 1.0);
    const double density = section.inertia(5) > 0 ? section.inertia(5) : section.section.area_m2;
    mass += kGaussWeight[k] * density * s * (1.0 - s);
    moment += kGaussWeight[k] * density * s * s * (1.0 - s);
  }
  const double place = moment / mass;
  Demand(place > 1.0 / 3 && place < 2.0 / 3,
         fmt::format("elements = {}: between X = {:.6g} and {:.6g} m nearly all mass lies at one "
                     "end (its inner part at {:.4g} of the length, must be in (1/3, 2/3)); use "
                     "more elements",
                     arm.elements, x0, x1, place));
  return place;
}

void AddSections(const Arm& arm, const Water& water, const Effects& effects, double x0, double x1,
                 RodNode* left, RodNode* middle, RodNode* right) {
  const double length = x1 - x0;
  const double at = MiddlePlace(arm, water, effects, x0, x1);
  for (int k = 0; k < 5; ++k) {
    const double s = kGaussPoint[k];
    const RodNode section =
        ArmSection(arm, water, effects, x0 + s * length, kGaussWeight[k] * length);
    const auto add = [&](double share, double rotary, RodNode* node) {
      node->weight_m += share * section.weight_m;
      node->section.area_m2 += share * section.weight_m * section.section.area_m2;
      node->section.radius_m += share * section.weight_m * section.section.radius_m;
      node->inertia.head<3>() += rotary * section.inertia.head<3>();
      node->inertia.tail<3>() += share * section.inertia.tail<3>();
      node->added_mass_kg += share * section.added_mass_kg;
    };
    add((1.0 - s) * (at - s) / at, kNodalRotary * (1.0 - s), left);
    add(s * (1.0 - s) / (at * (1.0 - at)), 1.0 - kNodalRotary, middle);
    add(s * (s - at) / (1.0 - at), kNodalRotary * s, right);
  }
  middle->section.x_m = x0 + at * length;
  middle->ahead_m = (at - 0.5) * length;
}

RodCable CableOf(const Arm& arm, const ArmCable& cable, const Rod& rod) {
  RodCable out;
  out.name = cable.name;
  out.drive = cable.drive;
  for (int i = 0; i < rod.element_count(); ++i) {
    const double x0 = rod.x_m[i];
    const double x1 = std::min(rod.x_m[i + 1], cable.end_m);
    if (x1 <= x0 + 1e-12 * arm.length_m) break;
    const double x = 0.5 * (x0 + x1);
    CablePiece piece = ArmCablePath(arm, cable, x);
    piece.share = (x1 - x0) / rod.elements[i].length;
    out.pieces.push_back(piece);
    out.rest_length_m += CablePieceLength(piece, rod.elements[i],
                                          rod.elements[i].length * rod.elements[i].reference_strain,
                                          nullptr, nullptr);
  }
  return out;
}

void CheckArm(const Arm& arm) {
  Demand(arm.length_m > 0, fmt::format("length = {} m, must be > 0", arm.length_m));
  Demand(arm.elements >= 1, fmt::format("elements = {}, must be >= 1", arm.elements));
  Demand(arm.radius_base_m > 0 && arm.radius_tip_m > 0,
         fmt::format("radius = {}, {} m, must be > 0", arm.radius_base_m, arm.radius_tip_m));
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
          distance <= Radius(arm, p.x()) * (1 + 1e-12),
          fmt::format("cables.{}: path: {:.6g} m from the centreline at X = {:.6g} m, must be <= "
                      "{:.6g} m: the cable must lie inside the section",
                      c.name, distance, p.x(), Radius(arm, p.x())));
    }
    Demand(c.end_m > 0 && c.end_m <= arm.length_m * (1 + 1e-12),
           fmt::format("cables.{}: end = {} m, must be in (0, {}]", c.name, c.end_m, arm.length_m));
  }
  for (const PointWrench& p : arm.points) {
    Demand(p.at_m >= 0 && p.at_m <= arm.length_m * (1 + 1e-12),
           fmt::format("points.{}: at = {} m, must be in [0, {}]", p.name, p.at_m, arm.length_m));
  }
}

}  // namespace

Vector6 ArmRestStrain(const Arm& arm, double x) {
  Vector6 xi;
  xi << arm.curvature_base + (arm.curvature_tip - arm.curvature_base) * (x / arm.length_m), 1, 0, 0;
  return xi;
}

Vector6 ArmStiffness(const Arm& arm, double x) {
  if (arm.stiffness) return *arm.stiffness;
  return SectionStiffness(arm.material, arm.shear_correction, Radius(arm, x));
}

Vector6 ArmViscosity(const Arm& arm, const Effects& effects, double x) {
  if (!effects.viscosity) return Vector6::Zero();
  if (arm.viscosity) return *arm.viscosity;
  return SectionViscosity(arm.material, Radius(arm, x));
}

RodNode ArmSection(const Arm& arm, const Water& water, const Effects& effects, double x,
                   double weight) {
  const double radius = Radius(arm, x);
  RodNode node;
  node.weight_m = weight;
  node.section = {x, std::numbers::pi * radius * radius, radius};
  node.inertia =
      weight * (arm.inertia ? *arm.inertia : SectionInertia(arm.material.density_kg_m3, radius));
  if (effects.added_mass) {
    node.added_mass_kg =
        weight * SectionAddedMass(water.density_kg_m3, arm.added_mass_coefficient, radius);
  }
  return node;
}

CablePiece ArmCablePath(const Arm& arm, const ArmCable& cable, double x) {
  if (!cable.path.empty()) {  // piecewise linear
    const auto after = std::upper_bound(cable.path.begin(), cable.path.end(), x,
                                        [](double at, const Vector3& p) { return at < p.x(); });
    if (after == cable.path.begin()) return {{0, after->y(), after->z()}, Vector3::Zero(), 1.0};
    const Vector3& a = *(after - 1);
    if (after == cable.path.end()) return {{0, a.y(), a.z()}, Vector3::Zero(), 1.0};
    const Vector3 slope = (*after - a) / (after->x() - a.x());
    const Vector3 at = a + (x - a.x()) * slope;
    return {{0, at.y(), at.z()}, {0, slope.y(), slope.z()}, 1.0};
  }
  const double angle_rate = 2.0 * std::numbers::pi * cable.turns / arm.length_m;
  const double angle = cable.angle_rad + angle_rate * x;
  const Vector3 along(0, std::cos(angle), std::sin(angle));
  const Vector3 across(0, -std::sin(angle), std::cos(angle));
  const double taper = (arm.radius_tip_m - arm.radius_base_m) / arm.length_m;
  const double r = cable.fraction * Radius(arm, x);
  return {r * along, cable.fraction * taper * along + r * angle_rate * across, 1.0};
}

double CablePieceLength(const CablePiece& piece, const RodElement& e, const Vector6& d,
                        Vector6* gradient, Matrix6* hessian) {
  // Speed of the path in the section frame: gamma + kappa x offset + offset' ([physics.md] 2).
  const Vector3 speed = (d.tail<3>() + d.head<3>().cross(piece.offset_m)) / e.length + piece.slope;
  const double norm = speed.norm();
  const Vector3 t = speed / norm;
  if (gradient != nullptr) {
    *gradient << piece.share * piece.offset_m.cross(t), piece.share * t;
  }
  if (hessian != nullptr) {
    Eigen::Matrix<double, 3, 6> b;  // d speed / d (l xi), times l
    b << -Hat(piece.offset_m), Matrix3::Identity();
    const Matrix3 p = (Matrix3::Identity() - t * t.transpose()) * (piece.share / (norm * e.length));
    *hessian = b.transpose() * p * b;
  }
  return piece.share * e.length * norm;
}

Rod MakeRod(const Arm& arm, const Water& water, const Effects& effects) {
  CheckArm(arm);
  Rod rod;
  rod.name = arm.name;
  rod.mount = arm.mount;
  rod.x_m = NodesOf(arm);
  const int n = arm.elements;
  rod.nodes.resize(n + 1);
  rod.middles.resize(n);
  rod.reference.resize(n + 1);
  for (int i = 0; i < n; ++i) {
    rod.reference[i + 1] = AdvanceReference(arm, rod.reference[i], rod.x_m[i], rod.x_m[i + 1]);
    rod.elements.push_back(ElementOf(arm, effects, Inverse(rod.reference[i]) * rod.reference[i + 1],
                                     rod.x_m[i], rod.x_m[i + 1]));
    AddSections(arm, water, effects, rod.x_m[i], rod.x_m[i + 1], &rod.nodes[i], &rod.middles[i],
                &rod.nodes[i + 1]);
  }
  for (int i = 0; i <= n; ++i) rod.nodes[i].section.x_m = rod.x_m[i];
  for (auto* places : {&rod.nodes, &rod.middles}) {
    for (RodNode& place : *places) {
      place.section.area_m2 /= place.weight_m;
      place.section.radius_m /= place.weight_m;
    }
  }
  AddLoads(&rod.loads, arm, water, effects);
  for (const DistributedWrench& d : arm.distributed) {
    rod.distributed.push_back(
        {d.name, DistributedLoad{d.direction, d.base, d.tip, arm.length_m, d.frame}, d.schedule});
  }
  for (const PointWrench& p : arm.points) {
    const auto at = std::min_element(rod.x_m.begin(), rod.x_m.end(), [&](double a, double b) {
      return std::abs(a - p.at_m) < std::abs(b - p.at_m);
    });
    rod.points.push_back({static_cast<int>(at - rod.x_m.begin()), p});
  }
  for (const ArmCable& c : arm.cables) rod.cables.push_back(CableOf(arm, c, rod));
  return rod;
}

}  // namespace mantle::model
