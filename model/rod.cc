#include "model/rod.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "model/arm_section.h"
#include "model/rigid_body.h"

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
  if (!arm.pieces.empty()) {
    const PiecePlace at = PieceAt(arm.pieces, x);
    return AreaOf(at.piece, at.share).radius_m;
  }
  return arm.radius_base_m + (arm.radius_tip_m - arm.radius_base_m) * x / arm.length_m;
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
  return std::hypot(p.y(), p.z()) <= Radius(arm, p.x()) * kRoundOff;
}

// Calls part(from, to) for what lies of [x0, x1] in each piece.
template <typename Part>
void ForEachPart(const Arm& arm, double x0, double x1, Part part) {
  for (const double border : PieceBorders(arm, false)) {
    if (border <= x0 + 1e-12 * arm.length_m || border >= x1 - 1e-12 * arm.length_m) continue;
    part(x0, border);
    x0 = border;
  }
  part(x0, x1);
}

struct Station {
  const char* what;
  double at_m;
};
std::vector<Station> StationsOf(const Arm& arm) {
  std::vector<Station> stations;
  for (const double x : PieceBorders(arm, true)) stations.push_back({"pieces: end", x});
  for (const Payload& p : arm.payloads) stations.push_back({"payloads: at", p.at_m});
  for (const PointWrench& p : arm.points) stations.push_back({"points: at", p.at_m});
  return stations;
}

