#include "model/rod.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "model/arm_check.h"
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

}  // namespace

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
  rod.loads = SectionLoads(arm, water, effects);
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
