#include "model/newton_matrix.h"

#include <cmath>
#include <numbers>

#include "model/mantle_loads.h"

namespace mantle::model {

NewtonMatrix::NewtonMatrix(const Plant& plant) {
  const auto size_border = [](Border* b, int n, int base, int p) {
    b->column.setZero(n, p);
    b->row.setZero(n, p);
    b->base_column.setZero(base, p);
    b->base_row.setZero(base, p);
    b->solved.setZero(n, p);
    b->schur_inverse.setZero(p, p);
    b->t.setZero(p, base);
    b->q.setZero(base, p);
    b->schur.setIdentity(p, p);
    b->scaled.setZero(p, base);
    if (p > 0) b->lu.compute(b->schur);
    b->u.setZero(p);
    b->reduced.setZero(p);
    b->active = p;
  };
  for (int a = 0; a < static_cast<int>(plant.rods.size()); ++a) {
    const Rod& rod = plant.rods[a];
    const int blocks = rod.element_count() + 1;
    ArmPart part;
    part.chain = BlockTridiagonal<6>(blocks);
    for (std::size_t c = 0; c < rod.cables.size(); ++c) part.cables.push_back(static_cast<int>(c));
    const int p = static_cast<int>(part.cables.size());
    size_border(&part.border, 6 * blocks, 6, p);
    part.response.setZero(p > 0 ? 6 * blocks : 0, 6);
    part.rhs.setZero(6 * blocks);
    part.adjoint = Adjoint(Inverse(rod.mount));
    arms_.push_back(std::move(part));
  }
  if (!plant.shell) return;
  const int n = plant.shell->node_count();
  const int p = 2 + static_cast<int>(plant.shell->spokes.size());  // thrust, drag, spokes
  shell_.chain = BlockTridiagonal<3>(n);
  size_border(&shell_.border, 3 * n, 1, p);
  shell_.coupling.setZero(3 * n);
  shell_.response.setZero(3 * n);
  shell_.rhs.setZero(3 * n);
}

bool NewtonMatrix::Border::FactorSchur() {
  schur.setIdentity();
  schur.noalias() -= row.transpose() * solved;
  lu.compute(schur);
  schur.setIdentity();
  schur_inverse.noalias() = lu.solve(schur);  // not in place: that would allocate
  scaled.noalias() = schur_inverse * t;
  return schur_inverse.allFinite();
}

void NewtonMatrix::AssembleArm(const Plant& plant, int a, const PlantState& state,
                               const PlantInputs& inputs, const PlantWork& work, double s,
                               double chart) {
  const Rod& rod = plant.rods[a];
  ArmPart& part = arms_[a];
  BlockTridiagonal<6>& chain = part.chain;
  const std::vector<Vector6>& twist = work.twist[a];
  const Pose* pose = &state.pose[plant.ArmPose(a, 0)];
  const int n = rod.element_count();
  for (auto& d : chain.diagonal) d.setZero();
  part.border.column.setZero();
  part.border.row.setZero();

  RodElementTangent t;
  for (int i = 0; i < n; ++i) {
    const RodElementState& e = work.rod[a][i];
    Vector6 sigma = RodStress(rod.elements[i], e);
    Matrix6 cable_tangent = Matrix6::Zero();
    bool pulled = false;
    for (std::size_t c = 0; c < rod.cables.size(); ++c) {
      if (i >= static_cast<int>(rod.cables[c].pieces.size())) continue;
      const CableInput& in = inputs.cables[plant.ArmCableIndex(a, static_cast<int>(c))];
      const double u = work.cable_tension_n[plant.ArmCableIndex(a, static_cast<int>(c))];
      if (u == 0.0) continue;
      Vector6 gradient;
      Matrix6 hessian;
      CablePieceLength(rod.cables[c].pieces[i], rod.elements[i], e.d, &gradient, &hessian);
      sigma += u * gradient;
      cable_tangent += u * hessian;
      pulled = true;
      if (!in.reeled) continue;
      // dl = gradient . (Jr^-1 zeta2 - Jl^-1 zeta1): column of force -u dl/dq, row -(k + s d) dl/dq
      Vector6 g1 = Vector6::Zero(), g2 = Vector6::Zero();
      AddRodElementForces(e, gradient, &g1, &g2);  // forces are minus the gradient
      const int k = static_cast<int>(c);
      part.border.column.col(k).segment<6>(6 * i) -= g1;
      part.border.column.col(k).segment<6>(6 * (i + 1)) -= g2;
    }
    RodElementTangents(rod.elements[i], e, twist[i], twist[i + 1], sigma,
                       pulled ? &cable_tangent : nullptr, s, &t);
    chain.diagonal[i] += t.a11;
    chain.diagonal[i + 1] += t.a22;
    chain.upper[i] = t.a12;
    chain.lower[i] = t.a21;
  }
  for (std::size_t c = 0; c < rod.cables.size(); ++c) {
    const CableInput& in = inputs.cables[plant.ArmCableIndex(a, static_cast<int>(c))];
    if (!in.reeled) continue;
    const int k = static_cast<int>(c);
    part.border.row.col(k) = -(in.stiffness_n_m + s * in.damping_n_s_m) * part.border.column.col(k);
  }

  int first_point = 0;
  for (int b = 0; b < a; ++b) first_point += static_cast<int>(plant.rods[b].points.size());
  int first_distributed = 0;
  for (int b = 0; b < a; ++b)
    first_distributed += static_cast<int>(plant.rods[b].distributed.size());
  for (int i = 0; i <= n; ++i) {
    Matrix6& d = chain.diagonal[i];
    const Vector6& eta = twist[i];
    if (s > 0.0 && i > 0) {
      const Vector6 m = rod.nodes[i].FullInertia();
      const Matrix6 ad = SmallAdjoint(eta);
      d.diagonal() += s * s * m;
      d += (chart * s) * (m.asDiagonal() * ad);
      d -= s * (ad.transpose() * m.asDiagonal());
      d -= s * CoadjointMatrix(m.cwiseProduct(eta));
    }
    SectionMotion motion{pose[i].rotation, eta};
    if (!plant.exact()) {
      motion.rotation = state.pose[0].rotation * pose[i].rotation;
      motion.twist += AdjointInverseTimes(pose[i], state.velocity.head<6>());
    }
    LoadTangent lt;
    for (const SectionLoad& load : rod.loads) {
      LoadTangent one;
      std::visit([&](const auto& l) { l.AddTangent(rod.nodes[i].section, motion, &one); }, load);
      const double scale = rod.nodes[i].weight_m *
                           (std::holds_alternative<GravityLoad>(load) ? inputs.gravity_scale : 1.0);
      lt.force_by_rotation += scale * one.force_by_rotation;
      lt.moment_by_rotation += scale * one.moment_by_rotation;
      lt.force_by_velocity += scale * one.force_by_velocity;
    }
    for (std::size_t k = 0; k < rod.distributed.size(); ++k) {
      if (rod.distributed[k].load.frame == LoadFrame::kBody) continue;
      LoadTangent one;
      rod.distributed[k].load.AddTangent(rod.nodes[i].section, motion, &one);
      const double scale = rod.nodes[i].weight_m * inputs.distributed[first_distributed + k];
      lt.force_by_rotation += scale * one.force_by_rotation;
      lt.moment_by_rotation += scale * one.moment_by_rotation;
    }
    for (std::size_t k = 0; k < rod.points.size(); ++k) {
      if (rod.points[k].node != i || rod.points[k].load.frame == LoadFrame::kBody) continue;
      const Vector6 w = WrenchInSection(inputs.points[first_point + k] * rod.points[k].load.wrench,
                                        LoadFrame::kWorld, motion.rotation);
      lt.moment_by_rotation += Hat(w.head<3>());
      lt.force_by_rotation += Hat(w.tail<3>());
    }
    d.topLeftCorner<3, 3>() -= lt.moment_by_rotation;
    d.bottomLeftCorner<3, 3>() -= lt.force_by_rotation;
    d.bottomRightCorner<3, 3>() -= s * lt.force_by_velocity;
  }
}

bool NewtonMatrix::FactorArm(const Plant& plant, int a) {
  ArmPart& part = arms_[a];
  if (!part.chain.Factor(1)) return false;
  const int p = static_cast<int>(part.cables.size());
  Border& b = part.border;
  bool any = false;
  for (int k = 0; k < p; ++k) any = any || !b.row.col(k).isZero(0.0);
  b.active = any ? p : 0;
  const bool coupled = plant.exact() && plant.root_free();
  Matrix6 base = part.chain.diagonal[0];
  if (b.active > 0) {
    b.solved = b.column;
    for (int k = 0; k < p; ++k) {
      b.solved.col(k).head<6>().setZero();
      part.chain.Eliminate(1, b.solved.col(k));
      // block 0 now holds -A_01 (...): what the chain's part of the column does to the base
      b.q.col(k) = b.column.col(k).head<6>() + b.solved.col(k).head<6>();
      b.solved.col(k).head<6>().setZero();
      part.chain.Substitute(1, b.solved.col(k));
    }
    for (int k = 0; k < 6; ++k) {
      part.response.col(k).setZero();
      part.response(k, k) = 1.0;
      part.chain.Substitute(1, part.response.col(k));
    }
    b.t.noalias() = b.row.transpose() * part.response;  // base's own entries included: row 0 x I
    if (!b.FactorSchur()) return false;
    base.noalias() -= b.q * b.scaled;
  }
  if (coupled) root_.noalias() += part.adjoint.transpose() * base * part.adjoint;
  return true;
}

void NewtonMatrix::AssembleShell(const Plant& plant, const PlantState& state,
                                 const PlantInputs& inputs, const PlantWork& work, double s) {
  const Shell& shell = *plant.shell;
  const Effects& effects = plant.robot.effects;
  const int n = shell.element_count();
  BlockTridiagonal<3>& chain = shell_.chain;
  for (auto& d : chain.diagonal) d.setZero();
  ShellElementTangent t;
  for (int i = 0; i < n; ++i) {
    ShellElementTangents(shell.elements[i], shell.material, work.shell[i], s, &t);
    chain.diagonal[i] += t.a11;
    chain.diagonal[i + 1] += t.a22;
    chain.upper[i] = t.a12;
    chain.lower[i] = t.a21;
  }
  for (int j = 0; j <= n; ++j) chain.diagonal[j].diagonal() += s * s * shell.nodes[j].inertia;

  if (effects.normal_pressure) {  // derivative of the swept-volume gradient
    const double p = inputs.normal_pressure_pa;
    const double third = std::numbers::pi / 3.0;
    const std::vector<Vector3>& q = state.shape;
    for (int i = 0; i < n; ++i) {
      const double a = q[i](0), b = q[i + 1](0), dz = q[i + 1](1) - q[i](1);
      chain.diagonal[i](0, 0) += p * third * 2.0 * dz;
      chain.diagonal[i + 1](0, 0) += p * third * 2.0 * dz;
      chain.upper[i](0, 0) += p * third * dz;
      chain.lower[i](0, 0) += p * third * dz;
      const double by_a = p * third * (2.0 * a + b), by_b = p * third * (a + 2.0 * b);
      chain.diagonal[i](0, 1) -= by_a;
      chain.diagonal[i](1, 0) -= by_a;
      chain.upper[i](0, 1) += by_a;
      chain.lower[i](1, 0) += by_a;
      chain.lower[i](0, 1) -= by_b;
      chain.upper[i](1, 0) -= by_b;
      chain.diagonal[i + 1](0, 1) += by_b;
      chain.diagonal[i + 1](1, 0) += by_b;
    }
    const double two_pi = 2.0 * std::numbers::pi * p;
    chain.diagonal[0](1, 0) += two_pi * q.front()(0);
    chain.diagonal[n](1, 0) -= two_pi * q.back()(0);
  }

  Border& b = shell_.border;
  b.column.setZero();
  b.row.setZero();
  b.base_column.setZero();
  b.base_row.setZero();
  const double rho = plant.robot.water.density_kg_m3;
  if (effects.jet_thrust && s > 0.0) {
    const double c = EvaluateJet(*plant.robot.mantle, rho, work.flux_m3_s).thrust_by_flux;
    const bool volume = effects.jet_thrust->flux == FluxReading::kVolume;
    for (int j = 0; j <= n; ++j) {
      b.column(3 * j + 1, 0) = -shell.thrust_share[j];
      b.row(3 * j, 0) = -c * s * work.volume_gradient[j](0);
      if (volume) b.row(3 * j + 1, 0) = -c * s * work.volume_gradient[j](1);
    }
    b.base_column(0, 0) = -1.0;
  }
  if (effects.drag && s > 0.0) {
    const double r = work.max_radius_m;
    const double d = -rho * plant.robot.mantle->drag_coefficient * std::numbers::pi * r * r *
                     std::abs(work.mean_axial_speed_m_s);
    for (int j = 0; j <= n; ++j) {
      const double share = shell.nodes[j].area_m2 / shell.area_m2;
      b.column(3 * j + 1, 1) = -share;
      b.row(3 * j + 1, 1) = -d * s * share;
    }
    b.base_column(0, 1) = -1.0;
    b.base_row(0, 1) = -d * s;
  }
  for (std::size_t k = 0; k < shell.spokes.size(); ++k) {
    const int index = plant.SpokeIndex(static_cast<int>(k));
    const CableInput& in = inputs.cables[index];
    if (!in.reeled || work.cable_tension_n[index] == 0.0) continue;
    const ShellSpokes& spokes = shell.spokes[k];
    for (int j = 0; j <= n; ++j) {
      const double g = spokes.spokes * spokes.strip.area_m2[j] / spokes.strip.total_m2;
      b.column(3 * j, 2 + static_cast<int>(k)) = g;
      b.row(3 * j, 2 + static_cast<int>(k)) = -(in.stiffness_n_m + s * in.damping_n_s_m) * g;
    }
  }
  shell_.coupling.setZero();
  if (plant.exact() && plant.root_free()) {
    for (int j = 0; j <= n; ++j) shell_.coupling(3 * j + 1) = s * s * shell.nodes[j].inertia(1);
  }

  for (int j : {0, n}) {  // held coordinates: identity rows and columns
    for (int k = 0; k < 3; ++k) {
      if (shell.nodes[j].held(k) == 0.0) continue;
      chain.diagonal[j].row(k).setZero();
      chain.diagonal[j].col(k).setZero();
      chain.diagonal[j](k, k) = 1.0;
      if (j == 0) {
        chain.upper[0].row(k).setZero();
        chain.lower[0].col(k).setZero();
      } else {
        chain.lower[n - 1].row(k).setZero();
        chain.upper[n - 1].col(k).setZero();
      }
      b.column.row(3 * j + k).setZero();
      b.row.row(3 * j + k).setZero();
      shell_.coupling(3 * j + k) = 0.0;
    }
  }
}

bool NewtonMatrix::FactorShell(const Plant&) {
  if (!shell_.chain.Factor(0)) return false;
  Border& b = shell_.border;
  const int p = static_cast<int>(b.column.cols());
  b.solved = b.column;
  for (int k = 0; k < p; ++k) {
    shell_.chain.Eliminate(0, b.solved.col(k));
    shell_.chain.Substitute(0, b.solved.col(k));
  }
  // Base unknown: the root's axial increment x0; chain: x = y - Z u - response x0
  shell_.response = shell_.coupling;
  shell_.chain.Eliminate(0, shell_.response);
  shell_.chain.Substitute(0, shell_.response);
  b.t = b.base_row.transpose();
  b.t.noalias() -= b.row.transpose() * shell_.response;
  b.q = b.base_column;
  b.q.noalias() -= shell_.coupling.transpose() * b.solved;
  if (!b.FactorSchur()) return false;
  shell_.coupling_pivot =
      -shell_.coupling.dot(shell_.response) - b.q.row(0).dot(b.scaled.col(0));
  root_(5, 5) += shell_.coupling_pivot;
  return true;
}

bool NewtonMatrix::Factor(const Plant& plant, const PlantState& state, const PlantInputs& inputs,
                          const PlantWork& work, double s, double chart) {
  const Vector6 eta = state.velocity.head<6>();
  root_ = (s * s) * work.root_mass;
  if (s > 0.0) {
    const Matrix6 ad = SmallAdjoint(eta);
    root_ += (chart * s) * work.root_mass * ad;
    root_ -= s * (ad.transpose() * work.root_mass + CoadjointMatrix(work.root_mass * eta));
  }
  if (plant.buoyant_mass_kg != 0.0) {
    const Vector3 f = inputs.gravity_scale * plant.buoyant_mass_kg *
                      (state.pose[0].rotation.conjugate() * plant.robot.effects.gravity_m_s2);
    root_.topLeftCorner<3, 3>() -= Hat(plant.buoyant_centre_m) * Hat(f);
    root_.bottomLeftCorner<3, 3>() -= Hat(f);
  }
  for (int a = 0; a < static_cast<int>(arms_.size()); ++a) {
    AssembleArm(plant, a, state, inputs, work, s, chart);
    if (!FactorArm(plant, a)) return false;
  }
  if (plant.shell) {
    AssembleShell(plant, state, inputs, work, s);
    if (!FactorShell(plant)) return false;
  }
  if (!plant.root_free()) return true;
  root_inverse_ = root_.inverse();
  return root_inverse_.allFinite();
}

void NewtonMatrix::Solve(const Plant& plant, VectorX* x) {
  const bool root_free = plant.root_free();
  const bool coupled = plant.exact() && root_free;
  Vector6 root = x->head<6>();
  for (int a = 0; a < static_cast<int>(arms_.size()); ++a) {
    ArmPart& part = arms_[a];
    const int n = 6 * (part.chain.size() - 1);
    part.rhs.head<6>().setZero();
    part.rhs.tail(n) = x->segment(plant.ArmVelocity(a, 1), n);
    part.chain.Eliminate(1, part.rhs);
    Vector6 base = part.rhs.head<6>();
    if (part.border.active > 0) {
      Border& b = part.border;
      part.rhs.head<6>().setZero();
      part.chain.Substitute(1, part.rhs);  // y, with x0 = 0
      b.reduced.noalias() = b.row.transpose() * part.rhs;
      b.reduced = -b.reduced;
      b.u.noalias() = b.schur_inverse * b.reduced;
      base.noalias() -= b.q * b.u;
    }
    if (coupled) root.noalias() += part.adjoint.transpose() * base;
  }
  if (plant.shell) {
    Border& b = shell_.border;
    shell_.rhs = x->tail(shell_.rhs.size());
    for (int j : {0, plant.shell->element_count()}) {
      shell_.rhs.segment<3>(3 * j).array() *= 1.0 - plant.shell->nodes[j].held.array();
    }
    shell_.chain.Eliminate(0, shell_.rhs);
    shell_.chain.Substitute(0, shell_.rhs);
    b.reduced.noalias() = b.row.transpose() * shell_.rhs;
    b.reduced = -b.reduced;
    b.u.noalias() = b.schur_inverse * b.reduced;
    root(5) -= shell_.coupling.dot(shell_.rhs) + b.q.row(0).dot(b.u);
  }
  if (root_free) {
    x->head<6>().noalias() = root_inverse_ * root;
  } else {
    x->head<6>().setZero();
  }
  const Vector6 root_x = x->head<6>();
  for (int a = 0; a < static_cast<int>(arms_.size()); ++a) {
    ArmPart& part = arms_[a];
    const int n = 6 * (part.chain.size() - 1);
    Vector6 x0 = Vector6::Zero();
    if (coupled) x0 = part.adjoint * root_x;
    if (part.border.active > 0) {
      Border& b = part.border;
      b.reduced.noalias() -= b.t * x0;
      b.u.noalias() = b.schur_inverse * b.reduced;
      part.rhs.noalias() -= b.solved * b.u;
      part.rhs.noalias() += part.response * x0;
    } else {
      part.rhs.head<6>() = x0;
      part.chain.Substitute(1, part.rhs);
    }
    x->segment(plant.ArmVelocity(a, 1), n) = part.rhs.tail(n);
  }
  if (plant.shell) {
    Border& b = shell_.border;
    b.reduced.noalias() -= b.t.col(0) * root_x(5);
    b.u.noalias() = b.schur_inverse * b.reduced;
    shell_.rhs.noalias() -= b.solved * b.u;
    shell_.rhs.noalias() -= shell_.response * root_x(5);
    x->tail(shell_.rhs.size()) = shell_.rhs;
  }
}

int NewtonMatrix::DeterminantSign(const Plant& plant) const {
  int sign = 1;
  for (const ArmPart& part : arms_) sign *= part.chain.DeterminantSign(1);
  if (plant.shell) sign *= shell_.chain.DeterminantSign(0);
  return sign;
}

}  // namespace mantle::model
