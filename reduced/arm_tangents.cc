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

// Six rows, C columns; C may be Eigen::Dynamic (Legendre), then without heap.
inline constexpr int kMostColumns = 6 * 13;
template <int C>
using Columns = Eigen::Matrix<double, 6, C, 0, 6, C == Eigen::Dynamic ? kMostColumns : C>;
template <int C>
Eigen::Map<Eigen::Matrix<double, 6, C>> As(Matrix6X& x) {
  return Eigen::Map<Eigen::Matrix<double, 6, C>>(x.data(), 6, x.cols());
}
template <int C>
Eigen::Map<const Eigen::Matrix<double, 6, C>> As(const Matrix6X& x) {
  return Eigen::Map<const Eigen::Matrix<double, 6, C>>(x.data(), 6, x.cols());
}

Vector6 ToRoot(const Matrix3& r, const Vector3& p, const Vector6& x) {
  Vector6 y;
  y.head<3>().noalias() = r * x.head<3>();
  y.tail<3>().noalias() = r * x.tail<3>();
  y.tail<3>() += p.cross(y.head<3>());
  return y;
}

// d xi1^ B2 - d xi2^ B1, the strain-dependent part of dOmega/dq for strains (a, b).
template <typename Matrix>
void AddMagnus(const Interval& v, const Vector6& a, const Vector6& b, Matrix* e) {
  for (int i = 0; i < e->cols(); ++i) {
    e->col(i) +=
        v.kappa * (SmallAdjointTimes(a, v.basis2.col(i)) - SmallAdjointTimes(b, v.basis1.col(i)));
  }
}

// S, S', S'' of one interval.
template <int C>
void MakeColumns(const Interval& v, const StrainGroup& group, const ArmMotion& m,
                 IntervalState* s) {
  EvaluateSecondTangent(s->coefficients, s->omega, s->omega_dot, s->omega_ddot, &s->jet);
  Columns<C> e = As<C>(v.basis), e1, e2;
  if (v.magnus) {
    const Eigen::Map<const VectorX> q(m.q + group.first, group.columns);
    const Eigen::Map<const VectorX> q1(m.q_dot + group.first, group.columns);
    const Eigen::Map<const VectorX> q2(m.q_ddot + group.first, group.columns);
    AddMagnus(v, v.rest1 + v.basis1.lazyProduct(q), v.rest2 + v.basis2.lazyProduct(q), &e);
    e1.setZero(6, group.columns);
    e2.setZero(6, group.columns);
    AddMagnus(v, v.basis1.lazyProduct(q1), v.basis2.lazyProduct(q1), &e1);
    AddMagnus(v, v.basis1.lazyProduct(q2), v.basis2.lazyProduct(q2), &e2);
  }
  auto columns = As<C>(s->columns), columns1 = As<C>(s->columns1), columns2 = As<C>(s->columns2);
  for (int i = 0; i < columns.cols(); ++i) {
    const Vector6 x = e.col(i);
    Vector6 tau1 = s->jet.rate.Times(x), tau2 = s->jet.second.Times(x);
    if (v.magnus) {
      const Vector6 x1 = e1.col(i);
      tau1 += s->jet.value.Times(x1);
      tau2 += 2.0 * s->jet.rate.Times(x1) + s->jet.value.Times(e2.col(i));
    }
    const Vector6 column = ToRoot(s->rotation, s->position, s->jet.value.Times(x));
    const Vector6 first = ToRoot(s->rotation, s->position, tau1);
    const Vector6 turned = SmallAdjointTimes(s->twist, column);
    columns.col(i) = column;
    columns1.col(i) = first + turned;
    columns2.col(i) = ToRoot(s->rotation, s->position, tau2) +
                      SmallAdjointTimes(s->twist, 2.0 * first + turned) +
                      SmallAdjointTimes(s->acceleration, column);
  }
}

