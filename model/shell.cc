#include "model/shell.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "model/meridian.h"
#include "model/rod.h"

namespace mantle::model {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr std::array<double, 3> kGaussPoint = {0.11270166537925831, 0.5, 0.88729833462074169};
constexpr std::array<double, 3> kGaussWeight = {5.0 / 18.0, 8.0 / 18.0, 5.0 / 18.0};
constexpr double kMaxElementTurn = 0.7;  // rad of meridian per element: beyond, refuse the mesh

void Demand(bool ok, const std::string& message) {
  if (!ok) throw BadRobot(message);
}

void CheckMantle(const Mantle& m) {
  Demand(m.half_thickness_m > 0,
         fmt::format("half_thickness = {} m, must be > 0", m.half_thickness_m));
  Demand(!m.pieces.empty(), "profile: is empty, needs at least one line or arc");
  Demand(m.elements >= 2, fmt::format("elements = {}, must be >= 2", m.elements));
  Demand(m.grading > 0, fmt::format("grading = {}, must be > 0", m.grading));
  const double length = MeridianLength(m);
  for (int i = 0; i <= 200; ++i) {
    const double x = length * i / 200.0;
    const MeridianPoint p = MeridianAt(m, x);
    Demand(p.r_m >= -1e-9 * length,
           fmt::format("profile: r = {:.4g} m at X = {:.4g} m, must be >= 0", p.r_m, x));
  }
  for (double x : m.stations_m) {
    Demand(x >= 0 && x <= length * (1 + 1e-9),
           fmt::format("stations: {} m, must be in [0, {}]", x, length));
  }
  const auto strip = [&](const std::string& name, double from, double to) {
    Demand(from >= 0 && from < to && to <= length * (1 + 1e-9),
           fmt::format("{}: strip [{}, {}] m, must lie within [0, {}] and not be empty", name, from,
                       to, length));
  };
  for (const StripPressure& s : m.strips) strip("strips." + s.name, s.from_m, s.to_m);
  for (const SpokeCable& s : m.spokes) {
    strip("spokes." + s.name, s.from_m, s.to_m);
    Demand(s.spokes >= 1, fmt::format("spokes.{}: count = {}, must be >= 1", s.name, s.spokes));
  }
}

// Integrals of 2 pi r* against the two shape functions of an element.
std::array<double, 2> ShapeAreas(const Mantle& m, double x0, double x1) {
  std::array<double, 2> areas = {0.0, 0.0};
  for (int k = 0; k < 3; ++k) {
    const double r = MeridianAt(m, x0 + kGaussPoint[k] * (x1 - x0)).r_m;
    const double w = kGaussWeight[k] * (x1 - x0) * 2.0 * kPi * r;
    areas[0] += w * (1.0 - kGaussPoint[k]);
    areas[1] += w * kGaussPoint[k];
  }
  return areas;
}

StripWeights WeightsOf(const Mantle& m, const std::vector<ShellNode>& nodes,
                       const std::string& name, double from, double to) {
  StripWeights w{name, std::vector<double>(nodes.size(), 0.0), 0.0};
  const double eps = 1e-9 * MeridianLength(m);
  for (std::size_t i = 0; i + 1 < nodes.size(); ++i) {
    if (nodes[i].x_m < from - eps || nodes[i + 1].x_m > to + eps) continue;
    const auto areas = ShapeAreas(m, nodes[i].x_m, nodes[i + 1].x_m);
    w.area_m2[i] += areas[0];
    w.area_m2[i + 1] += areas[1];
    w.total_m2 += areas[0] + areas[1];
  }
  return w;
}

Vector3 Held(ShellEnd end, double radius, double length) {
  switch (end) {
    case ShellEnd::kClamped:
      return {1, 1, 1};
    case ShellEnd::kSupported:
      return {1, 1, 0};
    case ShellEnd::kSymmetric:
      return radius < 1e-9 * length ? Vector3(1, 0, 1) : Vector3(0, 1, 1);
    case ShellEnd::kFree:
      return {0, 0, 0};
  }
  return {0, 0, 0};
}

ShellElement ElementOf(const MeridianPoint& a, const MeridianPoint& b) {
  ShellElement e;
  e.chord = std::hypot(b.r_m - a.r_m, b.z_m - a.z_m);
  e.radius = 0.5 * (a.r_m + b.r_m);
  e.theta = 0.5 * (a.theta_rad + b.theta_rad);  // the chord's direction, exactly, on line and arc
  e.sine = std::sin(e.theta);
  e.mu = (b.theta_rad - a.theta_rad) / e.chord;
  return e;
}

// Thrust on the dome: in proportion to the projection 2 pi r r' dX of the part that opens outwards;
// the hole within r0 is the root's ([physics.md] 3).
void ShareThrust(const Mantle& m, const Effects& effects, Shell* shell) {
  const int n = shell->node_count();
  shell->thrust_share.assign(n, 0.0);
  if (effects.jet_thrust->place == ThrustPlace::kUniform) {
    for (int i = 0; i < n; ++i) shell->thrust_share[i] = shell->nodes[i].area_m2 / shell->area_m2;
    return;
  }
  double total = m.r0_m * m.r0_m;
  for (int i = 0; i + 1 < n; ++i) {
    const double r0 = shell->reference[i](0), r1 = shell->reference[i + 1](0);
    if (r1 <= r0) continue;
    // integrals of (r^2)' against the shape functions, r linear
    shell->thrust_share[i] += (r1 - r0) * (2.0 * r0 + r1) / 3.0;
    shell->thrust_share[i + 1] += (r1 - r0) * (r0 + 2.0 * r1) / 3.0;
    total += r1 * r1 - r0 * r0;
  }
  for (double& s : shell->thrust_share) s /= total;
  shell->thrust_share_root = m.r0_m * m.r0_m / total;
}

}  // namespace

