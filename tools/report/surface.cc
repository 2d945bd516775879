#include "tools/report/surface.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace mantle::tools {
namespace {

constexpr int kMantleSides = 48, kArmSides = 16;
constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

Triple Sum(const Triple& a, const Triple& b) { return {a[0] + b[0], a[1] + b[1], a[2] + b[2]}; }

// Rings of `sides` vertices that were just added, joined to one another.
void Join(std::uint32_t first, int rings, int sides, Surface* s) {
  const auto n = static_cast<std::uint32_t>(sides);
  for (std::uint32_t i = 0; i + 1 < static_cast<std::uint32_t>(rings); ++i) {
    for (std::uint32_t k = 0; k < n; ++k) {
      const std::uint32_t a = first + i * n + k, b = first + i * n + (k + 1) % n;
      s->triangles.push_back({a, a + n, b});
      s->triangles.push_back({b, a + n, b + n});
    }
  }
}

// Mean of the spans beside node i of n; value(span) is one span's.
template <typename Value>
double AtNode(std::size_t i, std::size_t n, Value value) {
  if (n < 2) return 0;
  return 0.5 * (value(i > 0 ? i - 1 : 0) + value(std::min(i, n - 2)));
}

void AddVertex(const Triple& p, SurfaceBody body, std::int32_t arm, double hoop, double curvature,
               Surface* s) {
  s->position.push_back(p);
  s->body.push_back(body);
  s->arm.push_back(arm);
  s->hoop_strain.push_back(hoop);
  s->curvature.push_back(curvature);
}

// About e3 of the root; outline(i) is (r, z), hoop(i) the strain there.
template <typename Outline, typename Hoop>
void AddRevolution(const ShapeTelemetry& m, std::size_t nodes, SurfaceBody body, Outline outline,
                   Hoop hoop, Surface* s) {
  const auto first = static_cast<std::uint32_t>(s->position.size());
  for (std::size_t i = 0; i < nodes; ++i) {
    const auto [r, z] = outline(i);
    for (int k = 0; k < kMantleSides; ++k) {
      const double angle = 2.0 * std::numbers::pi * k / kMantleSides;
      const Triple at = {r * std::cos(angle), r * std::sin(angle), z};
      AddVertex(Sum(m.root_position, Rotate(m.root_quaternion, at)), body, -1, hoop(i), kNone, s);
    }
  }
  Join(first, static_cast<int>(nodes), kMantleSides, s);
}

}  // namespace

Triple Rotate(const Quaternion& q, const Triple& v) {
  // v + 2 w (u x v) + 2 u x (u x v), u the vector part.
  const auto cross = [](const Triple& a, const Triple& b) -> Triple {
    return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
  };
  const Triple u = {q[1], q[2], q[3]}, t = cross(u, v), w = cross(u, t);
  Triple out;
  for (std::size_t k = 0; k < 3; ++k) out[k] = v[k] + 2.0 * (q[0] * t[k] + w[k]);
  return out;
}

Surface SurfaceOf(const ShapeTelemetry& m) {
  Surface s;
  if (!m.mantle_profile.empty()) {
    const std::size_t n = m.mantle_profile.size();
    AddRevolution(
        m, n, SurfaceBody::kMantle,
        [&](std::size_t i) { return std::pair(m.mantle_profile[i][0], m.mantle_profile[i][1]); },
        [&](std::size_t i) {
          return AtNode(i, n, [&](std::size_t e) { return double{m.mantle_strain[e][1]}; });
        },
        &s);
  }
  std::size_t node = 0, span = 0;
  for (std::size_t a = 0; a < m.arm_nodes.size(); ++a) {
    const auto n = static_cast<std::size_t>(m.arm_nodes[a]);
    const auto first = static_cast<std::uint32_t>(s.position.size());
    for (std::size_t i = 0; i < n; ++i) {
      const double curvature = AtNode(i, n, [&](std::size_t e) {
        return std::hypot(double{m.strain[span + e][1]}, double{m.strain[span + e][2]});
      });
      for (int k = 0; k < kArmSides; ++k) {
        const double angle = 2.0 * std::numbers::pi * k / kArmSides;
        const double r = double{m.radius[node + i]};
        const Triple across = {0, r * std::cos(angle), r * std::sin(angle)};
        AddVertex(Sum(m.position[node + i], Rotate(m.quaternion[node + i], across)),
                  SurfaceBody::kArm, static_cast<std::int32_t>(a), kNone, curvature, &s);
      }
    }
    Join(first, static_cast<int>(n), kArmSides, &s);
    node += n;
    span += n - 1;
  }
  if (m.rigid_profile.size() > 1) {
    AddRevolution(
        m, m.rigid_profile.size(), SurfaceBody::kRigid,
        [&](std::size_t i) { return std::pair(m.rigid_profile[i][0], m.rigid_profile[i][1]); },
        [](std::size_t) { return kNone; }, &s);
  }
  return s;
}

}  // namespace mantle::tools
