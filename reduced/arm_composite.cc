#include "reduced/arm_composite.h"

namespace mantle::reduced {
namespace {

using model::CoadjointMatrix;

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

// Adds an inertia that moves with `twist`: itself, and -N(I V) - ad_V^T I - I ad_V.
void AddInertia(const Matrix6& inertia, const Vector6& twist, Composite* out) {
  out->inertia += inertia;
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
}

}  // namespace

void AddSection(const ReducedArm& arm, const ArmMotion& m, const model::RodNode& node,
                const Matrix3& r, const Vector3& frame, const Vector6& twist, Composite* out) {
  const Vector3 p = frame + node.ahead_m * r.col(0);
  const Vector6 diagonal = node.FullInertia();
  Matrix6 inertia;
  const Matrix3 linear = r * diagonal.tail<3>().asDiagonal() * r.transpose();
  AddLinearForm(linear, p, [&](const auto& aa, const auto& ab, const auto& ba, const auto& bb) {
    inertia << aa, ab, ba, bb;
  });
  inertia.topLeftCorner<3, 3>() += r * diagonal.head<3>().asDiagonal() * r.transpose();
  AddInertia(inertia, twist, out);

  const Vector3 w = twist.head<3>(), v = twist.tail<3>();
  if (arm.loads.empty() && !arm.needs_rotation) return;
  Vector6 eta;
  eta.head<3>().noalias() = r.transpose() * w;
  eta.tail<3>().noalias() = r.transpose() * (v - p.cross(w));
  const model::SectionMotion motion{
      arm.needs_rotation ? m.root_rotation * Eigen::Quaterniond(r) : Eigen::Quaterniond::Identity(),
      eta, m.water_acceleration_m_s2};
  model::LoadTangent t;
  for (const model::SectionLoad& load : arm.loads) {
    std::visit(
        [&]<typename Load>(const Load& l) {
          if constexpr (!Load::kField) return l.AddTangent(node.section, motion, &t);
          model::LoadTangent one;
          l.AddTangent(node.section, motion, &one);
          t.force_by_rotation += m.gravity_scale * one.force_by_rotation;
          t.moment_by_rotation += m.gravity_scale * one.moment_by_rotation;
          t.force_by_velocity += m.gravity_scale * one.force_by_velocity;
        },
        load);
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

void AddPayload(const ReducedArm& arm, const ArmMotion& m, const ReducedPayload& payload,
                double attached, const Matrix3& r, const Vector3& p, const Vector6& twist,
                Composite* out) {
  if (attached == 0.0) return;
  const Matrix6 back = model::Adjoint(model::Inverse(Pose{Eigen::Quaterniond(r), p}));
  AddInertia(attached * (back.transpose() * payload.inertia * back), twist, out);
  if (!arm.needs_rotation) return;
  const model::SectionMotion motion{m.root_rotation * Eigen::Quaterniond(r), back * twist,
                                    m.water_acceleration_m_s2};
  const model::RootTangent t = RootLoadTangent(payload.loads, motion, m.gravity_scale);
  AddRotationForm(t.by_rotation.topRows<3>(), t.by_rotation.bottomRows<3>(), r, p, -attached,
                  &out->rotation);
}

void AddInternalRotation(const ReducedArm& arm, const ArmMotion& m, const model::RodNode& node,
                         const Matrix3& r, const Vector3& frame, Matrix6* rotation) {
  const Vector3 p = frame + node.ahead_m * r.col(0);
  const model::SectionMotion motion{m.root_rotation * Eigen::Quaterniond(r), Vector6::Zero()};
  model::LoadTangent t;
  for (std::size_t k = 0; k < arm.distributed.size(); ++k) {
    if (m.distributed[k] == 0.0 || !IsInternal(arm.distributed[k])) continue;
    model::LoadTangent one;
    arm.distributed[k].AddTangent(node.section, motion, &one);
    t.force_by_rotation += m.distributed[k] * one.force_by_rotation;
    t.moment_by_rotation += m.distributed[k] * one.moment_by_rotation;
  }
  AddRotationForm(t.moment_by_rotation, t.force_by_rotation, r, p, -node.weight_m, rotation);
}

void AddPoint(const ArmMotion& m, const ReducedPoint& point, double amplitude, const Matrix3& r,
              const Vector3& p, Composite* out) {
  if (amplitude == 0.0 || point.load.frame == model::LoadFrame::kBody) return;
  const Vector6 w = WrenchInSection(amplitude * point.load.wrench, point.load.frame,
                                    m.root_rotation * Eigen::Quaterniond(r));
  AddRotationForm(model::Hat(w.head<3>()), model::Hat(w.tail<3>()), r, p, -1.0, &out->rotation);
}

}  // namespace mantle::reduced
