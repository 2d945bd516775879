#include <cmath>

#include "reduced/mantle_loads.h"
#include "reduced/mantle_terms.h"

namespace mantle::reduced {
namespace {

using model::CoadjointTimes;
using Map = Eigen::Map<const VectorX>;
using Block = Eigen::Block<Eigen::MatrixXd>;

template <int K>
void AddElementTangents(const ReducedMantle& m, const MantleWork& work, Block stiffness,
                        Block damping) {
  MantleSquare<K> by_shape = MantleSquare<K>::Zero(m.size, m.size), by_velocity = by_shape;
  MantleRows<K, 5> product(5, m.size);
  for (std::size_t e = 0; e < m.elements.size(); ++e) {
    const auto rows = Fixed<K>(m.elements[e].rows);
    model::Matrix5 by_y, by_rate;
    ShellStrainTangents(m.elements[e].element, m.material, work.elements[e], &by_y, &by_rate);
    product.noalias() = by_y.lazyProduct(rows);
    by_shape.noalias() += rows.transpose().lazyProduct(product);
    if (m.material.viscosity_pa_s == 0.0) continue;
    product.noalias() = by_rate.lazyProduct(rows);
    by_velocity.noalias() += rows.transpose().lazyProduct(product);
  }
  stiffness += by_shape;
  damping += by_velocity;
}

}  // namespace

void LineariseMantle(const ReducedMantle& m, const MantleMotion& motion, int first,
                     MantleWork* work, Linearisation* out) {
  const int k = m.size;
  const Map s_dot(motion.s_dot, k);
  const Vector6 eta = motion.root_twist, alpha = motion.root_acceleration;
  work->polynomials.Evaluate(motion.s, true, &work->values);
  const auto gradient = [&](int i) { return work->values.gradient.col(i); };
  const auto hessian = [&](int i) -> const Eigen::MatrixXd& { return work->values.hessian[i]; };
  auto mass_root = out->mass.topLeftCorner<6, 6>();
  auto damping_root = out->damping.topLeftCorner<6, 6>();
  auto mass = out->mass.block(first, first, k, k);
  auto damping = out->damping.block(first, first, k, k);
  auto stiffness = out->stiffness.block(first, first, k, k);
  auto root_by_rate = out->damping.block(0, first, 6, k);
  auto root_by_shape = out->stiffness.block(0, first, 6, k);
  auto shape_by_root = out->damping.block(first, 0, k, 6);

  if (m.size == 3) {
    AddElementTangents<3>(m, *work, stiffness, damping);
  } else {
    AddElementTangents<Eigen::Dynamic>(m, *work, stiffness, damping);
  }

  // Inertia: functions c_i of the shape with gradient and Hessian, water's share added.
  Matrix6 inertia = m.axial_mass_kg * m.axial_pattern, rate = Matrix6::Zero();
  const bool water = m.moment1 >= 0;
  if (water) {
    const double inverse = 1.0 / work->volume_m3;
    Eigen::MatrixXd& h = work->centroid_hessian;
    h = inverse * (hessian(m.moment1) - work->centroid_m * hessian(m.volume));
    h.noalias() -= inverse * work->centroid_gradient.lazyProduct(gradient(m.volume).transpose());
    h.noalias() -= inverse * gradient(m.volume).lazyProduct(work->centroid_gradient.transpose());
  }
  const double water_density = water && work->water_kg > 0.0 ? m.water_density_kg_m3 : 0.0;
  for (int i = 0; i < 4; ++i) {
    const Matrix6& pattern = m.inertia_pattern[i];
    const Vector6 turned = pattern * eta;
    const Vector6 pushed = pattern * alpha - CoadjointTimes(eta, turned);
    double value = work->values.value(m.inertia[i]);
    // own part
    stiffness.noalias() -= (0.5 * eta.dot(turned)) * hessian(m.inertia[i]);
    shape_by_root.noalias() -= gradient(m.inertia[i]).lazyProduct(turned.transpose());
    work->column = gradient(m.inertia[i]);
    work->row.noalias() = hessian(m.inertia[i]).lazyProduct(s_dot);
    if (water && i < 3) {
      const WaterShare share = ShareOf(*work, i);
      value += share.value;
      work->column += share.by_m * work->water_gradient + share.by_z * work->centroid_gradient;
      // Hessian of m z^i times s_dot
      const double m_rate = work->water_rate_kg_s, z_rate = work->centroid_rate_m_s;
      const double z = work->centroid_m;
      const double mixed = i == 0 ? 0.0 : (i == 1 ? 1.0 : 2.0 * z);  // d2/dm dz
      const double twice = i == 2 ? 2.0 * work->water_kg : 0.0;      // d2/dz2
      work->row.noalias() += (share.by_m * water_density) * hessian(m.volume).lazyProduct(s_dot);
      work->row.noalias() += share.by_z * work->centroid_hessian.lazyProduct(s_dot);
      work->row += (mixed * z_rate) * work->water_gradient;
      work->row += (mixed * m_rate + twice * z_rate) * work->centroid_gradient;
    }
    inertia += value * pattern;
    rate += work->column.dot(s_dot) * pattern;
    root_by_rate.noalias() += turned.lazyProduct(work->column.transpose());
    root_by_shape.noalias() += pushed.lazyProduct(work->column.transpose());
    root_by_shape.noalias() += turned.lazyProduct(work->row.transpose());
  }
  Vector6 momentum = inertia * eta;
  momentum(5) += m.axial_coupling.dot(s_dot);
  mass_root += inertia;
  damping_root += rate - model::CoadjointMatrix(momentum);
  damping_root.noalias() -= model::SmallAdjoint(eta).transpose() * inertia;
  const Vector6 turned_axis = CoadjointTimes(eta, Vector6::Unit(5));
  root_by_rate.noalias() -= turned_axis.lazyProduct(m.axial_coupling.transpose());
  mass.diagonal().array() += 1.0;
  out->mass.block(5, first, 1, k) += m.axial_coupling.transpose();
  out->mass.block(first, 5, k, 1) += m.axial_coupling;

  if (water) {
    const Turn t = TurnOf(eta);
    const double push = t.cross + work->centroid_m * t.pitch2;
    const auto& gz = work->centroid_gradient;
    stiffness.noalias() -= (work->water_kg * push) * work->centroid_hessian;
    stiffness.noalias() -= push * gz.lazyProduct(work->water_gradient.transpose());
    stiffness.noalias() -= (work->water_kg * t.pitch2) * gz.lazyProduct(gz.transpose());
    const Vector6 by_twist =
        work->water_kg * (t.cross_by_twist + work->centroid_m * t.pitch2_by_twist);
    shape_by_root.noalias() -= gz.lazyProduct(by_twist.transpose());
    AddOutflowTangent(m, motion, first, work, out);
  }
  for (const model::MantleLoad& load : m.loads) {
    std::visit([&](const auto& l) { AddToTangent(l, m, motion, first, work, out); }, load);
  }
  for (std::size_t c = 0; c < m.spokes.size(); ++c) {
    const model::CableInput& in = motion.spokes[c];
    if (!in.reeled || work->cable_tension_n[c] == 0.0) continue;
    const VectorX& g = m.spokes[c].gradient;
    stiffness.noalias() += in.stiffness_n_m * g.lazyProduct(g.transpose());
    damping.noalias() += in.damping_n_s_m * g.lazyProduct(g.transpose());
  }
}

}  // namespace mantle::reduced
