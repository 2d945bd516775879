#include <cmath>
#include <limits>

#include "reduced/mantle_loads.h"
#include "reduced/mantle_terms.h"

namespace mantle::reduced {
namespace {

using model::CoadjointTimes;
using Map = Eigen::Map<const VectorX>;

void EvaluateWater(const ReducedMantle& m, const Map& s_dot, MantleWork* work) {
  const auto gradient = [&](int i) { return work->values.gradient.col(i); };
  const double v0 = work->volume_m3;
  const double rho = m.water_density_kg_m3;
  const double free = v0 - m.solid_volume_m3;
  work->water_kg = rho * std::max(free, 0.0);
  work->centroid_m = work->values.value(m.moment1) / v0;
  work->water_gradient.setZero();
  if (free > 0.0) work->water_gradient = rho * gradient(m.volume);
  work->centroid_gradient = (gradient(m.moment1) - work->centroid_m * gradient(m.volume)) / v0;
  work->water_rate_kg_s = work->water_gradient.dot(s_dot);
  work->centroid_rate_m_s = work->centroid_gradient.dot(s_dot);
}

// Strains and stresses of the elements; R_s and the stored energy.
template <int K>
void EvaluateElements(const ReducedMantle& m, const MantleMotion& motion, MantleWork* work) {
  const Eigen::Map<const MantleVector<K>> s(motion.s, m.size), s_dot(motion.s_dot, m.size);
  MantleVector<K> sum = Fixed<K>(work->residual);
  work->elastic_j = 0;
  for (std::size_t e = 0; e < m.elements.size(); ++e) {
    const CubatureElement& c = m.elements[e];
    const auto rows = Fixed<K>(c.rows);
    model::ShellElementState& state = work->elements[e];
    state.y.noalias() = rows.lazyProduct(s);
    state.y += c.rest;
    state.y_dot.noalias() = rows.lazyProduct(s_dot);
    EvaluateShellStrains(c.element, m.material, &state);
    sum.noalias() -= rows.transpose().lazyProduct(ShellStrainForce(c.element, state));
    work->elastic_j += ShellElementEnergy(c.element, state);
  }
  work->residual = sum;
}

}  // namespace

MantleWork::MantleWork(const ReducedMantle& m)
    : elements(m.elements.size()),
      polynomials(m.polynomials),
      residual(VectorX::Zero(m.size)),
      root_wrench(Vector6::Zero()),
      cable_length_m(m.spokes.size(), 0.0),
      cable_rate_m_s(m.spokes.size(), 0.0),
      cable_tension_n(m.spokes.size(), 0.0),
      radius(VectorX::Zero(m.radius_rest.size())),
      water_gradient(VectorX::Zero(m.size)),
      centroid_gradient(VectorX::Zero(m.size)),
      centroid_hessian(Eigen::MatrixXd::Zero(m.size, m.size)),
      column(VectorX::Zero(m.size)),
      row(VectorX::Zero(m.size)) {
  m.polynomials.Size(&values);
}

model::EvaluationFailure EvaluateMantle(const ReducedMantle& m, const MantleMotion& motion,
                                        MantleWork* work) {
  const Map s(motion.s, m.size), s_dot(motion.s_dot, m.size), s_ddot(motion.s_ddot, m.size);
  const Vector6& eta = motion.root_twist;

  work->radius.noalias() = m.radius_rows.lazyProduct(s);
  work->radius += m.radius_rest;
  work->max_radius_m = work->radius.maxCoeff(&work->widest);
  for (int j = 0; j < work->radius.size(); ++j) {
    if (!(work->radius(j) > 0.0) && m.radius_rest(j) > 0.0) {
      return {nullptr, j, "radius [m] of the mantle closed up", work->radius(j), 0.0};
    }
  }
  work->polynomials.Evaluate(motion.s, false, &work->values);
  const auto gradient = [&](int i) { return work->values.gradient.col(i); };
  work->volume_m3 = work->values.value(m.volume);
  if (!(work->volume_m3 > 0.0)) {
    return {nullptr, -1, "enclosed volume [m^3]: the mantle is turned inside out", work->volume_m3,
            0.0};
  }
  work->volume_rate_m3_s = gradient(m.volume).dot(s_dot);

  VectorX& r = work->residual;
  r = s_ddot + motion.root_acceleration(5) * m.axial_coupling;
  if (m.size == 3) {
    EvaluateElements<3>(m, motion, work);
  } else {
    EvaluateElements<Eigen::Dynamic>(m, motion, work);
  }
  for (std::size_t e = 0; e < m.elements.size(); ++e) {
    if (!(work->elements[e].lambda > 0.0)) {
      return {nullptr,
              m.elements[e].index,
              "stretch along the meridian: the material is turned inside out",
              work->elements[e].lambda,
              0.0,
              "element"};
    }
  }

  Matrix6 inertia = m.axial_mass_kg * m.axial_pattern, rate = Matrix6::Zero();
  for (int i = 0; i < 4; ++i) {
    const int at = m.inertia[i];
    inertia += work->values.value(at) * m.inertia_pattern[i];
    rate += gradient(at).dot(s_dot) * m.inertia_pattern[i];
    r -= (0.5 * eta.dot(m.inertia_pattern[i] * eta)) * gradient(at);
  }
  if (m.moment1 >= 0) {
    EvaluateWater(m, s_dot, work);
    for (int i = 0; i < 3; ++i) {
      const WaterShare share = ShareOf(*work, i);
      inertia += share.value * m.inertia_pattern[i];
      rate += (share.by_m * work->water_rate_kg_s + share.by_z * work->centroid_rate_m_s) *
              m.inertia_pattern[i];
    }
    const Turn t = TurnOf(eta);
    r -= (work->water_kg * (t.cross + work->centroid_m * t.pitch2)) * work->centroid_gradient;
  }
  Vector6 momentum = inertia * eta;
  momentum(5) += m.axial_coupling.dot(s_dot);
  Vector6& w = work->root_wrench;
  w = inertia * motion.root_acceleration + rate * eta - CoadjointTimes(eta, momentum);
  w(5) += m.axial_coupling.dot(s_ddot);

  work->axial_speed_m_s = eta(5) + m.mean_axial.dot(s_dot);
  for (const model::MantleLoad& load : m.loads) {
    std::visit([&](const auto& l) { AddToResidual(l, m, motion, work); }, load);
  }
  for (std::size_t k = 0; k < m.strips.size(); ++k) r += motion.strips_pa[k] * m.strips[k];
  for (std::size_t k = 0; k < m.spokes.size(); ++k) {
    work->cable_length_m[k] = m.spokes[k].length_m + m.spokes[k].gradient.dot(s);
    work->cable_rate_m_s[k] = m.spokes[k].gradient.dot(s_dot);
    work->cable_tension_n[k] =
        model::CableTension(motion.spokes[k], work->cable_length_m[k], work->cable_rate_m_s[k]);
    r += work->cable_tension_n[k] * m.spokes[k].gradient;
  }
  if (!r.allFinite() || !w.allFinite()) {
    return {nullptr, -1, "a force on the mantle is not finite", r.norm() + w.norm(),
            std::numeric_limits<double>::max()};
  }
  return {};
}

}  // namespace mantle::reduced
