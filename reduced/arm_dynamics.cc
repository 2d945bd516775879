#include "reduced/arm_dynamics.h"

namespace mantle::reduced {
namespace {

using model::CoadjointTimes;
using model::SmallAdjointTimes;

Vector6 ToRoot(const Matrix3& r, const Vector3& p, const Vector6& x) {  // Ad_h x
  Vector6 y;
  y.head<3>().noalias() = r * x.head<3>();
  y.tail<3>().noalias() = r * x.tail<3>();
  y.tail<3>() += p.cross(y.head<3>());
  return y;
}

Vector6 FromRoot(const Matrix3& r, const Vector3& p, const Vector6& x) {  // Ad_h^-1 x
  Vector6 y;
  y.head<3>().noalias() = r.transpose() * x.head<3>();
  y.tail<3>().noalias() = r.transpose() * (x.tail<3>() - p.cross(x.head<3>()));
  return y;
}

Vector6 WrenchToRoot(const Matrix3& r, const Vector3& p, const Vector6& w) {  // Ad_h^-T w
  Vector6 y;
  y.tail<3>().noalias() = r * w.tail<3>();
  y.head<3>().noalias() = r * w.head<3>();
  y.head<3>() += p.cross(y.tail<3>());
  return y;
}

Vector6 WrenchFromRoot(const Matrix3& r, const Vector3& p, const Vector6& w) {  // Ad_h^T w
  Vector6 y;
  y.head<3>().noalias() = r.transpose() * (w.head<3>() - p.cross(w.tail<3>()));
  y.tail<3>().noalias() = r.transpose() * w.tail<3>();
  return y;
}

// y = B x; the usual number of columns as a constant.
Vector6 Times(const Columns& b, const double* x) {
  if (b.cols() == 4) {
    return Eigen::Map<const Eigen::Matrix<double, 6, 4, Eigen::RowMajor>>(b.data()) *
           Eigen::Map<const Eigen::Vector4d>(x);
  }
  Vector6 y;
  for (int i = 0; i < 6; ++i) {
    double sum = 0;
    for (int j = 0; j < b.cols(); ++j) sum += b(i, j) * x[j];
    y(i) = sum;
  }
  return y;
}

// y += B^T x
void AddTransposed(const Columns& b, const Vector6& x, double* y) {
  if (b.cols() == 4) {
    Eigen::Map<Eigen::Vector4d>(y).noalias() +=
        Eigen::Map<const Eigen::Matrix<double, 6, 4, Eigen::RowMajor>>(b.data()).transpose() * x;
    return;
  }
  for (int i = 0; i < 6; ++i) {
    for (int j = 0; j < b.cols(); ++j) y[j] += b(i, j) * x(i);
  }
}

void SetOmega(const Interval& v, const StrainGroup& group, const ArmMotion& m, IntervalState* s) {
  const double *const q = m.q + group.first, *const q1 = m.q_dot + group.first,
                      *const q2 = m.q_ddot + group.first;
  s->omega = Times(v.basis, q);
  s->omega_dot = Times(v.basis, q1);
  s->omega_ddot = Times(v.basis, q2);
  if (!v.magnus) {
    s->omega += v.reference;
    return;
  }
  const Vector6 a = v.rest1 + Times(v.basis1, q), b = v.rest2 + Times(v.basis2, q);
  const Vector6 a1 = Times(v.basis1, q1), b1 = Times(v.basis2, q1);
  const Vector6 a2 = Times(v.basis1, q2), b2 = Times(v.basis2, q2);
  s->omega += 0.5 * v.length_m * (v.rest1 + v.rest2) + v.kappa * SmallAdjointTimes(a, b);
  s->omega_dot += v.kappa * (SmallAdjointTimes(a1, b) + SmallAdjointTimes(a, b1));
  s->omega_ddot += v.kappa * (SmallAdjointTimes(a2, b) + 2.0 * SmallAdjointTimes(a1, b1) +
                              SmallAdjointTimes(a, b2));
}

model::SectionMotion MotionOf(const ReducedArm& arm, const ArmMotion& m, const Matrix3& rotation,
                              const Vector6& eta) {
  if (!arm.needs_rotation) return {Eigen::Quaterniond::Identity(), eta};
  return {m.root_rotation * Eigen::Quaterniond(rotation), eta, m.water_acceleration_m_s2};
}

// Inertia minus loads of a payload, in the root frame.
Vector6 PayloadWrench(const ReducedArm& arm, const ArmMotion& m, const ReducedPayload& payload,
                      double attached, const Matrix3& rotation, const Vector3& position,
                      const Vector6& twist, const Vector6& acceleration) {
  const Vector6 eta = FromRoot(rotation, position, twist);
  Vector6 w = payload.inertia * FromRoot(rotation, position, acceleration);
  w -= CoadjointTimes(eta, payload.inertia * eta);
  AddRootWrenches(payload.loads, MotionOf(arm, m, rotation, eta), m.gravity_scale, -1.0, &w);
  return attached * WrenchToRoot(rotation, position, w);
}

void AddMuscles(const ReducedArm& arm, const ArmMotion& m, ArmWork* work) {
  for (const MusclePoint& p : arm.muscle_points) {
    Vector6 moment = Vector6::Zero();
    for (std::size_t k = 0; k < arm.muscles.size(); ++k) {
      moment.head<3>() -= MuscleMoment(arm.muscles[k], m.muscles[k], m.envelopes, p.x_m);
    }
    AddTransposed(p.basis, moment, work->residual.data() + arm.basis.groups()[p.group].first);
  }
}

// Inertia minus loads of a section at (rotation, position), in the root frame.
Vector6 SectionWrench(const ReducedArm& arm, const ArmMotion& m, const model::RodNode& node,
                      const Matrix3& rotation, const Vector3& frame, const Vector6& twist,
                      const Vector6& acceleration, Vector6* internal) {
  const Vector3 position = frame + node.ahead_m * rotation.col(0);
  const Vector6 eta = FromRoot(rotation, position, twist);
  const Vector6 inertia = node.FullInertia();
  Vector6 w = inertia.cwiseProduct(FromRoot(rotation, position, acceleration));
  w -= CoadjointTimes(eta, inertia.cwiseProduct(eta));
  const model::SectionMotion motion = MotionOf(arm, m, rotation, eta);
  for (const model::SectionLoad& load : arm.loads) {
    const double scale = node.weight_m * FieldScale(load, m.gravity_scale);
    w -= scale * std::visit([&](const auto& l) { return l.Density(node.section, motion); }, load);
  }
  for (std::size_t k = 0; k < arm.distributed.size(); ++k) {
    if (m.distributed[k] == 0.0) continue;
    const Vector6 load =
        (node.weight_m * m.distributed[k]) * arm.distributed[k].Density(node.section, motion);
    w -= load;
    if (IsInternal(arm.distributed[k])) *internal += WrenchToRoot(rotation, position, load);
  }
  return WrenchToRoot(rotation, position, w);
}

Vector6 PointWrenchAt(const ArmMotion& m, const ReducedPoint& p, double amplitude,
                      const Matrix3& rotation) {
  return WrenchInSection(amplitude * p.load.wrench, p.load.frame,
                         m.root_rotation * Eigen::Quaterniond(rotation));
}

void EvaluateCables(const ReducedArm& arm, const ArmMotion& m, ArmWork* work) {
  for (std::size_t c = 0; c < arm.cables.size(); ++c) {
    work->cable_tension_n[c] = 0.0;
    if (!m.cables[c].reeled && m.cables[c].tension_n == 0.0) continue;
    EvaluateCable(arm, m, static_cast<int>(c), work);
    const double u =
        model::CableTension(m.cables[c], work->cable_length_m[c], work->cable_rate_m_s[c]);
    work->cable_tension_n[c] = u;
    if (u != 0.0) work->residual += u * work->cable_gradient[c];
  }
}

}  // namespace

ArmWork::ArmWork(const ReducedArm& arm)
    : at(arm.intervals.size()),
      base_wrench(Vector6::Zero()),
      residual(VectorX::Zero(arm.size())),
      cable_length_m(arm.cables.size(), 0.0),
      cable_rate_m_s(arm.cables.size(), 0.0),
      cable_tension_n(arm.cables.size(), 0.0),
      cable_gradient(arm.cables.size(), VectorX::Zero(arm.size())) {
  for (std::size_t l = 0; l < at.size(); ++l) {
    const int m = arm.basis.groups()[arm.intervals[l].group].columns;
    for (Columns* x : {&at[l].columns, &at[l].columns1, &at[l].columns2}) x->setZero(6, m);
  }
  for (const StrainGroup& g : arm.basis.groups()) groups.emplace_back(g.columns);
}

GroupSums::GroupSums(int count) {
  for (Columns* x : {&columns, &columns1, &columns2, &mass, &damping, &stiffness, &rate, &rotation})
    x->setZero(6, count);
}

void GroupSums::SetZero() {
  for (Columns* x : {&columns, &columns1, &columns2, &mass, &damping, &stiffness, &rate, &rotation})
    x->setZero();
}

void EvaluateArmPoses(const ReducedArm& arm, const double* q, std::vector<Pose>* poses) {
  Pose h = arm.mount;
  for (std::size_t l = 0; l < arm.intervals.size(); ++l) {
    const Interval& v = arm.intervals[l];
    const StrainGroup& group = arm.basis.groups()[v.group];
    IntervalState s;
    SetOmega(v, group, {q, q, q, {}, {}, {}, 0, nullptr, nullptr, nullptr}, &s);
    h = h * model::ExpSE3(s.omega);
    (*poses)[l] = h;
  }
}

void EvaluateCable(const ReducedArm& arm, const ArmMotion& m, int c, ArmWork* work) {
  double length = arm.cables[c].length_offset_m;
  VectorX& gradient = work->cable_gradient[c];
  gradient.setZero();
  double rate = 0;
  for (const CablePoint& p : arm.cables[c].points) {
    const StrainGroup& group = arm.basis.groups()[p.group];
    Vector6 g;
    const Vector6 d = p.reference + Times(p.basis, m.q + group.first);
    length += CablePieceLength(p.piece, p.element, d, &g, nullptr);
    AddTransposed(p.basis, g, gradient.data() + group.first);
  }
  for (int i = 0; i < gradient.size(); ++i) rate += gradient(i) * m.q_dot[i];
  work->cable_length_m[c] = length;
  work->cable_rate_m_s[c] = rate;
}

bool EvaluateArm(const ReducedArm& arm, const ArmMotion& m, ArmWork* work) {
  Matrix3 rotation = arm.mount.rotation.toRotationMatrix();
  Vector3 position = arm.mount.position;
  Vector6 twist = m.root_twist, acceleration = m.root_acceleration;
  work->base_wrench.setZero();
  Vector6 internal = Vector6::Zero();
  work->has_internal = false;
  for (std::size_t k = 0; k < arm.distributed.size(); ++k) {
    work->has_internal |= m.distributed[k] != 0.0 && IsInternal(arm.distributed[k]);
  }
  if (arm.base_section >= 0) {
    work->base_wrench = SectionWrench(arm, m, arm.sections[arm.base_section], rotation, position,
                                      twist, acceleration, &internal);
    work->base_wrench += internal;
  }
  for (int l = 0; l < arm.dynamic_intervals; ++l) {
    const Interval& v = arm.intervals[l];
    IntervalState& s = work->at[l];
    SetOmega(v, arm.basis.groups()[v.group], m, &s);
    s.coefficients = EvaluateTangentJet(s.omega, s.omega_dot, &s.jet);
    position += rotation * s.jet.position;
    rotation = (rotation * s.jet.rotation).eval();
    s.rotation = rotation;
    s.position = position;
    const Vector6 moved = ToRoot(rotation, position, s.jet.value.Times(s.omega_dot));
    twist += moved;
    acceleration +=
        ToRoot(rotation, position, s.jet.value.Times(s.omega_ddot) + s.jet.rate.Times(s.omega_dot));
    acceleration += SmallAdjointTimes(twist, moved);
    s.twist = twist;
    s.acceleration = acceleration;
    s.internal.setZero();
    if (v.section >= 0) {
      s.own_wrench = SectionWrench(arm, m, arm.sections[v.section], rotation, position, twist,
                                   acceleration, &s.internal);
    } else {
      s.own_wrench.setZero();
    }
  }
  for (std::size_t k = 0; k < arm.payloads.size(); ++k) {
    const ReducedPayload& p = arm.payloads[k];
    if (m.payloads[k] == 0.0) continue;
    if (p.interval < 0) {
      work->base_wrench +=
          PayloadWrench(arm, m, p, m.payloads[k], arm.mount.rotation.toRotationMatrix(),
                        arm.mount.position, m.root_twist, m.root_acceleration);
      continue;
    }
    IntervalState& s = work->at[p.interval];
    s.own_wrench +=
        PayloadWrench(arm, m, p, m.payloads[k], s.rotation, s.position, s.twist, s.acceleration);
  }
  for (std::size_t k = 0; k < arm.points.size(); ++k) {
    const ReducedPoint& p = arm.points[k];
    if (m.points[k] == 0.0) continue;
    if (p.interval < 0) {
      const Matrix3 base = arm.mount.rotation.toRotationMatrix();
      work->base_wrench -=
          WrenchToRoot(base, arm.mount.position, PointWrenchAt(m, p, m.points[k], base));
      continue;
    }
    IntervalState& s = work->at[p.interval];
    s.own_wrench -=
        WrenchToRoot(s.rotation, s.position, PointWrenchAt(m, p, m.points[k], s.rotation));
  }

  const Eigen::Map<const VectorX> q(m.q, arm.size()), q_dot(m.q_dot, arm.size());
  work->residual.noalias() = arm.stiffness.lazyProduct(q);
  if (arm.viscous) work->residual.noalias() += arm.damping.lazyProduct(q_dot);
  Vector6 sum = Vector6::Zero();
  for (int l = arm.dynamic_intervals - 1; l >= 0; --l) {
    const Interval& v = arm.intervals[l];
    const StrainGroup& group = arm.basis.groups()[v.group];
    IntervalState& s = work->at[l];
    sum += s.own_wrench;
    s.wrench = sum;
    s.body_wrench = WrenchFromRoot(s.rotation, s.position, sum);
    s.stress = s.jet.value.TransposeTimes(s.body_wrench);
    double* const residual = work->residual.data() + group.first;
    AddTransposed(v.basis, s.stress, residual);
    if (v.magnus) {
      const double* const local = m.q + group.first;
      const Vector6 a = v.rest1 + Times(v.basis1, local), b = v.rest2 + Times(v.basis2, local);
      AddTransposed(v.basis2, v.kappa * CoadjointTimes(a, s.stress), residual);
      AddTransposed(v.basis1, -v.kappa * CoadjointTimes(b, s.stress), residual);
    }
  }
  work->base_wrench += sum;
  if (work->has_internal) {
    for (int l = 0; l < arm.dynamic_intervals; ++l) work->base_wrench += work->at[l].internal;
  }
  EvaluateCables(arm, m, work);
  if (!arm.muscle_points.empty()) AddMuscles(arm, m, work);
  return work->residual.allFinite() && work->base_wrench.allFinite();
}

}  // namespace mantle::reduced
