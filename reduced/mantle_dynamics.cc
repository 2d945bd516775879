#include <cmath>

#include "model/mantle_loads.h"
#include "reduced/mantle.h"

namespace mantle::reduced {
namespace {

using model::CoadjointTimes;
using Map = Eigen::Map<const VectorX>;

// eta-dependent factors of the contained water's push ([physics.md] 4): cross and pitch^2 of
// model/mantle_inertia.h.
struct Turn {
  double cross, pitch2;
  Vector6 cross_by_twist, pitch2_by_twist;
};
Turn TurnOf(const Vector6& eta) {
  Turn t;
  t.cross = eta(3) * eta(1) - eta(4) * eta(0);
  t.pitch2 = eta(0) * eta(0) + eta(1) * eta(1);
  t.cross_by_twist << -eta(4), eta(3), 0, eta(1), -eta(0), 0;
  t.pitch2_by_twist << 2 * eta(0), 2 * eta(1), 0, 0, 0, 0;
  return t;
}

// Shell weight minus buoyancy in the root frame, per reference area.
Vector3 SurfaceWeight(const model::Plant& plant, const Vector3& gravity) {
  const model::Effects& effects = plant.robot.effects;
  const model::Mantle& m = *plant.robot.mantle;
  const double net = (effects.weight ? m.material.density_kg_m3 : 0.0) -
                     (effects.buoyancy ? plant.robot.water.density_kg_m3 : 0.0);
  return 2.0 * m.half_thickness_m * net * gravity;
}

void EvaluateWater(const ReducedMantle& m, const model::Plant& plant, const Map& s_dot,
                   MantleWork* work) {
  const auto gradient = [&](int i) { return work->values.gradient.col(i); };
  const double v0 = work->volume_m3;
  const double rho = plant.robot.water.density_kg_m3;
  const double free = v0 - plant.water_options.solid_volume_m3;
  work->water_kg = rho * std::max(free, 0.0);
  work->centroid_m = work->values.value(m.moment1) / v0;
  work->water_gradient.setZero();
  if (free > 0.0) work->water_gradient = rho * gradient(m.volume);
  work->centroid_gradient = (gradient(m.moment1) - work->centroid_m * gradient(m.volume)) / v0;
  work->water_rate_kg_s = work->water_gradient.dot(s_dot);
  work->centroid_rate_m_s = work->centroid_gradient.dot(s_dot);
}

// Coefficients m z^i of the contained water in L_i, as (d/dm, d/dz).
struct WaterShare {
  double value, by_m, by_z;
};
WaterShare ShareOf(const MantleWork& work, int i) {
  const double m = work.water_kg, z = work.centroid_m;
  if (i == 0) return {m, 1.0, 0.0};
  if (i == 1) return {m * z, z, m};
  return {m * z * z, z * z, 2.0 * m * z};
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
      scratch(Eigen::Matrix<double, 5, Eigen::Dynamic>::Zero(5, m.size)),
      column(VectorX::Zero(m.size)),
      row(VectorX::Zero(m.size)) {
  m.polynomials.Size(&values);
}

const char* EvaluateMantle(const ReducedMantle& m, const model::Plant& plant,
                           const MantleMotion& motion, MantleWork* work) {
  const model::Effects& effects = plant.robot.effects;
  const model::Mantle& mantle = *plant.robot.mantle;
  const double rho = plant.robot.water.density_kg_m3;
  const Map s(motion.s, m.size), s_dot(motion.s_dot, m.size), s_ddot(motion.s_ddot, m.size);
  const Vector6& eta = motion.root_twist;

  work->radius.noalias() = m.radius_rows.lazyProduct(s);
  work->radius += m.radius_rest;
  work->max_radius_m = work->radius.maxCoeff(&work->widest);
  for (int j = 0; j < work->radius.size(); ++j) {
    if (!(work->radius(j) > 0.0) && m.radius_rest(j) > 0.0) {
      return "radius of the mantle closed up";
    }
  }
  work->polynomials.Evaluate(motion.s, false, &work->values);
  const auto gradient = [&](int i) { return work->values.gradient.col(i); };
  work->volume_m3 = work->values.value(m.volume);
  if (!(work->volume_m3 > 0.0)) return "volume of the mantle is not positive";
  work->volume_rate_m3_s = gradient(m.volume).dot(s_dot);

  VectorX& r = work->residual;
  r = s_ddot + motion.root_acceleration(5) * m.axial_coupling;
  work->elastic_j = 0;
  for (std::size_t e = 0; e < m.elements.size(); ++e) {
    const CubatureElement& c = m.elements[e];
    model::ShellElementState& state = work->elements[e];
    state.y.noalias() = c.rows.lazyProduct(s);
    state.y += c.rest;
    state.y_dot.noalias() = c.rows.lazyProduct(s_dot);
    EvaluateShellStrains(c.element, m.material, &state);
    const model::Vector5 force = ShellStrainForce(c.element, state);
    r.noalias() -= c.rows.transpose().lazyProduct(force);
    work->elastic_j += ShellElementEnergy(c.element, state);
  }

  Matrix6 inertia = m.axial_mass_kg * m.axial_pattern, rate = Matrix6::Zero();
  for (int i = 0; i < 4; ++i) {
    const int at = m.inertia[i];
    inertia += work->values.value(at) * m.inertia_pattern[i];
    rate += gradient(at).dot(s_dot) * m.inertia_pattern[i];
    r -= (0.5 * eta.dot(m.inertia_pattern[i] * eta)) * gradient(at);
  }
  if (effects.contained_water) {
    EvaluateWater(m, plant, s_dot, work);
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

  if (effects.jet_thrust) {
    work->flux_m3_s =
        m.flux < 0 ? work->volume_rate_m3_s : work->values.value.segment(m.flux, m.size).dot(s_dot);
    const model::Jet jet = EvaluateJet(mantle, rho, work->flux_m3_s);
    work->thrust_n = jet.thrust_n;
    work->thrust_by_flux = jet.thrust_by_flux;
    r -= jet.thrust_n * m.thrust;
    w(5) -= jet.thrust_n;
  }
  work->axial_speed_m_s = eta(5) + m.mean_axial.dot(s_dot);
  if (effects.drag) {
    work->drag_n = MantleDrag(mantle, rho, work->max_radius_m, work->axial_speed_m_s);
    r -= work->drag_n * m.mean_axial;
    w(5) -= work->drag_n;
  }
  for (std::size_t k = 0; k < m.strips.size(); ++k) r += motion.strips_pa[k] * m.strips[k];
  for (std::size_t k = 0; k < m.spokes.size(); ++k) {
    work->cable_length_m[k] = m.spokes[k].length_m + m.spokes[k].gradient.dot(s);
    work->cable_rate_m_s[k] = m.spokes[k].gradient.dot(s_dot);
    work->cable_tension_n[k] =
        model::CableTension(motion.spokes[k], work->cable_length_m[k], work->cable_rate_m_s[k]);
    r += work->cable_tension_n[k] * m.spokes[k].gradient;
  }
  if (m.wall >= 0) r -= motion.normal_pressure_pa * work->values.value.segment(m.wall, m.size);
  if (effects.lateral_drag) {
    const double k = rho * effects.lateral_drag->coefficient;
    Vector6 drag = Vector6::Zero();
    for (const LateralSlice& slice : m.slices) {
      const double radius = slice.r + slice.r_row.dot(s);
      const double height = std::abs(slice.height + slice.height_row.dot(s));
      model::AddLateralDragSlice(k * radius * height, slice.z + slice.z_row.dot(s), eta, &drag);
    }
    w -= drag;
  }
  if (plant.has_gravity()) {
    const Vector3 g = SurfaceWeight(plant, motion.gravity_m_s2);
    const double moment = m.axial_moment + m.axial_area.dot(s);
    r -= g.z() * m.axial_area;
    w(0) += moment * g.y();
    w(1) -= moment * g.x();
    w.tail<3>() -= plant.shell->area_m2 * g;
  }
  if (effects.contained_water) {
    model::MantleInertia water;
    water.contained_rate_kg_s = work->water_rate_kg_s;
    w -= OutflowWrench(water, m.lip_z + m.lip_z_row.dot(s), eta);
  }
  if (!r.allFinite() || !w.allFinite()) return "a force on the mantle is not finite";
  return nullptr;
}

void LineariseMantle(const ReducedMantle& m, const model::Plant& plant, const MantleMotion& motion,
                     int first, MantleWork* work, Linearisation* out) {
  const model::Effects& effects = plant.robot.effects;
  const double rho = plant.robot.water.density_kg_m3;
  const int k = m.size;
  const Map s(motion.s, k), s_dot(motion.s_dot, k);
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

  for (std::size_t e = 0; e < m.elements.size(); ++e) {
    const CubatureElement& c = m.elements[e];
    model::Matrix5 by_y, by_rate;
    ShellStrainTangents(c.element, m.material, work->elements[e], &by_y, &by_rate);
    work->scratch.noalias() = by_y.lazyProduct(c.rows);
    stiffness.noalias() += c.rows.transpose().lazyProduct(work->scratch);
    if (m.material.viscosity_pa_s == 0.0) continue;
    work->scratch.noalias() = by_rate.lazyProduct(c.rows);
    damping.noalias() += c.rows.transpose().lazyProduct(work->scratch);
  }

  // Inertia: functions c_i of the shape with gradient and Hessian, water's share added.
  Matrix6 inertia = m.axial_mass_kg * m.axial_pattern, rate = Matrix6::Zero();
  const bool water = effects.contained_water;
  if (water) {
    const double inverse = 1.0 / work->volume_m3;
    Eigen::MatrixXd& h = work->centroid_hessian;
    h = inverse * (hessian(m.moment1) - work->centroid_m * hessian(m.volume));
    h.noalias() -= inverse * work->centroid_gradient.lazyProduct(gradient(m.volume).transpose());
    h.noalias() -= inverse * gradient(m.volume).lazyProduct(work->centroid_gradient.transpose());
  }
  const double water_density = water && work->water_kg > 0.0 ? rho : 0.0;
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
    if (work->water_rate_kg_s < 0.0) {  // OutflowWrench = m_dot (a (a . eta) + b (b . eta))
      const double z = m.lip_z + m.lip_z_row.dot(s), flow = work->water_rate_kg_s;
      Vector6 a, b;
      a << 0, z, 0, 1, 0, 0;
      b << -z, 0, 0, 0, 1, 0;
      const double ua = a.dot(eta), ub = b.dot(eta);
      const Vector6 by_flow = ua * a + ub * b;
      Vector6 by_z;
      by_z << -flow * ub, flow * ua, 0, 0, 0, 0;
      by_z += flow * (eta(1) * a - eta(0) * b);
      damping_root.noalias() -= flow * (a * a.transpose());
      damping_root.noalias() -= flow * (b * b.transpose());
      work->row.noalias() = water_density * hessian(m.volume).lazyProduct(s_dot);
      root_by_rate.noalias() -= by_flow.lazyProduct(work->water_gradient.transpose());
      root_by_shape.noalias() -= by_flow.lazyProduct(work->row.transpose());
      root_by_shape.noalias() -= by_z.lazyProduct(m.lip_z_row.transpose());
    }
  }
  if (effects.jet_thrust) {
    if (m.flux < 0) {
      work->column = work->thrust_by_flux * gradient(m.volume);
      work->row.noalias() = work->thrust_by_flux * hessian(m.volume).lazyProduct(s_dot);
    } else {
      work->column = work->thrust_by_flux * work->values.value.segment(m.flux, k);
      work->row.noalias() =
          work->thrust_by_flux * work->values.gradient.middleCols(m.flux, k).lazyProduct(s_dot);
    }
    damping.noalias() -= m.thrust.lazyProduct(work->column.transpose());
    stiffness.noalias() -= m.thrust.lazyProduct(work->row.transpose());
    root_by_rate.row(5) -= work->column.transpose();
    root_by_shape.row(5) -= work->row.transpose();
  }
  if (effects.drag && work->axial_speed_m_s != 0.0) {  // quadratic in speed and in radius
    const double by_speed = 2.0 * work->drag_n / work->axial_speed_m_s;
    const double by_radius = 2.0 * work->drag_n / work->max_radius_m;
    damping.noalias() -= by_speed * m.mean_axial.lazyProduct(m.mean_axial.transpose());
    shape_by_root.col(5) -= by_speed * m.mean_axial;
    root_by_rate.row(5) -= by_speed * m.mean_axial.transpose();
    damping_root(5, 5) -= by_speed;
    const auto widest = m.radius_rows.row(work->widest);
    stiffness.noalias() -= by_radius * m.mean_axial.lazyProduct(widest);
    root_by_shape.row(5) -= by_radius * widest;
  }
  for (std::size_t c = 0; c < m.spokes.size(); ++c) {
    const model::CableInput& in = motion.spokes[c];
    if (!in.reeled || work->cable_tension_n[c] == 0.0) continue;
    const VectorX& g = m.spokes[c].gradient;
    stiffness.noalias() += in.stiffness_n_m * g.lazyProduct(g.transpose());
    damping.noalias() += in.damping_n_s_m * g.lazyProduct(g.transpose());
  }
  if (m.wall >= 0) {
    stiffness.noalias() -=
        motion.normal_pressure_pa * work->values.gradient.middleCols(m.wall, k).transpose();
  }
  if (effects.lateral_drag) {
    const double c = rho * effects.lateral_drag->coefficient;
    Matrix6 by_twist = Matrix6::Zero();
    for (const LateralSlice& slice : m.slices) {
      const double radius = slice.r + slice.r_row.dot(s);
      const double height = slice.height + slice.height_row.dot(s);
      const double sign = height < 0.0 ? -1.0 : 1.0;
      Vector6 by_z = Vector6::Zero(), by_k = Vector6::Zero();
      model::AddLateralDragSliceTangent(c * radius * sign * height, slice.z + slice.z_row.dot(s),
                                        eta, &by_twist, &by_z, &by_k);
      work->row = (c * sign) * (height * slice.r_row + radius * slice.height_row);
      root_by_shape.noalias() -= by_z.lazyProduct(slice.z_row.transpose());
      root_by_shape.noalias() -= by_k.lazyProduct(work->row.transpose());
    }
    damping_root -= by_twist;
  }
  if (plant.has_gravity()) {
    const Vector3 g = SurfaceWeight(plant, motion.gravity_m_s2);
    if (g.isZero(0.0)) return;
    // R^T g turns by (R^T g) x zeta when the root turns by zeta
    const Matrix3 turn = model::Hat(g);
    const double moment = m.axial_moment + m.axial_area.dot(s);
    auto by_rotation = out->stiffness.topLeftCorner<6, 3>();
    by_rotation.row(0) += moment * turn.row(1);
    by_rotation.row(1) -= moment * turn.row(0);
    by_rotation.bottomRows<3>() -= plant.shell->area_m2 * turn;
    out->stiffness.block(first, 0, k, 3).noalias() -= m.axial_area.lazyProduct(turn.row(2));
    root_by_shape.row(0) += g.y() * m.axial_area.transpose();
    root_by_shape.row(1) -= g.x() * m.axial_area.transpose();
  }
}

}  // namespace mantle::reduced
