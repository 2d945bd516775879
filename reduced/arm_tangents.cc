#include "reduced/arm_dynamics.h"

namespace mantle::reduced {
namespace {

using model::CoadjointMatrix;
using model::SmallAdjointTimes;

// a Hat(w), column by column.
Matrix3 TimesHat(const Matrix3& a, const Vector3& w) {
  Matrix3 m;
  m.col(0) = a.col(1) * w.z() - a.col(2) * w.y();
  m.col(1) = a.col(2) * w.x() - a.col(0) * w.z();
  m.col(2) = a.col(0) * w.y() - a.col(1) * w.x();
  return m;
}
Matrix3 HatTimes(const Vector3& w, const Matrix3& a) {
  Matrix3 m;
  for (int i = 0; i < 3; ++i) m.col(i) = w.cross(a.col(i));
  return m;
}

// Composite matrices of all sections beyond an interval: coefficients of S'' (and of S' in D), S',
// S in the change of W.
struct Composite {
  Matrix6 inertia{Matrix6::Zero()}, rate{Matrix6::Zero()}, rotation{Matrix6::Zero()};
};

// Adds [p~ q p~^T, p~ q; q p~^T, q]: a 3x3 form on the linear velocity at p, seen at the origin.
template <typename Add>
void AddLinearForm(const Matrix3& q, const Vector3& p, Add add) {
  const Matrix3 right = -TimesHat(q, p);
  add(HatTimes(p, right), HatTimes(p, q), right, q);
}

void AddRotationForm(const Matrix3& moment, const Matrix3& force, const Matrix3& r,
                     const Vector3& p, double scale, Matrix6* m) {
  const Matrix3 f = scale * (r * force * r.transpose());
  m->bottomLeftCorner<3, 3>() += f;
  m->topLeftCorner<3, 3>() += scale * (r * moment * r.transpose()) + HatTimes(p, f);
}

void AddSection(const ReducedArm& arm, const ArmMotion& m, const model::RodNode& node,
                const Matrix3& r, const Vector3& p, const Vector6& twist, Composite* out) {
  const Vector6 diagonal = node.FullInertia();
  Matrix6 inertia;
  const Matrix3 linear = r * diagonal.tail<3>().asDiagonal() * r.transpose();
  AddLinearForm(linear, p, [&](const auto& aa, const auto& ab, const auto& ba, const auto& bb) {
    inertia << aa, ab, ba, bb;
  });
  inertia.topLeftCorner<3, 3>() += r * diagonal.head<3>().asDiagonal() * r.transpose();
  out->inertia += inertia;

  // -N(I V) - ad_V^T I - I ad_V
  Matrix6 product;  // I ad_V
  const Vector3 w = twist.head<3>(), v = twist.tail<3>();
  product.topRightCorner<3, 3>() = TimesHat(inertia.topRightCorner<3, 3>(), w);
  product.bottomRightCorner<3, 3>() = TimesHat(inertia.bottomRightCorner<3, 3>(), w);
  product.topLeftCorner<3, 3>() =
      TimesHat(inertia.topLeftCorner<3, 3>(), w) + TimesHat(inertia.topRightCorner<3, 3>(), v);
  product.bottomLeftCorner<3, 3>() = TimesHat(inertia.bottomLeftCorner<3, 3>(), w) +
                                     TimesHat(inertia.bottomRightCorner<3, 3>(), v);
  out->rate -= product;
  out->rate -= product.transpose();
  out->rate -= CoadjointMatrix(inertia * twist);

  if (arm.loads.empty() && !arm.needs_rotation) return;
  Vector6 eta;
  eta.head<3>().noalias() = r.transpose() * w;
  eta.tail<3>().noalias() = r.transpose() * (v - p.cross(w));
  const model::SectionMotion motion{
      arm.needs_rotation ? m.root_rotation * Eigen::Quaterniond(r) : Eigen::Quaterniond::Identity(),
      eta};
  model::LoadTangent t;
  for (const model::SectionLoad& load : arm.loads) {
    if (std::holds_alternative<model::GravityLoad>(load)) {
      model::LoadTangent one;
      std::visit([&](const auto& l) { l.AddTangent(node.section, motion, &one); }, load);
      t.force_by_rotation += m.gravity_scale * one.force_by_rotation;
    } else {
      std::visit([&](const auto& l) { l.AddTangent(node.section, motion, &t); }, load);
    }
  }
  for (std::size_t k = 0; k < arm.distributed.size(); ++k) {
    if (m.distributed[k] == 0.0 || arm.distributed[k].frame == model::LoadFrame::kBody) continue;
    model::LoadTangent one;
    arm.distributed[k].AddTangent(node.section, motion, &one);
    t.force_by_rotation += m.distributed[k] * one.force_by_rotation;
    t.moment_by_rotation += m.distributed[k] * one.moment_by_rotation;
  }
  const Matrix3 drag = -node.weight_m * (r * t.force_by_velocity * r.transpose());
  AddLinearForm(drag, p, [&](const auto& aa, const auto& ab, const auto& ba, const auto& bb) {
    out->rate.topLeftCorner<3, 3>() += aa;
    out->rate.topRightCorner<3, 3>() += ab;
    out->rate.bottomLeftCorner<3, 3>() += ba;
    out->rate.bottomRightCorner<3, 3>() += bb;
  });
  if (arm.needs_rotation) {
    AddRotationForm(t.moment_by_rotation, t.force_by_rotation, r, p, -node.weight_m,
                    &out->rotation);
  }
}

void AddPoint(const ArmMotion& m, const ReducedPoint& point, double amplitude, const Matrix3& r,
              const Vector3& p, Composite* out) {
  if (amplitude == 0.0 || point.load->frame == model::LoadFrame::kBody) return;
  const Vector6 w = WrenchInSection(amplitude * point.load->wrench, point.load->frame,
                                    m.root_rotation * Eigen::Quaterniond(r));
  AddRotationForm(model::Hat(w.head<3>()), model::Hat(w.tail<3>()), r, p, -1.0, &out->rotation);
}

void ColumnsToRoot(const Matrix3& r, const Vector3& p, const Matrix6X& x, Matrix6X* y) {
  for (int i = 0; i < x.cols(); ++i) {
    const Vector3 a = r * x.col(i).head<3>();
    y->col(i).head<3>() = a;
    y->col(i).tail<3>().noalias() = r * x.col(i).tail<3>();
    y->col(i).tail<3>() += p.cross(a);
  }
}

void ApplyBlocks(const TangentBlocks& t, const Matrix6X& x, Matrix6X* y) {
  for (int i = 0; i < x.cols(); ++i) y->col(i) = t.Times(x.col(i));
}
void AddBlocks(double scale, const TangentBlocks& t, const Matrix6X& x, Matrix6X* y) {
  for (int i = 0; i < x.cols(); ++i) y->col(i) += scale * t.Times(x.col(i));
}

// d xi1^ B2 - d xi2^ B1, the strain-dependent part of dOmega/dq for strains (a, b).
void AddMagnus(const Interval& v, const Vector6& a, const Vector6& b, Matrix6X* e) {
  for (int i = 0; i < e->cols(); ++i) {
    e->col(i) +=
        v.kappa * (SmallAdjointTimes(a, v.basis2.col(i)) - SmallAdjointTimes(b, v.basis1.col(i)));
  }
}

// S, S', S'' of one interval; leaves dOmega/dq in work->e.
void MakeColumns(const Interval& v, const StrainGroup& group, const ArmMotion& m, ArmWork* work,
                 IntervalState* s) {
  EvaluateSecondTangent(s->coefficients, s->omega, s->omega_dot, s->omega_ddot, &s->jet);
  work->e = v.basis;
  if (v.magnus) {
    const Eigen::Map<const VectorX> q(m.q + group.first, group.columns);
    const Eigen::Map<const VectorX> q1(m.q_dot + group.first, group.columns);
    const Eigen::Map<const VectorX> q2(m.q_ddot + group.first, group.columns);
    AddMagnus(v, v.rest1 + v.basis1 * q, v.rest2 + v.basis2 * q, &work->e);
    work->e1.setZero();
    work->e2.setZero();
    AddMagnus(v, v.basis1 * q1, v.basis2 * q1, &work->e1);
    AddMagnus(v, v.basis1 * q2, v.basis2 * q2, &work->e2);
  }
  ApplyBlocks(s->jet.value, work->e, &work->tau);
  ApplyBlocks(s->jet.rate, work->e, &work->tau1);
  ApplyBlocks(s->jet.second, work->e, &work->tau2);
  if (v.magnus) {
    AddBlocks(1.0, s->jet.value, work->e1, &work->tau1);
    AddBlocks(2.0, s->jet.rate, work->e1, &work->tau2);
    AddBlocks(1.0, s->jet.value, work->e2, &work->tau2);
  }
  ColumnsToRoot(s->rotation, s->position, work->tau, &s->columns);
  ColumnsToRoot(s->rotation, s->position, work->tau1, &s->columns1);
  ColumnsToRoot(s->rotation, s->position, work->tau2, &s->columns2);
  for (int i = 0; i < s->columns.cols(); ++i) {
    const Vector6 column = s->columns.col(i);
    const Vector6 turned = SmallAdjointTimes(s->twist, column);
    s->columns2.col(i) += SmallAdjointTimes(s->twist, 2.0 * s->columns1.col(i) + turned) +
                          SmallAdjointTimes(s->acceleration, column);
    s->columns1.col(i) += turned;
  }
}

// The local second derivative of the kinematics times the stress.
void AddLocalStiffness(const Interval& v, const StrainGroup& group, const ArmMotion& m,
                       const IntervalState& s, ArmWork* work,
                       Eigen::Ref<Eigen::MatrixXd> stiffness) {
  const Matrix6 g = TangentTransposeDerivative(s.coefficients, s.omega, s.body_wrench);
  if (v.magnus) {
    const Eigen::Map<const VectorX> q(m.q + group.first, group.columns);
    work->e = v.basis;
    AddMagnus(v, v.rest1 + v.basis1 * q, v.rest2 + v.basis2 * q, &work->e);
    const Matrix6 n = v.kappa * CoadjointMatrix(s.stress);
    work->fk.noalias() = n.lazyProduct(v.basis1);
    stiffness.noalias() += v.basis2.transpose().lazyProduct(work->fk);
    work->fk.noalias() = n.lazyProduct(v.basis2);
    stiffness.noalias() -= v.basis1.transpose().lazyProduct(work->fk);
    work->fk.noalias() = g.lazyProduct(work->e);
    stiffness.noalias() += work->e.transpose().lazyProduct(work->fk);
    return;
  }
  work->fk.noalias() = g.lazyProduct(v.basis);
  stiffness.noalias() += v.basis.transpose().lazyProduct(work->fk);
}

void AddCables(const ReducedArm& arm, const ArmMotion& m, int first, ArmWork* work,
               Linearisation* out) {
  const int n = arm.size();
  for (std::size_t c = 0; c < arm.cables.size(); ++c) {
    const double u = work->cable_tension_n[c];
    if (u == 0.0) continue;
    for (const CablePoint& p : arm.cables[c].points) {
      const StrainGroup& group = arm.basis.groups()[p.group];
      const Eigen::Map<const VectorX> q(m.q + group.first, group.columns);
      Matrix6 hessian;
      CablePieceLength(p.piece, p.element, p.reference + p.basis.lazyProduct(q), nullptr, &hessian);
      work->fk.noalias() = (u * hessian).lazyProduct(p.basis);
      out->stiffness.block(first + group.first, first + group.first, group.columns, group.columns)
          .noalias() += p.basis.transpose().lazyProduct(work->fk);
    }
    const model::CableInput& in = m.cables[c];
    if (!in.reeled) continue;
    const VectorX& gradient = work->cable_gradient[c];
    out->stiffness.block(first, first, n, n).noalias() +=
        in.stiffness_n_m * gradient.lazyProduct(gradient.transpose());
    out->damping.block(first, first, n, n).noalias() +=
        in.damping_n_s_m * gradient.lazyProduct(gradient.transpose());
    // the rate's dependence on the shape: d (dl/dq . q_dot)/dq
    if (in.damping_n_s_m == 0.0) continue;
    for (const CablePoint& p : arm.cables[c].points) {
      const StrainGroup& group = arm.basis.groups()[p.group];
      const Eigen::Map<const VectorX> q(m.q + group.first, group.columns);
      const Eigen::Map<const VectorX> q1(m.q_dot + group.first, group.columns);
      Matrix6 hessian;
      CablePieceLength(p.piece, p.element, p.reference + p.basis.lazyProduct(q), nullptr, &hessian);
      const Vector6 turned = in.damping_n_s_m * (hessian * (p.basis * q1));
      for (int j = 0; j < group.columns; ++j) {
        out->stiffness.col(first + group.first + j).segment(first, n) +=
            turned.dot(p.basis.col(j)) * gradient;
      }
    }
  }
}

}  // namespace

void LineariseArm(const ReducedArm& arm, const ArmMotion& m, int first, ArmWork* work,
                  Linearisation* out) {
  const int n = arm.size();
  const auto& groups = arm.basis.groups();
  out->stiffness.block(first, first, n, n) += arm.stiffness;
  if (arm.viscous) out->damping.block(first, first, n, n) += arm.damping;
  for (Matrix6X* x : {&work->sum_columns, &work->sum_columns1, &work->sum_columns2}) x->setZero();
  for (int l = 0; l < arm.dynamic_intervals; ++l) {
    const Interval& v = arm.intervals[l];
    const StrainGroup& group = groups[v.group];
    IntervalState& s = work->at[l];
    MakeColumns(v, group, m, work, &s);
    work->sum_columns.middleCols(group.first, group.columns) += s.columns;
    work->sum_columns1.middleCols(group.first, group.columns) += s.columns1;
    work->sum_columns2.middleCols(group.first, group.columns) += s.columns2;
  }

  Composite total;
  const Matrix6 root_ad = model::SmallAdjoint(m.root_twist);
  for (int l = arm.dynamic_intervals - 1; l >= 0; --l) {
    const Interval& v = arm.intervals[l];
    const StrainGroup& group = groups[v.group];
    const int c = group.columns, f = first + group.first;
    const IntervalState& s = work->at[l];
    if (v.section >= 0) {
      AddSection(arm, m, arm.sections[v.section], s.rotation, s.position, s.twist, &total);
    }
    for (std::size_t k = 0; k < arm.points.size(); ++k) {
      if (arm.points[k].interval == l) {
        AddPoint(m, arm.points[k], m.points[k], s.rotation, s.position, &total);
      }
    }
    const bool last_of_group =
        l + 1 == arm.dynamic_intervals || arm.intervals[l + 1].group != v.group;
    if (last_of_group) {
      for (Matrix6X* x : {&work->sum_m, &work->sum_d, &work->sum_k, &work->row_y, &work->row_z}) {
        x->setZero();
      }
    }
    // What lies before this interval in its group.
    auto before = work->sum_columns.middleCols(group.first, c);
    auto before1 = work->sum_columns1.middleCols(group.first, c);
    auto before2 = work->sum_columns2.middleCols(group.first, c);
    before -= s.columns;
    before1 -= s.columns1;
    before2 -= s.columns2;

    AddLocalStiffness(v, group, m, s, work, out->stiffness.block(f, f, c, c));
    work->fm.noalias() = total.inertia.lazyProduct(s.columns);
    work->fd.noalias() = total.inertia.lazyProduct(s.columns1);
    work->fd *= 2.0;
    work->fd.noalias() += total.rate.lazyProduct(s.columns);
    work->fk.noalias() = total.inertia.lazyProduct(s.columns2);
    work->fk.noalias() += total.rate.lazyProduct(s.columns1);
    work->uy.noalias() = total.rate.transpose().lazyProduct(s.columns);
    if (arm.needs_rotation) {
      work->fk.noalias() += total.rotation.lazyProduct(s.columns);
      work->uz.noalias() = total.rotation.transpose().lazyProduct(s.columns);
    }
    auto mass = out->mass.block(f, f, c, c);
    auto damping = out->damping.block(f, f, c, c);
    auto stiffness = out->stiffness.block(f, f, c, c);
    mass.noalias() += s.columns.transpose().lazyProduct(work->fm);
    damping.noalias() += s.columns.transpose().lazyProduct(work->fd);
    stiffness.noalias() += s.columns.transpose().lazyProduct(work->fk);
    // Tests before l feel the wrenches beyond turn with the section: -N(W) S.
    for (int i = 0; i < c; ++i) {
      work->fk.col(i) -= model::CoadjointTimes(s.columns.col(i), s.wrench);
    }
    mass.noalias() += before.transpose().lazyProduct(work->fm);
    mass.noalias() += work->fm.transpose().lazyProduct(before);
    damping.noalias() += before.transpose().lazyProduct(work->fd);
    damping.noalias() += work->fm.transpose().lazyProduct(2.0 * before1);
    damping.noalias() += work->uy.transpose().lazyProduct(before);
    stiffness.noalias() += before.transpose().lazyProduct(work->fk);
    stiffness.noalias() += work->fm.transpose().lazyProduct(before2);
    stiffness.noalias() += work->uy.transpose().lazyProduct(before1);
    work->sum_m += work->fm;
    work->sum_d += work->fd;
    work->sum_k += work->fk;
    work->row_y += work->uy;
    if (arm.needs_rotation) {
      stiffness.noalias() += work->uz.transpose().lazyProduct(before);
      work->row_z += work->uz;
    }
    if (l > 0 && arm.intervals[l - 1].group == v.group) continue;

    // The group is complete: couple it with the groups before it and with the root.
    const int p = group.first;
    if (p > 0) {
      const auto s0 = work->sum_columns.leftCols(p);
      const auto s1 = work->sum_columns1.leftCols(p);
      const auto s2 = work->sum_columns2.leftCols(p);
      out->mass.block(first, f, p, c).noalias() += s0.transpose().lazyProduct(work->sum_m);
      out->mass.block(f, first, c, p).noalias() += work->sum_m.transpose().lazyProduct(s0);
      out->damping.block(first, f, p, c).noalias() += s0.transpose().lazyProduct(work->sum_d);
      auto low = out->damping.block(f, first, c, p);
      low.noalias() += work->sum_m.transpose().lazyProduct(2.0 * s1);
      low.noalias() += work->row_y.transpose().lazyProduct(s0);
      out->stiffness.block(first, f, p, c).noalias() += s0.transpose().lazyProduct(work->sum_k);
      auto k_low = out->stiffness.block(f, first, c, p);
      k_low.noalias() += work->sum_m.transpose().lazyProduct(s2);
      k_low.noalias() += work->row_y.transpose().lazyProduct(s1);
      if (arm.needs_rotation) k_low.noalias() += work->row_z.transpose().lazyProduct(s0);
    }
    out->mass.block(0, f, 6, c) += work->sum_m;
    out->mass.block(f, 0, c, 6) += work->sum_m.transpose();
    out->damping.block(0, f, 6, c) += work->sum_d;
    out->damping.block(f, 0, c, 6) += work->row_y.transpose();
    out->damping.block(f, 0, c, 6).noalias() += work->sum_m.transpose().lazyProduct(root_ad);
    out->stiffness.block(0, f, 6, c) += work->sum_k;
    if (arm.needs_rotation) out->stiffness.block(f, 0, c, 6) += work->row_z.transpose();
  }
  const Matrix3 base = arm.mount.rotation.toRotationMatrix();
  if (arm.base_section >= 0) {
    AddSection(arm, m, arm.sections[arm.base_section], base, arm.mount.position, m.root_twist,
               &total);
  }
  for (std::size_t k = 0; k < arm.points.size(); ++k) {
    if (arm.points[k].interval < 0) {
      AddPoint(m, arm.points[k], m.points[k], base, arm.mount.position, &total);
    }
  }
  out->mass.topLeftCorner<6, 6>() += total.inertia;
  out->damping.topLeftCorner<6, 6>() += total.rate + total.inertia * root_ad;
  if (arm.needs_rotation) out->stiffness.topLeftCorner<6, 6>() += total.rotation;
  AddCables(arm, m, first, work, out);
}

void AddDistributedColumn(const ReducedArm& arm, const ArmMotion& m, const ArmWork& work, int load,
                          double gain, int first, Eigen::Ref<VectorX> column) {
  Vector6 sum = Vector6::Zero();
  const auto add = [&](const model::RodNode& node, const Matrix3& r, const Vector3& p) {
    const model::SectionMotion motion{arm.needs_rotation ? m.root_rotation * Eigen::Quaterniond(r)
                                                         : Eigen::Quaterniond::Identity(),
                                      Vector6::Zero()};
    const Vector6 w = (-gain * node.weight_m) * arm.distributed[load].Density(node.section, motion);
    sum.tail<3>() += r * w.tail<3>();
    sum.head<3>() += r * w.head<3>() + p.cross(r * w.tail<3>());
  };
  for (int l = arm.dynamic_intervals - 1; l >= 0; --l) {
    const Interval& v = arm.intervals[l];
    const IntervalState& s = work.at[l];
    if (v.section >= 0) add(arm.sections[v.section], s.rotation, s.position);
    const StrainGroup& group = arm.basis.groups()[v.group];
    column.segment(first + group.first, group.columns).noalias() +=
        s.columns.transpose().lazyProduct(sum);
  }
  if (arm.base_section >= 0) {
    add(arm.sections[arm.base_section], arm.mount.rotation.toRotationMatrix(), arm.mount.position);
  }
  column.head<6>() += sum;
}

void AddPointColumn(const ReducedArm& arm, const ArmMotion& m, const ArmWork& work, int point,
                    double gain, int first, Eigen::Ref<VectorX> column) {
  const ReducedPoint& load = arm.points[point];
  const bool base = load.interval < 0;
  const Matrix3 r =
      base ? Matrix3(arm.mount.rotation.toRotationMatrix()) : work.at[load.interval].rotation;
  const Vector3 p = base ? arm.mount.position : work.at[load.interval].position;
  const Vector6 w = WrenchInSection(-gain * load.load->wrench, load.load->frame,
                                    m.root_rotation * Eigen::Quaterniond(r));
  Vector6 sum;
  sum.tail<3>() = r * w.tail<3>();
  sum.head<3>() = r * w.head<3>() + p.cross(sum.tail<3>());
  for (int l = 0; l <= load.interval; ++l) {
    const StrainGroup& group = arm.basis.groups()[arm.intervals[l].group];
    column.segment(first + group.first, group.columns).noalias() +=
        work.at[l].columns.transpose().lazyProduct(sum);
  }
  column.head<6>() += sum;
}

}  // namespace mantle::reduced