// The local second derivative of the kinematics times the stress.
template <int C, typename Block>
void AddLocalStiffness(const Interval& v, const StrainGroup& group, const ArmMotion& m,
                       const IntervalState& s, Block stiffness) {
  const Matrix6 g = TangentTransposeDerivative(s.coefficients, s.omega, s.body_wrench);
  Columns<C> e = As<C>(v.basis), x;
  if (v.magnus) {
    const Eigen::Map<const VectorX> q(m.q + group.first, group.columns);
    AddMagnus(v, v.rest1 + v.basis1.lazyProduct(q), v.rest2 + v.basis2.lazyProduct(q), &e);
    const Matrix6 n = v.kappa * CoadjointMatrix(s.stress);
    x.noalias() = n.lazyProduct(v.basis1);
    stiffness.noalias() += v.basis2.transpose().lazyProduct(x);
    x.noalias() = n.lazyProduct(v.basis2);
    stiffness.noalias() -= v.basis1.transpose().lazyProduct(x);
  }
  x.noalias() = g.lazyProduct(e);
  stiffness.noalias() += e.transpose().lazyProduct(x);
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
      hessian *= u;
      Columns<Eigen::Dynamic> x = hessian.lazyProduct(p.basis);
      out->stiffness.block(first + group.first, first + group.first, group.columns, group.columns)
          .noalias() += p.basis.transpose().lazyProduct(x);
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
      const Vector6 turned = in.damping_n_s_m * (hessian * Vector6(p.basis.lazyProduct(q1)));
      for (int j = 0; j < group.columns; ++j) {
        out->stiffness.col(first + group.first + j).segment(first, n) +=
            turned.dot(p.basis.col(j)) * gradient;
      }
    }
  }
}