// Uniform nodes, the nearest interior one moved onto each station.
std::vector<double> NodesOf(const Arm& arm) {
  const int n = arm.elements;
  std::vector<double> x(n + 1);
  for (int i = 0; i <= n; ++i) x[i] = arm.length_m * i / n;
  std::vector<bool> taken(n + 1, false);
  taken.front() = taken.back() = true;
  for (const Station& p : StationsOf(arm)) {
    const int i = static_cast<int>(std::lround(p.at_m / arm.length_m * n));
    if (std::abs(x[i] - p.at_m) < 1e-9 * arm.length_m) {
      taken[i] = true;
      continue;
    }
    Demand(!taken[i], fmt::format("{} = {} m falls between nodes that other points or the "
                                  "ends hold; use more elements than {}",
                                  p.what, p.at_m, n));
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

// A full stiffness with the residual bending flexibility (model/rod_element.h): what a force across
// the rod adds to the compliance C by the moments that vary along the element, l^2 / 12 of C's own
// bending, M_z going with F_y and M_y with -F_z.
Matrix6 WithResidualBending(const Matrix6& stiffness, double length) {
  Matrix6 c = stiffness.inverse();
  const double k = length * length / 12.0;
  const double yy = k * c(2, 2), zz = k * c(1, 1), yz = -k * c(1, 2);
  c(4, 4) += yy;
  c(5, 5) += zz;
  c(4, 5) += yz;
  c(5, 4) += yz;
  const Matrix6 s = c.inverse();
  return 0.5 * (s + s.transpose());
}

// `coupling` receives what couples the strains, where anything does.
RodElement ElementOf(const Arm& arm, const Effects& effects, const Pose& relative, double x0,
                     double x1, Matrix6* coupling) {
  RodElement e;
  e.length = x1 - x0;
  const bool straight = arm.curvature_base.isZero(0.0) && arm.curvature_tip.isZero(0.0);
  e.reference_strain = straight ? ArmRestStrain(arm, 0) : Vector6(LogSE3(relative) / e.length);
  Matrix6 mean = Matrix6::Zero();
  ForEachPart(arm, x0, x1, [&](double from, double to) {
    const double share = (to - from) / e.length;
    for (int k = 0; k < 5; ++k) {
      const double x = from + kGaussPoint[k] * (to - from);
      e.stiffness += share * kGaussWeight[k] * ArmStiffness(arm, x);
      e.viscosity += share * kGaussWeight[k] * ArmViscosity(arm, effects, x);
    }
    mean += share * ArmStiffnessCoupling(arm, 0.5 * (from + to));
  });
  const Vector6 section = e.stiffness;
  AddResidualBending(&e);
  if (!mean.isZero(0.0)) {
    mean.diagonal() += section;
    *coupling = WithResidualBending(mean, e.length);
    e.stiffness = coupling->diagonal();
    coupling->diagonal().setZero();
  }
  return e;
}

// Place of an element's inner mass, as a share of its length.
double MiddlePlace(const Arm& arm, const Water& water, const Effects& effects, double x0,
                   double x1) {
  double mass = 0, moment = 0;
  ForEachPart(arm, x0, x1, [&](double from, double to) {
    for (int k = 0; k < 5; ++k) {
      const double x = from + kGaussPoint[k] * (to - from);
      const double s = (x - x0) / (x1 - x0), weight = kGaussWeight[k] * (to - from);
      const RodNode section = ArmSection(arm, water, effects, x, 1.0);
      const double density = section.inertia(5) > 0 ? section.inertia(5) : section.section.area_m2;
      mass += weight * density * s * (1.0 - s);
      moment += weight * density * s * s * (1.0 - s);
    }
  });
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
  ForEachPart(arm, x0, x1, [&](double from, double to) {
    for (int k = 0; k < 5; ++k) {
      const double x = from + kGaussPoint[k] * (to - from), s = (x - x0) / length;
      const RodNode section = ArmSection(arm, water, effects, x, kGaussWeight[k] * (to - from));
      const auto add = [&](double share, double rotary, RodNode* node) {
        const double weight = share * section.weight_m;
        node->weight_m += weight;
        node->section.area_m2 += weight * section.section.area_m2;
        node->section.radius_m += weight * section.section.radius_m;
        node->section.drag_shape += weight * section.section.radius_m * section.section.drag_shape;
        node->inertia.head<3>() += rotary * section.inertia.head<3>();
        node->inertia.tail<3>() += share * section.inertia.tail<3>();
        node->added_mass_kg += share * section.added_mass_kg;
      };
      add((1.0 - s) * (at - s) / at, kNodalRotary * (1.0 - s), left);
      add(s * (1.0 - s) / (at * (1.0 - at)), 1.0 - kNodalRotary, middle);
      add(s * (s - at) / (1.0 - at), kNodalRotary * s, right);
    }
  });
  middle->section.x_m = x0 + at * length;
  middle->ahead_m = (at - 0.5) * length;
}

int NodeAt(const Rod& rod, double x_m) {
  const auto at = std::min_element(rod.x_m.begin(), rod.x_m.end(), [&](double a, double b) {
    return std::abs(a - x_m) < std::abs(b - x_m);
  });
  return static_cast<int>(at - rod.x_m.begin());
}

RodPayload PayloadOf(const Rod& rod, const Payload& p, const Water& water, const Effects& effects) {
  const RigidBody body{p.name, GivenInertia{p.mass_kg, p.offset_m, p.inertia_kg_m2, p.volume_m3}};
  RodPayload out{NodeAt(rod, p.at_m), p, RigidInertia(body), {}, -1};
  if (effects.weight || effects.buoyancy) {
    out.loads.push_back(RigidGravityLoad{effects.gravity_m_s2, effects.weight ? p.mass_kg : 0.0,
                                         effects.buoyancy ? water.density_kg_m3 * p.volume_m3 : 0.0,
                                         p.offset_m});
  }
  if (effects.unsteady_current) {
    out.loads.push_back(
        RigidWaterAccelerationLoad{p.mass_kg, water.density_kg_m3 * p.volume_m3, p.offset_m});
  }
  return out;
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
                      c.name, distance, p.x(), Radius(arm, p.x())));
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

}  // namespace

Vector6 ArmRestStrain(const Arm& arm, double x) {
  Vector6 xi;
  xi << arm.curvature_base + (arm.curvature_tip - arm.curvature_base) * (x / arm.length_m), 1, 0, 0;
  return xi;
}

namespace {

// Of a rigid piece: every strain kRigidFactor times as stiff as the arm's stiffest section.
Vector6 RigidStiffness(const Arm& arm) {
  Vector6 largest = Vector6::Zero();
  for (const ArmPiece& p : arm.pieces) {
    if (p.rigid) continue;
    for (const double share : {0.0, 1.0}) {
      largest = largest.cwiseMax(Vector6(PieceStiffness(p, share).diagonal()));
    }
  }
  return kRigidFactor * largest;
}

}  // namespace

Vector6 ArmStiffness(const Arm& arm, double x) {
  if (!arm.pieces.empty()) {
    const PiecePlace at = PieceAt(arm.pieces, x);
    return at.piece.rigid ? RigidStiffness(arm)
                          : Vector6(PieceStiffness(at.piece, at.share).diagonal());
  }
  if (arm.stiffness) return *arm.stiffness;
  return SectionStiffness(arm.material, arm.shear_correction, Radius(arm, x));
}

