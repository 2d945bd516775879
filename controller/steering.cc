#include "controller/steering.h"

#include <algorithm>
#include <cmath>

#include "reduced/outputs.h"

namespace mantle::controller {
namespace {

using model::Matrix3;
using model::Pose;

constexpr double kVanishes = 1e-3;  // of the sum over the parts that cancel
constexpr double kRate_s = 1e-3;    // of the reference's rate by differences
constexpr double kTiny = 1e-9;

// int R d(X) dX of one cable [m^2], in the root frame; `parts` grows by int |d| dX.
Vector3 BendOf(const ReducedModel& model, int cable, double* parts) {
  for (std::size_t a = 0; a < model.arms.size(); ++a) {
    const reduced::ReducedArm& arm = model.arms[a];
    const int first = model.ArmCableIndex(static_cast<int>(a), 0);
    if (cable < first || cable >= first + static_cast<int>(arm.cables.size())) continue;
    const reduced::ReducedCable& c = arm.cables[cable - first];
    *parts += c.distance_integral_m2;
    return arm.mount.rotation * c.offset_integral_m2;
  }
  return Vector3::Zero();
}

bool BelongsTo(const ReducedModel& model, int cable, int arm) {
  const int first = model.ArmCableIndex(arm, 0);
  return cable >= first && cable < first + static_cast<int>(model.arms[arm].cables.size());
}

Vector2 BaseLateral(const Vector3& v) { return v.tail<2>(); }

}  // namespace

Eigen::Matrix2Xd PullDirections(const ReducedModel& model, int tip_arm) {
  const auto& motors = model.actuators;
  Eigen::Matrix2Xd out = Eigen::Matrix2Xd::Zero(2, static_cast<Eigen::Index>(motors.size()));
  for (std::size_t i = 0; i < motors.size(); ++i) {
    Vector2 sum = Vector2::Zero();
    double whole = 0;
    for (const reduced::ActuatorTarget& target : motors[i].targets) {
      if (target.kind != reduced::ActuatorTarget::Kind::kCable) continue;
      if (tip_arm >= 0 && !BelongsTo(model, target.index, tip_arm)) continue;
      double parts = 0;
      const Vector3 bend = target.gain * BendOf(model, target.index, &parts);
      whole += std::abs(target.gain) * parts;
      if (tip_arm < 0) {
        sum += bend.head<2>();
      } else {
        sum += BaseLateral(model.arms[tip_arm].mount.rotation.conjugate() * bend);
      }
    }
    if (sum.norm() > kVanishes * whole) out.col(static_cast<Eigen::Index>(i)) = sum.normalized();
  }
  return out;
}

void AddPull(const Eigen::Matrix2Xd& directions, const Vector2& pull_n,
             Eigen::Ref<VectorX> tensions) {
  for (Eigen::Index i = 0; i < directions.cols(); ++i) {
    tensions(i) += std::max(0.0, directions.col(i).dot(pull_n));
  }
}

Eigen::Matrix2d PullMetric(const Eigen::Matrix2Xd& directions) {
  return 0.5 * directions * directions.transpose();
}

SteeringError HeadingError(const ReducedState& state, const Vector3& aim) {
  SteeringError e;
  const Vector3 b = state.root.rotation.conjugate() * aim;
  const Vector2 lateral = b.head<2>();
  const double size = lateral.norm();
  if (size > kTiny * b.norm()) {
    e.error = std::atan2(size, b.z()) / size * lateral;
  } else if (b.z() < 0) {
    e.error = M_PI * Vector2::UnitX();  // straight behind: any way round
  }
  e.rate = Vector2(-state.v(1), state.v(0));
  return e;
}

Aim::Aim(const ReducedModel& model, const Reference& reference)
    : model_(model), reference_(reference) {
  if (model.mantle) {
    const auto& profile = model.mantle->reference;
    const auto [low, high] = std::minmax_element(
        profile.begin(), profile.end(), [](const auto& a, const auto& b) { return a(1) < b(1); });
    centre_.z() = 0.5 * ((*low)(1) + (*high)(1));
  }
  if (reference.has_tip()) jacobian_.resize(3, model.arms[reference.arm()].size());
}

SteeringError Aim::At(const ReducedState& state, double lookahead_s) {
  if (reference_.has_tip()) return TipError(state, lookahead_s);
  const ReferencePoint ahead = reference_.At(state.time_s + lookahead_s);
  if (!reference_.has_position()) return HeadingError(state, ahead.direction);
  const Vector3 aim = ahead.position - (state.root.position + state.root.rotation * centre_);
  return aim.norm() > kTiny ? HeadingError(state, aim) : SteeringError{};
}

Vector2 Aim::TipTarget(const model::Pose& root, double t_s) const {
  const Pose base = root * model_.arms[reference_.arm()].mount;
  return BaseLateral(base.rotation.conjugate() * (reference_.At(t_s).tip - base.position));
}

SteeringError Aim::TipError(const ReducedState& state, double lookahead_s) {
  const int a = reference_.arm(), first = model_.arm_first(a);
  const reduced::ReducedArm& arm = model_.arms[a];
  Eigen::Ref<Eigen::Matrix3Xd> by(jacobian_);
  const Pose tip = EvaluateTip(arm, state.q.data() + first, &by);
  const Matrix3 to_base = arm.mount.rotation.conjugate().toRotationMatrix();
  const Vector3 velocity = by * state.v.segment(6 + first, by.cols());
  const double ahead = state.time_s + lookahead_s;
  const Vector2 target = TipTarget(state.root, ahead);
  SteeringError e;
  e.error = target - BaseLateral(to_base * (tip.position - arm.mount.position));
  e.rate =
      (TipTarget(state.root, ahead + kRate_s) - target) / kRate_s - BaseLateral(to_base * velocity);
  return e;
}

}  // namespace mantle::controller