Shell MakeShell(const Mantle& m, const Water& water, const Effects& effects) {
  (void)water;
  CheckMantle(m);
  Shell shell;
  shell.name = m.name;
  shell.material = {m.half_thickness_m, m.material.young_pa, m.material.poisson,
                    m.material.shear_pa(), effects.viscosity ? m.material.viscosity_pa_s : 0.0};
  shell.added_mass_factor = effects.added_mass ? m.added_mass_coefficient : 0.0;
  const std::vector<double> x = MeridianNodes(m);
  const int n = static_cast<int>(x.size()) - 1;
  shell.nodes.resize(n + 1);
  for (int i = 0; i <= n; ++i) {
    const MeridianPoint p = MeridianAt(m, x[i]);
    const double r = std::abs(p.r_m) < 1e-12 ? 0.0 : p.r_m;
    shell.reference.emplace_back(r, p.z_m, p.theta_rad);
    shell.nodes[i].x_m = x[i];
  }
  for (int i = 0; i < n; ++i) {
    ShellElement e = ElementOf(MeridianAt(m, x[i]), MeridianAt(m, x[i + 1]));
    const double turn = std::abs(e.mu) * e.chord;
    Demand(
        turn < kMaxElementTurn,
        fmt::format("elements = {}: an element turns {:.3g} rad at X = {:.4g} m, must be < {}; the "
                    "mesh is too coarse for its own geometry",
                    n, turn, x[i], kMaxElementTurn));
    const auto areas = ShapeAreas(m, x[i], x[i + 1]);
    e.area = areas[0] + areas[1];
    shell.nodes[i].area_m2 += areas[0];
    shell.nodes[i + 1].area_m2 += areas[1];
    shell.elements.push_back(e);
  }
  const double rho_2h = m.material.density_kg_m3 * 2.0 * m.half_thickness_m;
  const double j = m.half_thickness_m * m.half_thickness_m / 3.0;
  for (ShellNode& node : shell.nodes) {
    node.mass_kg = rho_2h * node.area_m2;
    const double full = (1.0 + shell.added_mass_factor) * node.mass_kg;
    node.inertia << full, full, j * node.mass_kg;
    shell.area_m2 += node.area_m2;
    shell.mass_kg += node.mass_kg;
  }
  const double length = MeridianLength(m);
  shell.nodes.front().held = Held(m.start, shell.reference.front()(0), length);
  shell.nodes.back().held = Held(m.end, shell.reference.back()(0), length);
  // On the axis a node has no radial mode even where its end is free.
  for (int i : {0, n}) {
    if (shell.reference[i](0) == 0.0) shell.nodes[i].held(0) = shell.nodes[i].held(2) = 1.0;
  }
  shell.rest_volume_m3 = ShellVolume(shell.reference);
  if (effects.jet_thrust) {
    Demand(m.nozzle_radius_m > 0,
           fmt::format("nozzle_radius = {} m, must be > 0 for jet_thrust", m.nozzle_radius_m));
    ShareThrust(m, effects, &shell);
  }
  for (const StripPressure& s : m.strips) {
    shell.strips.push_back({WeightsOf(m, shell.nodes, s.name, s.from_m, s.to_m), s.pressure_pa});
  }
  for (const SpokeCable& s : m.spokes) {
    ShellSpokes out{WeightsOf(m, shell.nodes, s.name, s.from_m, s.to_m), s.spokes, 0.0, s.drive};
    for (int i = 0; i <= n; ++i) {
      out.rest_length_m +=
          s.spokes * out.strip.area_m2[i] / out.strip.total_m2 * shell.reference[i](0);
    }
    shell.spokes.push_back(std::move(out));
  }
  return shell;
}

double ShellVolume(const std::vector<Vector3>& q) {
  double sum = 0.0;
  for (std::size_t i = 0; i + 1 < q.size(); ++i) {
    const double a = q[i](0), b = q[i + 1](0);
    sum -= (q[i + 1](1) - q[i](1)) * (a * a + a * b + b * b);
  }
  return kPi / 3.0 * sum;
}

void ShellVolumeGradient(const std::vector<Vector3>& q, std::vector<Vector3>* gradient) {
  for (Vector3& g : *gradient) g.setZero();
  for (std::size_t i = 0; i + 1 < q.size(); ++i) {
    const double a = q[i](0), b = q[i + 1](0);
    const double dz = q[i + 1](1) - q[i](1);
    const double section = kPi / 3.0 * (a * a + a * b + b * b);
    (*gradient)[i](0) -= kPi / 3.0 * dz * (2.0 * a + b);
    (*gradient)[i + 1](0) -= kPi / 3.0 * dz * (a + 2.0 * b);
    (*gradient)[i](1) += section;
    (*gradient)[i + 1](1) -= section;
  }
}

void ShellWallVolumeGradient(const std::vector<Vector3>& q, std::vector<Vector3>* gradient) {
  // What the wall sweeps, integral of 2 pi r (r' dz - z' dr) dX, is dU without its end planes'
  // share
  // -[pi r^2 dz].
  ShellVolumeGradient(q, gradient);
  gradient->front()(1) -= kPi * q.front()(0) * q.front()(0);
  gradient->back()(1) += kPi * q.back()(0) * q.back()(0);
}

}  // namespace mantle::model
