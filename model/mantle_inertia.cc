#include "model/mantle_inertia.h"

#include <algorithm>
#include <numbers>

namespace mantle::model {
namespace {

constexpr double kPi = std::numbers::pi;

// Per element: section pi (a^2 + ab + b^2)/3, height -dz, mid z; V_k = section height z^k.
struct Slice {
  double section, section_a, section_b, height, z;
};
Slice SliceOf(const Vector3& q1, const Vector3& q2) {
  const double a = q1(0), b = q2(0);
  return {kPi / 3.0 * (a * a + a * b + b * b), kPi / 3.0 * (2.0 * a + b), kPi / 3.0 * (a + 2.0 * b),
          q1(1) - q2(1), 0.5 * (q1(1) + q2(1))};
}

// Adds c[k] dV_k/dq to f.
void AddCavityGradient(const std::vector<Vector3>& q, const double c[3], Vector3* f) {
  for (std::size_t i = 0; i + 1 < q.size(); ++i) {
    const Slice s = SliceOf(q[i], q[i + 1]);
    const double g = c[0] + s.z * (c[1] + s.z * c[2]);
    const double gz = 0.5 * s.section * s.height * (c[1] + 2.0 * s.z * c[2]);
    f[i](0) += g * s.section_a * s.height;
    f[i + 1](0) += g * s.section_b * s.height;
    f[i](1) += g * s.section + gz;
    f[i + 1](1) += -g * s.section + gz;
  }
}

}  // namespace

CavityMoments EvaluateCavity(const std::vector<Vector3>& q, const Vector3* v) {
  CavityMoments m;
  for (std::size_t i = 0; i + 1 < q.size(); ++i) {
    const Slice s = SliceOf(q[i], q[i + 1]);
    const double section_rate = s.section_a * v[i](0) + s.section_b * v[i + 1](0);
    const double height_rate = v[i](1) - v[i + 1](1);
    const double z_rate = 0.5 * (v[i](1) + v[i + 1](1));
    const double volume = s.section * s.height;
    const double volume_rate = section_rate * s.height + s.section * height_rate;
    m.v[0] += volume;
    m.v[1] += volume * s.z;
    m.v[2] += volume * s.z * s.z;
    m.rate[0] += volume_rate;
    m.rate[1] += volume_rate * s.z + volume * z_rate;
    m.rate[2] += volume_rate * s.z * s.z + 2.0 * volume * s.z * z_rate;
  }
  return m;
}

MantleInertia EvaluateMantleInertia(const Shell& shell, const MantleWaterOptions& options,
                                    const std::vector<Vector3>& q, const Vector3* v) {
  MantleInertia out;
  const double lateral_factor =
      options.lateral_added_mass ? 1.0 / (1.0 + shell.added_mass_factor) : 1.0;
  for (std::size_t j = 0; j < q.size(); ++j) {
    const double m = shell.nodes[j].inertia(0);
    const double r = q[j](0), z = q[j](1), rd = v[j](0), zd = v[j](1);
    const double ml = lateral_factor * m;
    out.axial += m;
    out.axial_momentum += m * zd;
    out.lateral[0] += ml;
    out.lateral[1] += ml * z;
    out.lateral[2] += ml * z * z;
    out.lateral_rate[1] += ml * zd;
    out.lateral_rate[2] += 2.0 * ml * z * zd;
    out.roll += m * r * r;
    out.roll_rate += 2.0 * m * r * rd;
  }
  out.pitch = 0.5 * out.roll;
  out.pitch_rate = 0.5 * out.roll_rate;
  if (!options.lateral_added_mass && !options.contained_water) return out;
  const CavityMoments cavity = EvaluateCavity(q, v);
  const double rho = options.water_density_kg_m3;
  if (options.lateral_added_mass) {
    for (int k = 0; k < 3; ++k) {
      out.lateral[k] += rho * cavity.v[k];
      out.lateral_rate[k] += rho * cavity.rate[k];
    }
  }
  if (options.contained_water) {
    const double m = rho * std::max(cavity.v[0] - options.solid_volume_m3, 0.0);
    const double m_rate = m > 0.0 ? rho * cavity.rate[0] : 0.0;
    const double z = cavity.v[1] / cavity.v[0];
    const double z_rate = (cavity.rate[1] - z * cavity.rate[0]) / cavity.v[0];
    out.contained_kg = m;
    out.contained_rate_kg_s = m_rate;
    out.centroid_m = z;
    out.lateral[0] += m;
    out.lateral[1] += m * z;
    out.lateral[2] += m * z * z;
    out.lateral_rate[0] += m_rate;
    out.lateral_rate[1] += m_rate * z + m * z_rate;
    out.lateral_rate[2] += m_rate * z * z + 2.0 * m * z * z_rate;
  }
  return out;
}

void AddMantleInertia(const MantleInertia& m, bool rates, Matrix6* inertia) {
  const double* l = rates ? m.lateral_rate : m.lateral;
  const double pitch = rates ? m.pitch_rate : m.pitch;
  Matrix6& i = *inertia;
  i(0, 0) += l[2] + pitch;
  i(1, 1) += l[2] + pitch;
  i(2, 2) += rates ? m.roll_rate : m.roll;
  i(3, 3) += l[0];
  i(4, 4) += l[0];
  if (!rates) i(5, 5) += m.axial;
  i(1, 3) += l[1];
  i(3, 1) += l[1];
  i(0, 4) -= l[1];
  i(4, 0) -= l[1];
}

void AddCentrifugalForces(const Shell& shell, const MantleWaterOptions& options,
                          const MantleInertia& m, const CavityMoments& cavity,
                          const std::vector<Vector3>& q, const Vector6& root_twist, Vector3* f) {
  const double w1 = root_twist(0), w2 = root_twist(1), w3 = root_twist(2);
  const double v1 = root_twist(3), v2 = root_twist(4);
  const double lateral_factor =
      options.lateral_added_mass ? 1.0 / (1.0 + shell.added_mass_factor) : 1.0;
  const double pitch2 = w1 * w1 + w2 * w2;
  const double cross = v1 * w2 - v2 * w1;
  for (std::size_t j = 0; j < q.size(); ++j) {
    const double mass = shell.nodes[j].inertia(0);
    f[j](0) += mass * q[j](0) * (0.5 * pitch2 + w3 * w3);
    f[j](1) += lateral_factor * mass * (cross + q[j](1) * pitch2);
  }
  double c[3] = {0, 0, 0};
  if (options.lateral_added_mass) {
    const double rho = options.water_density_kg_m3;
    c[0] += 0.5 * rho * (v1 * v1 + v2 * v2);
    c[1] += rho * cross;
    c[2] += 0.5 * rho * pitch2;
  }
  if (options.contained_water) {
    // m_w u_c . du_c/dz_c dz_c/dq,  z_c = V1 / V0
    const double push = m.contained_kg * (cross + m.centroid_m * pitch2) / cavity.v[0];
    c[1] += push;
    c[0] -= push * m.centroid_m;
  }
  if (options.lateral_added_mass || options.contained_water) AddCavityGradient(q, c, f);
}

Vector6 OutflowWrench(const MantleInertia& m, double lip_z_m, const Vector6& root_twist) {
  Vector6 w = Vector6::Zero();
  if (m.contained_rate_kg_s >= 0.0) return w;
  const double u1 = root_twist(3) + root_twist(1) * lip_z_m;
  const double u2 = root_twist(4) - root_twist(0) * lip_z_m;
  const double f1 = m.contained_rate_kg_s * u1;
  const double f2 = m.contained_rate_kg_s * u2;
  w << -lip_z_m * f2, lip_z_m * f1, 0, f1, f2, 0;
  return w;
}

}  // namespace mantle::model