Matrix6 ArmStiffnessCoupling(const Arm& arm, double x) {
  Matrix6 coupling = Matrix6::Zero();
  if (arm.pieces.empty()) return coupling;
  const PiecePlace at = PieceAt(arm.pieces, x);
  if (at.piece.rigid || !at.piece.stiffness) return coupling;
  coupling = *at.piece.stiffness;
  coupling.diagonal().setZero();
  return coupling;
}

Vector6 ArmViscosity(const Arm& arm, const Effects& effects, double x) {
  if (!effects.viscosity) return Vector6::Zero();
  if (!arm.pieces.empty()) {
    const PiecePlace at = PieceAt(arm.pieces, x);
    return at.piece.rigid ? Vector6(Vector6::Zero()) : PieceViscosity(at.piece, at.share);
  }
  if (arm.viscosity) return *arm.viscosity;
  return SectionViscosity(arm.material, Radius(arm, x));
}

RodNode ArmSection(const Arm& arm, const Water& water, const Effects& effects, double x,
                   double weight) {
  RodNode node;
  node.weight_m = weight;
  if (!arm.pieces.empty()) {
    const PiecePlace at = PieceAt(arm.pieces, x);
    const SectionArea area = AreaOf(at.piece, at.share);
    node.section = {x, area.displaced_m2, area.radius_m, 0.0, area.drag_shape};
    node.inertia = weight * PieceInertia(at.piece, at.share);
    if (effects.added_mass) {
      node.added_mass_kg =
          weight * SectionAddedMass(water.density_kg_m3, arm.added_mass_coefficient, area.radius_m);
    }
  } else {
    const double radius = Radius(arm, x);
    node.section = {x, std::numbers::pi * radius * radius, radius};
    node.inertia =
        weight * (arm.inertia ? *arm.inertia : SectionInertia(arm.material.density_kg_m3, radius));
    if (effects.added_mass) {
      node.added_mass_kg =
          weight * SectionAddedMass(water.density_kg_m3, arm.added_mass_coefficient, radius);
    }
  }
  if (weight > 0) node.section.density_kg_m3 = node.inertia(5) / (weight * node.section.area_m2);
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
  for (auto* places : {&rod.nodes, &rod.middles}) {
    for (RodNode& place : *places) place.section.drag_shape.setZero();
  }
  rod.reference.resize(n + 1);
  for (int i = 0; i < n; ++i) {
    rod.reference[i + 1] = AdvanceReference(arm, rod.reference[i], rod.x_m[i], rod.x_m[i + 1]);
    rod.coupling.push_back(Matrix6::Zero());
    rod.elements.push_back(ElementOf(arm, effects, Inverse(rod.reference[i]) * rod.reference[i + 1],
                                     rod.x_m[i], rod.x_m[i + 1], &rod.coupling[i]));
    AddSections(arm, water, effects, rod.x_m[i], rod.x_m[i + 1], &rod.nodes[i], &rod.middles[i],
                &rod.nodes[i + 1]);
  }
  for (int i = 0; i <= n; ++i) rod.nodes[i].section.x_m = rod.x_m[i];
  for (auto* places : {&rod.nodes, &rod.middles}) {
    for (RodNode& place : *places) {
      place.section.area_m2 /= place.weight_m;
      place.section.radius_m /= place.weight_m;
      place.section.drag_shape /= place.weight_m * place.section.radius_m;
      if (arm.pieces.empty()) place.section.drag_shape.setOnes();
      place.section.density_kg_m3 = place.inertia(5) / (place.weight_m * place.section.area_m2);
    }
  }
  AddLoads(&rod.loads, arm, water, effects);
  for (const DistributedWrench& d : arm.distributed) {
    rod.distributed.push_back({d.name,
                               DistributedLoad{d.direction, d.base, d.tip, arm.length_m, d.frame,
                                               d.internal.value_or(d.frame == LoadFrame::kBody)},
                               d.schedule});
  }
  for (const PointWrench& p : arm.points) {
    rod.points.push_back({NodeAt(rod, p.at_m), p});
  }
  for (const Payload& p : arm.payloads) rod.payloads.push_back(PayloadOf(rod, p, water, effects));
  for (const MuscleWave& m : arm.muscles) rod.muscles.push_back({m});
  const bool coupled = std::any_of(rod.coupling.begin(), rod.coupling.end(),
                                   [](const Matrix6& m) { return !m.isZero(0.0); });
  if (!coupled) rod.coupling.clear();
  for (const ArmCable& c : arm.cables) rod.cables.push_back(CableOf(arm, c, rod));
  return rod;
}

}  // namespace mantle::model