template <int C>
void LineariseColumns(const ReducedArm& arm, const ArmMotion& m, int first, ArmWork* work,
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
    MakeColumns<C>(v, group, m, &s);
    work->sum_columns.middleCols(group.first, group.columns) += s.columns;
    work->sum_columns1.middleCols(group.first, group.columns) += s.columns1;
    work->sum_columns2.middleCols(group.first, group.columns) += s.columns2;
  }

  Composite total;
  Vector6 internal = Vector6::Zero();
  Columns<C> fm, fd, fk, uy, uz, sum_m, sum_d, sum_k, row_y, row_z;
  const Matrix6 root_ad = model::SmallAdjoint(m.root_twist);
  for (int l = arm.dynamic_intervals - 1; l >= 0; --l) {
    const Interval& v = arm.intervals[l];
    const StrainGroup& group = groups[v.group];
    const int c = group.columns, f = first + group.first;
    const IntervalState& s = work->at[l];
    if (work->has_internal) {  // the root does not feel these: nor does their turning with S
      internal += s.internal;
      for (int i = 0; i < c; ++i) {
        out->stiffness.block<6, C>(0, f, 6, c).col(i) -=
            model::CoadjointTimes(s.columns.col(i), internal);
      }
    }
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
      for (Columns<C>* x : {&sum_m, &sum_d, &sum_k, &row_y, &row_z}) x->setZero(6, c);
    }
    // What lies before this interval in its group.
    const auto columns = As<C>(s.columns), columns1 = As<C>(s.columns1),
               columns2 = As<C>(s.columns2);
    auto before = work->sum_columns.middleCols<C>(group.first, c);
    auto before1 = work->sum_columns1.middleCols<C>(group.first, c);
    auto before2 = work->sum_columns2.middleCols<C>(group.first, c);
    before -= columns;
    before1 -= columns1;
    before2 -= columns2;

    AddLocalStiffness<C>(v, group, m, s, out->stiffness.block<C, C>(f, f, c, c));
    fm.noalias() = total.inertia.lazyProduct(columns);
    fd.noalias() = total.inertia.lazyProduct(columns1);
    fd *= 2.0;
    fd.noalias() += total.rate.lazyProduct(columns);
    fk.noalias() = total.inertia.lazyProduct(columns2);
    fk.noalias() += total.rate.lazyProduct(columns1);
    uy.noalias() = total.rate.transpose().lazyProduct(columns);
    if (arm.needs_rotation) {
      fk.noalias() += total.rotation.lazyProduct(columns);
      uz.noalias() = total.rotation.transpose().lazyProduct(columns);
    }
    auto mass = out->mass.block<C, C>(f, f, c, c);
    auto damping = out->damping.block<C, C>(f, f, c, c);
    auto stiffness = out->stiffness.block<C, C>(f, f, c, c);
    mass.noalias() += columns.transpose().lazyProduct(fm);
    damping.noalias() += columns.transpose().lazyProduct(fd);
    stiffness.noalias() += columns.transpose().lazyProduct(fk);
    // Tests before l feel the wrenches beyond turn with the section: -N(W) S.
    for (int i = 0; i < c; ++i) {
      fk.col(i) -= model::CoadjointTimes(columns.col(i), s.wrench);
    }
    mass.noalias() += before.transpose().lazyProduct(fm);
    mass.noalias() += fm.transpose().lazyProduct(before);
    damping.noalias() += before.transpose().lazyProduct(fd);
    damping.noalias() += 2.0 * fm.transpose().lazyProduct(before1);
    damping.noalias() += uy.transpose().lazyProduct(before);
    stiffness.noalias() += before.transpose().lazyProduct(fk);
    stiffness.noalias() += fm.transpose().lazyProduct(before2);
    stiffness.noalias() += uy.transpose().lazyProduct(before1);
    sum_m += fm;
    sum_d += fd;
    sum_k += fk;
    row_y += uy;
    if (arm.needs_rotation) {
      stiffness.noalias() += uz.transpose().lazyProduct(before);
      row_z += uz;
    }
    if (l > 0 && arm.intervals[l - 1].group == v.group) continue;

    // The group is complete: couple it with the groups before it and with the root.
    const int p = group.first;
    if (p > 0) {
      const auto s0 = work->sum_columns.leftCols(p);
      const auto s1 = work->sum_columns1.leftCols(p);
      const auto s2 = work->sum_columns2.leftCols(p);
      out->mass.block<Eigen::Dynamic, C>(first, f, p, c).noalias() +=
          s0.transpose().lazyProduct(sum_m);
      out->mass.block<C, Eigen::Dynamic>(f, first, c, p).noalias() +=
          sum_m.transpose().lazyProduct(s0);
      out->damping.block<Eigen::Dynamic, C>(first, f, p, c).noalias() +=
          s0.transpose().lazyProduct(sum_d);
      auto low = out->damping.block<C, Eigen::Dynamic>(f, first, c, p);
      low.noalias() += 2.0 * sum_m.transpose().lazyProduct(s1);
      low.noalias() += row_y.transpose().lazyProduct(s0);
      out->stiffness.block<Eigen::Dynamic, C>(first, f, p, c).noalias() +=
          s0.transpose().lazyProduct(sum_k);
      auto k_low = out->stiffness.block<C, Eigen::Dynamic>(f, first, c, p);
      k_low.noalias() += sum_m.transpose().lazyProduct(s2);
      k_low.noalias() += row_y.transpose().lazyProduct(s1);
      if (arm.needs_rotation) k_low.noalias() += row_z.transpose().lazyProduct(s0);
    }
    out->mass.block<6, C>(0, f, 6, c) += sum_m;
    out->mass.block<C, 6>(f, 0, c, 6) += sum_m.transpose();
    out->damping.block<6, C>(0, f, 6, c) += sum_d;
    out->damping.block<C, 6>(f, 0, c, 6) += row_y.transpose();
    out->damping.block<C, 6>(f, 0, c, 6).noalias() += sum_m.transpose().lazyProduct(root_ad);
    out->stiffness.block<6, C>(0, f, 6, c) += sum_k;
    if (arm.needs_rotation) out->stiffness.block<C, 6>(f, 0, c, 6) += row_z.transpose();
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
}

}  // namespace

void LineariseArm(const ReducedArm& arm, const ArmMotion& m, int first, ArmWork* work,
                  Linearisation* out) {
  switch (arm.basis.groups()[0].columns) {
    case 2:
      LineariseColumns<2>(arm, m, first, work, out);
      break;
    case 3:
      LineariseColumns<3>(arm, m, first, work, out);
      break;
    case 4:
      LineariseColumns<4>(arm, m, first, work, out);
      break;
    case 6:
      LineariseColumns<6>(arm, m, first, work, out);
      break;
    default:
      LineariseColumns<Eigen::Dynamic>(arm, m, first, work, out);
  }
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
  if (IsInternal(arm.distributed[load])) return;
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
