#include "reduced/mantle_loads.h"

#include <cmath>

#include "model/lateral_drag.h"
#include "reduced/mantle_terms.h"

namespace mantle::reduced {
namespace {

using Map = Eigen::Map<const VectorX>;

// Lateral drag, for k times radius and height of each slice.
template <int K>
Vector6 SliceDrag(const ReducedMantle& m, double k, const Map& s, const Vector6& eta) {
  const Eigen::Map<const MantleVector<K>> x(s.data(), m.size);
  Vector6 drag = Vector6::Zero();
  for (const LateralSlice& slice : m.slices) {
    const double radius = slice.r + Fixed<K>(slice.r_row).dot(x);
    const double height = std::abs(slice.height + Fixed<K>(slice.height_row).dot(x));
    model::AddLateralDragSlice(k * radius * height, slice.z + Fixed<K>(slice.z_row).dot(x), eta,
                               &drag);
  }
  return drag;
}

// Derivatives of the lateral drag, for c times radius and height of each slice.
template <int K>
void AddSliceTangents(const ReducedMantle& m, double c, const Map& s, const Vector6& eta,
                      Matrix6* by_twist, Eigen::Block<Eigen::MatrixXd> root_by_shape) {
  const Eigen::Map<const MantleVector<K>> x(s.data(), m.size);
  MantleRows<K, 6> sum = MantleRows<K, 6>::Zero(6, m.size);
  for (const LateralSlice& slice : m.slices) {
    const auto r_row = Fixed<K>(slice.r_row), z_row = Fixed<K>(slice.z_row),
               height_row = Fixed<K>(slice.height_row);
    const double radius = slice.r + r_row.dot(x);
    const double height = slice.height + height_row.dot(x);
    const double sign = height < 0.0 ? -1.0 : 1.0;
    Vector6 by_z = Vector6::Zero(), by_k = Vector6::Zero();
    model::AddLateralDragSliceTangent(c * radius * sign * height, slice.z + z_row.dot(x), eta,
                                      by_twist, &by_z, &by_k);
    const MantleVector<K> row = (c * sign) * (height * r_row + radius * height_row);
    sum.noalias() += by_z.lazyProduct(z_row.transpose());
    sum.noalias() += by_k.lazyProduct(row.transpose());
  }
  root_by_shape -= sum;
}

}  // namespace

void AddToResidual(const model::NormalPressureLoad&, const ReducedMantle& m,
                   const MantleMotion& motion, MantleWork* work) {
  work->residual -= motion.normal_pressure_pa * work->values.value.segment(m.wall, m.size);
}

void AddToTangent(const model::NormalPressureLoad&, const ReducedMantle& m,
                  const MantleMotion& motion, int first, MantleWork* work, Linearisation* out) {
  out->stiffness.block(first, first, m.size, m.size).noalias() -=
      motion.normal_pressure_pa * work->values.gradient.middleCols(m.wall, m.size).transpose();
}

void AddToResidual(const model::JetLoad& load, const ReducedMantle& m, const MantleMotion& motion,
                   MantleWork* work) {
  const Map s_dot(motion.s_dot, m.size);
  work->flux_m3_s =
      m.flux < 0 ? work->volume_rate_m3_s : work->values.value.segment(m.flux, m.size).dot(s_dot);
  const model::JetLoad::Jet jet = load.Evaluate(work->flux_m3_s);
  work->thrust_n = jet.thrust_n;
  work->thrust_by_flux = jet.thrust_by_flux;
  work->residual -= jet.thrust_n * m.thrust;
  work->root_wrench(5) -= jet.thrust_n;
}

void AddToTangent(const model::JetLoad&, const ReducedMantle& m, const MantleMotion& motion,
                  int first, MantleWork* work, Linearisation* out) {
  const int k = m.size;
  const Map s_dot(motion.s_dot, k);
  if (m.flux < 0) {
    work->column = work->thrust_by_flux * work->values.gradient.col(m.volume);
    work->row.noalias() = work->thrust_by_flux * work->values.hessian[m.volume].lazyProduct(s_dot);
  } else {
    work->column = work->thrust_by_flux * work->values.value.segment(m.flux, k);
    work->row.noalias() =
        work->thrust_by_flux * work->values.gradient.middleCols(m.flux, k).lazyProduct(s_dot);
  }
  out->damping.block(first, first, k, k).noalias() -=
      m.thrust.lazyProduct(work->column.transpose());
  out->stiffness.block(first, first, k, k).noalias() -= m.thrust.lazyProduct(work->row.transpose());
  out->damping.block(5, first, 1, k) -= work->column.transpose();
  out->stiffness.block(5, first, 1, k) -= work->row.transpose();
}

void AddToResidual(const model::AxialDragLoad& load, const ReducedMantle& m, const MantleMotion&,
                   MantleWork* work) {
  work->drag_n = load.Force(work->max_radius_m, work->axial_speed_m_s);
  work->residual -= work->drag_n * m.mean_axial;
  work->root_wrench(5) -= work->drag_n;
}

void AddToTangent(const model::AxialDragLoad&, const ReducedMantle& m, const MantleMotion&,
                  int first, MantleWork* work, Linearisation* out) {
  if (work->axial_speed_m_s == 0.0) return;  // quadratic in speed and in radius
  const int k = m.size;
  const double by_speed = 2.0 * work->drag_n / work->axial_speed_m_s;
  const double by_radius = 2.0 * work->drag_n / work->max_radius_m;
  out->damping.block(first, first, k, k).noalias() -=
      by_speed * m.mean_axial.lazyProduct(m.mean_axial.transpose());
  out->damping.block(first, 5, k, 1) -= by_speed * m.mean_axial;
  out->damping.block(5, first, 1, k) -= by_speed * m.mean_axial.transpose();
  out->damping(5, 5) -= by_speed;
  const auto widest = m.radius_rows.row(work->widest);
  out->stiffness.block(first, first, k, k).noalias() -=
      by_radius * m.mean_axial.lazyProduct(widest);
  out->stiffness.block(5, first, 1, k) -= by_radius * widest;
}

void AddToResidual(const model::LateralDragLoad& load, const ReducedMantle& m,
                   const MantleMotion& motion, MantleWork* work) {
  const Map s(motion.s, m.size);
  const double k = load.water_density_kg_m3 * load.coefficient;
  work->root_wrench -= m.size == 3 ? SliceDrag<3>(m, k, s, motion.root_twist)
                                   : SliceDrag<Eigen::Dynamic>(m, k, s, motion.root_twist);
}

void AddToTangent(const model::LateralDragLoad& load, const ReducedMantle& m,
                  const MantleMotion& motion, int first, MantleWork*, Linearisation* out) {
  const Map s(motion.s, m.size);
  const double c = load.water_density_kg_m3 * load.coefficient;
  Matrix6 by_twist = Matrix6::Zero();
  const auto root_by_shape = out->stiffness.block(0, first, 6, m.size);
  if (m.size == 3) {
    AddSliceTangents<3>(m, c, s, motion.root_twist, &by_twist, root_by_shape);
  } else {
    AddSliceTangents<Eigen::Dynamic>(m, c, s, motion.root_twist, &by_twist, root_by_shape);
  }
  out->damping.topLeftCorner<6, 6>() -= by_twist;
}

void AddToResidual(const model::WallGravityLoad& load, const ReducedMantle& m,
                   const MantleMotion& motion, MantleWork* work) {
  const Map s(motion.s, m.size);
  const Vector3 g = load.SurfaceForce(motion.root_rotation, motion.field_scale);
  const double moment = m.axial_moment + m.axial_area.dot(s);
  work->residual -= g.z() * m.axial_area;
  work->root_wrench(0) += moment * g.y();
  work->root_wrench(1) -= moment * g.x();
  work->root_wrench.tail<3>() -= m.area_m2 * g;
}

void AddToTangent(const model::WallGravityLoad& load, const ReducedMantle& m,
                  const MantleMotion& motion, int first, MantleWork*, Linearisation* out) {
  const Vector3 g = load.SurfaceForce(motion.root_rotation, motion.field_scale);
  if (g.isZero(0.0)) return;
  const int k = m.size;
  const Map s(motion.s, k);
  // R^T g turns by (R^T g) x zeta when the root turns by zeta
  const Matrix3 turn = model::Hat(g);
  const double moment = m.axial_moment + m.axial_area.dot(s);
  auto by_rotation = out->stiffness.topLeftCorner<6, 3>();
  by_rotation.row(0) += moment * turn.row(1);
  by_rotation.row(1) -= moment * turn.row(0);
  by_rotation.bottomRows<3>() -= m.area_m2 * turn;
  out->stiffness.block(first, 0, k, 3).noalias() -= m.axial_area.lazyProduct(turn.row(2));
  out->stiffness.block(0, first, 1, k) += g.y() * m.axial_area.transpose();
  out->stiffness.block(1, first, 1, k) -= g.x() * m.axial_area.transpose();
}

void AddToResidual(const model::OutflowLoad&, const ReducedMantle& m, const MantleMotion& motion,
                   MantleWork* work) {
  const Map s(motion.s, m.size);
  model::MantleInertia water;
  water.contained_rate_kg_s = work->water_rate_kg_s;
  work->root_wrench -= OutflowWrench(water, m.lip_z + m.lip_z_row.dot(s), motion.root_twist);
}

void AddOutflowTangent(const ReducedMantle& m, const MantleMotion& motion, int first,
                       MantleWork* work, Linearisation* out) {
  if (!(work->water_rate_kg_s < 0.0)) return;
  // OutflowWrench = m_dot (a (a . eta) + b (b . eta))
  const int k = m.size;
  const Map s(motion.s, k), s_dot(motion.s_dot, k);
  const Vector6& eta = motion.root_twist;
  const double z = m.lip_z + m.lip_z_row.dot(s), flow = work->water_rate_kg_s;
  Vector6 a, b;
  a << 0, z, 0, 1, 0, 0;
  b << -z, 0, 0, 0, 1, 0;
  const double ua = a.dot(eta), ub = b.dot(eta);
  const Vector6 by_flow = ua * a + ub * b;
  Vector6 by_z;
  by_z << -flow * ub, flow * ua, 0, 0, 0, 0;
  by_z += flow * (eta(1) * a - eta(0) * b);
  auto damping_root = out->damping.topLeftCorner<6, 6>();
  damping_root.noalias() -= flow * (a * a.transpose());
  damping_root.noalias() -= flow * (b * b.transpose());
  const double water_density = work->water_kg > 0.0 ? m.water_density_kg_m3 : 0.0;
  work->row.noalias() = water_density * work->values.hessian[m.volume].lazyProduct(s_dot);
  out->damping.block(0, first, 6, k).noalias() -=
      by_flow.lazyProduct(work->water_gradient.transpose());
  auto root_by_shape = out->stiffness.block(0, first, 6, k);
  root_by_shape.noalias() -= by_flow.lazyProduct(work->row.transpose());
  root_by_shape.noalias() -= by_z.lazyProduct(m.lip_z_row.transpose());
}

}  // namespace mantle::reduced
