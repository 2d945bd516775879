#include "reduced/arm_columns.h"

namespace mantle::reduced {
namespace {

using model::CoadjointMatrix;
using model::SmallAdjointTimes;

/// Columns on the stack.
using LocalColumns = Eigen::Matrix<double, 6, Eigen::Dynamic, Eigen::RowMajor, 6, kMostColumns>;
using LocalRow = Eigen::Matrix<double, 1, Eigen::Dynamic, Eigen::RowMajor, 1, kMostColumns>;

// d xi1^ B2 - d xi2^ B1, the strain-dependent part of dOmega/dq for strains (a, b).
void AddMagnus(const Interval& v, const Vector6& a, const Vector6& b, LocalColumns* e) {
  for (int i = 0; i < e->cols(); ++i) {
    e->col(i) +=
        v.kappa * (SmallAdjointTimes(a, v.basis2.col(i)) - SmallAdjointTimes(b, v.basis1.col(i)));
  }
}

struct Strains {
  Eigen::Map<const VectorX> q, q1, q2;
  Strains(const ArmMotion& m, const StrainGroup& group)
      : q(m.q + group.first, group.columns),
        q1(m.q_dot + group.first, group.columns),
        q2(m.q_ddot + group.first, group.columns) {}
};

// dOmega/dq of a Magnus interval.
LocalColumns MagnusColumns(const Interval& v, const Strains& x) {
  LocalColumns e = v.basis;
  AddMagnus(v, v.rest1 + v.basis1.lazyProduct(x.q), v.rest2 + v.basis2.lazyProduct(x.q), &e);
  return e;
}

void MakeIntervalColumns(const Interval& v, const StrainGroup& group, const ArmMotion& m,
                         IntervalState* s) {
  EvaluateSecondTangent(s->coefficients, s->omega, s->omega_dot, s->omega_ddot, &s->jet);
  if (!v.magnus) return MakeColumns(group.columns, v.basis.data(), nullptr, nullptr, s);
  const Strains x(m, group);
  const LocalColumns e = MagnusColumns(v, x);
  LocalColumns e1 = LocalColumns::Zero(6, group.columns), e2 = e1;
  AddMagnus(v, v.basis1.lazyProduct(x.q1), v.basis2.lazyProduct(x.q1), &e1);
  AddMagnus(v, v.basis1.lazyProduct(x.q2), v.basis2.lazyProduct(x.q2), &e2);
  MakeColumns(group.columns, e.data(), e1.data(), e2.data(), s);
}

// Adds an interval to its group, and to K the second derivative of Magnus' commutator.
void AddToGroup(const Interval& v, const StrainGroup& group, const ArmMotion& m,
                bool needs_rotation, const Composite& beyond, const IntervalState& s, int f,
                GroupSums* sums, Linearisation* out) {
  const int c = group.columns;
  const int stride = static_cast<int>(out->mass.rows());
  const Matrix6 local = TangentTransposeDerivative(s.coefficients, s.omega, s.body_wrench);
  const auto add = [&](const double* e) {
    AddInterval(c, beyond, needs_rotation, e, local, s, sums, &out->mass(f, f), &out->damping(f, f),
                &out->stiffness(f, f), stride);
  };
  if (!v.magnus) return add(v.basis.data());
  const LocalColumns e = MagnusColumns(v, Strains(m, group));
  add(e.data());
  const Matrix6 n = v.kappa * CoadjointMatrix(s.stress);
  auto stiffness = out->stiffness.block(f, f, c, c);
  LocalColumns x = n.lazyProduct(v.basis1);
  stiffness.noalias() += v.basis2.transpose().lazyProduct(x);
  x.noalias() = n.lazyProduct(v.basis2);
  stiffness.noalias() -= v.basis1.transpose().lazyProduct(x);
}

void AddCables(const ReducedArm& arm, const ArmMotion& m, int first, ArmWork* work,
               Linearisation* out) {
  const int n = arm.size();
  for (std::size_t c = 0; c < arm.cables.size(); ++c) {
    const double u = work->cable_tension_n[c];
    if (u == 0.0) continue;
    for (const CablePoint& p : arm.cables[c].points) {
      const StrainGroup& group = arm.basis.groups()[p.group];
      const int f = first + group.first;
      const Eigen::Map<const VectorX> q(m.q + group.first, group.columns);
      Matrix6 hessian;
      CablePieceLength(p.piece, p.element, p.reference + p.basis.lazyProduct(q), nullptr, &hessian);
      AddForm(group.columns, p.basis.data(), hessian, u, &out->stiffness(f, f),
              static_cast<int>(out->stiffness.rows()));
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
      const LocalRow rate = turned.transpose().lazyProduct(p.basis);
      out->stiffness.block(first, first + group.first, n, group.columns).noalias() +=
          gradient.lazyProduct(rate);
    }
  }
}

// A complete group with the groups before it and with the root.
void CoupleGroup(const ReducedArm& arm, int g, int first, const Matrix6& root_ad, ArmWork* work,
                 Linearisation* out) {
  const StrainGroup& group = arm.basis.groups()[g];
  const GroupSums& sums = work->groups[g];
  const int c = group.columns, f = first + group.first;
  const int stride = static_cast<int>(out->mass.rows());
  const auto blocks = [&](int row, int column) -> GroupBlocks {
    return {&out->mass(row, column), &out->damping(row, column), &out->stiffness(row, column)};
  };
  for (int e = 0; e < g; ++e) {
    const StrainGroup& earlier = arm.basis.groups()[e];
    const int p = first + earlier.first;
    CoupleGroups(earlier.columns, work->groups[e], c, sums, arm.needs_rotation, blocks(p, f),
                 blocks(f, p), stride);
  }
  out->mass.block(0, f, 6, c) += sums.mass;
  out->mass.block(f, 0, c, 6) += sums.mass.transpose();
  out->damping.block(0, f, 6, c) += sums.damping;
  out->damping.block(f, 0, c, 6) += sums.rate.transpose();
  out->damping.block(f, 0, c, 6).noalias() += sums.mass.transpose().lazyProduct(root_ad);
  out->stiffness.block(0, f, 6, c) += sums.stiffness;
  if (arm.needs_rotation) out->stiffness.block(f, 0, c, 6) += sums.rotation.transpose();
}

}  // namespace

void LineariseArm(const ReducedArm& arm, const ArmMotion& m, int first, ArmWork* work,
                  Linearisation* out) {
  const int n = arm.size();
  const auto& groups = arm.basis.groups();
  out->stiffness.block(first, first, n, n) += arm.stiffness;
  if (arm.viscous) out->damping.block(first, first, n, n) += arm.damping;
  for (GroupSums& g : work->groups) g.SetZero();
  for (int l = 0; l < arm.dynamic_intervals; ++l) {
    const Interval& v = arm.intervals[l];
    IntervalState& s = work->at[l];
    MakeIntervalColumns(v, groups[v.group], m, &s);
    GroupSums& sums = work->groups[v.group];
    sums.columns += s.columns;
    sums.columns1 += s.columns1;
    sums.columns2 += s.columns2;
  }

  Composite total;
  Vector6 internal = Vector6::Zero();
  Matrix6 internal_rotation = Matrix6::Zero();
  const bool turning = work->has_internal && arm.needs_rotation;
  const Matrix6 root_ad = model::SmallAdjoint(m.root_twist);
  for (int l = arm.dynamic_intervals - 1; l >= 0; --l) {
    const Interval& v = arm.intervals[l];
    const int f = first + groups[v.group].first;
    const IntervalState& s = work->at[l];
    if (work->has_internal) {  // the root does not feel these: nor does their turning with S
      internal += s.internal;
      if (turning && v.section >= 0) {
        AddInternalRotation(arm, m, arm.sections[v.section], s.rotation, s.position,
                            &internal_rotation);
      }
      for (int i = 0; i < s.columns.cols(); ++i) {
        out->stiffness.col(f + i).head<6>() -= model::CoadjointTimes(s.columns.col(i), internal);
        if (turning) {
          out->stiffness.col(f + i).head<6>() -= internal_rotation * Vector6(s.columns.col(i));
        }
      }
    }
    if (v.section >= 0) {
      AddSection(arm, m, arm.sections[v.section], s.rotation, s.position, s.twist, &total);
    }
    for (std::size_t k = 0; k < arm.payloads.size(); ++k) {
      if (arm.payloads[k].interval == l) {
        AddPayload(arm, m, arm.payloads[k], m.payloads[k], s.rotation, s.position, s.twist, &total);
      }
    }
    for (std::size_t k = 0; k < arm.points.size(); ++k) {
      if (arm.points[k].interval == l) {
        AddPoint(m, arm.points[k], m.points[k], s.rotation, s.position, &total);
      }
    }
    AddToGroup(v, groups[v.group], m, arm.needs_rotation, total, s, f, &work->groups[v.group], out);
    if (l == 0 || arm.intervals[l - 1].group != v.group) {
      CoupleGroup(arm, v.group, first, root_ad, work, out);
    }
  }
  const Matrix3 base = arm.mount.rotation.toRotationMatrix();
  if (arm.base_section >= 0) {
    AddSection(arm, m, arm.sections[arm.base_section], base, arm.mount.position, m.root_twist,
               &total);
    if (turning) {
      AddInternalRotation(arm, m, arm.sections[arm.base_section], base, arm.mount.position,
                          &internal_rotation);
    }
  }
  for (std::size_t k = 0; k < arm.payloads.size(); ++k) {
    if (arm.payloads[k].interval < 0) {
      AddPayload(arm, m, arm.payloads[k], m.payloads[k], base, arm.mount.position, m.root_twist,
                 &total);
    }
  }
  for (std::size_t k = 0; k < arm.points.size(); ++k) {
    if (arm.points[k].interval < 0) {
      AddPoint(m, arm.points[k], m.points[k], base, arm.mount.position, &total);
    }
  }
  out->mass.topLeftCorner<6, 6>() += total.inertia;
  out->damping.topLeftCorner<6, 6>() += total.rate + total.inertia * root_ad;
  if (arm.needs_rotation) {
    out->stiffness.topLeftCorner<6, 6>() += total.rotation - internal_rotation;
  }
  AddCables(arm, m, first, work, out);
}

void AddDistributedColumn(const ReducedArm& arm, const ArmMotion& m, const ArmWork& work, int load,
                          double gain, int first, Eigen::Ref<VectorX> column) {
  Vector6 sum = Vector6::Zero();
  const auto add = [&](const model::RodNode& node, const Matrix3& r, const Vector3& frame) {
    const Vector3 p = frame + node.ahead_m * r.col(0);
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
  const Vector6 w = WrenchInSection(-gain * load.load.wrench, load.load.frame,
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
