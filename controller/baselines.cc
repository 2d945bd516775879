#include "controller/baselines.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "controller/gait.h"
#include "controller/lqr.h"
#include "reduced/outputs.h"

namespace mantle::controller {
namespace {

// A pull's reaction turns the root at once, against the turn that follows: a derivative that sees
// it makes the arm flutter. On the steering scene this constant costs least.
constexpr double kTurnFilter_s = 0.3;

const BaselineGains& GainsOf(const ControlOptions& options, ControllerKind kind) {
  return options.baselines[static_cast<std::size_t>(kind) - 1];
}

class Baseline : public Controller {
 public:
  Baseline(const ControllerParts& parts, ControllerKind kind)
      : parts_(parts),
        kind_(kind),
        gains_(GainsOf(parts.options, kind)),
        gait_(Scaled(parts.options.gait, 1.0, gains_.gait_period)),
        largest_scale_(LargestScale(gait_, parts.options.motors)),
        directions_(PullDirections(parts.model, parts.reference.arm())),
        aim_(parts.model, parts.reference),
        history_(gait_.period_s + 1.0),
        low_(VectorX::Zero(parts.model.input_count())),
        disturbance_(parts.model.input_count()) {
    for (Eigen::Index i = 0; i < low_.size(); ++i) low_(i) = gait_.motors[i].low_n;
    steers_ = kind != ControllerKind::kGait && directions_.norm() > 0;
    double most = 0;
    for (Eigen::Index i = 0; i < low_.size(); ++i) {
      if (directions_.col(i).norm() == 0) continue;
      most = std::max(most, parts.options.motors[i].max_tension_n - low_(i));
    }
    pid_.most_n = most;
    pid_.proportional = gains_.proportional;
    pid_.derivative = gains_.derivative;
    if (kind == ControllerKind::kPid) pid_.integral = gains_.integral;
    if (steers_ && kind == ControllerKind::kLqr) {
      regulator_.emplace(parts.model, parts.step, parts.options, parts.reference, directions_,
                         gains_);
    }
  }

  void Start(const ReducedState& state) override {
    history_.Reset(state.time_s, state.root.position);
    start_ = state.root;
    before_s_ = state.time_s;
    pid_.sum.setZero();
    turning_.setZero();
    if (regulator_) regulator_->Start();
  }

  void Update(double, const ReducedState*, const Eigen::Ref<const VectorX>&,
              std::int64_t) override {}

  void SetDisturbance(const Disturbance& disturbance) override {
    if (disturbance.bias_n.allFinite() && disturbance.current_m_s.allFinite()) {
      disturbance_ = disturbance;
    }
  }

  void Command(double t_s, const ReducedState* estimate, Eigen::Ref<VectorX> tensions) override {
    const double dt = std::max(t_s - before_s_, 0.0);
    before_s_ = t_s;
    const bool sees = estimate != nullptr && IsFinite(*estimate);
    GaitTensions(gait_, t_s + gains_.gait_lead_s, tensions);
    tensions = low_ + Scale(sees ? estimate : nullptr, t_s) * (tensions - low_);
    if (sees && steers_) AddPull(directions_, Pull(*estimate, dt), tensions);
    for (Eigen::Index i = 0; i < tensions.size(); ++i) {
      const MotorLimits& m = parts_.options.motors[i];
      tensions(i) = std::clamp(tensions(i), m.min_tension_n, m.max_tension_n);
    }
  }

 private:
  Vector2 Pull(const ReducedState& state, double dt) {
    if (regulator_) return regulator_->Update(state, dt, disturbance_, pid_.most_n);
    SteeringError e = aim_.At(state, gains_.lookahead_s);
    if (!parts_.reference.has_tip()) {
      turning_ += dt / (kTurnFilter_s + dt) * (e.rate - turning_);
      e.rate = turning_;
    }
    return pid_.Update(e, dt);
  }

  double Scale(const ReducedState* state, double t_s) {
    double scale = gains_.gait_scale;
    if (const auto* circle = std::get_if<CircleTask>(&parts_.options.goal)) {
      scale *= aim_.TipTarget(start_, t_s + gains_.gait_lead_s).norm() / circle->radius_m;
    } else if (const auto* path = std::get_if<PathTask>(&parts_.options.goal)) {
      scale *= parts_.reference.At(t_s).velocity.norm() / path->speed_m_s;
    }
    if (state != nullptr && kind_ != ControllerKind::kGait && !parts_.reference.has_tip()) {
      scale += gains_.speed_gain * Behind(*state);
    }
    return std::clamp(scale, 0.0, largest_scale_);
  }

  // Way along the track [m], or mean speed [m/s], that is missing.
  double Behind(const ReducedState& state) {
    const ReferencePoint ref = parts_.reference.At(state.time_s);
    if (parts_.reference.has_position()) {
      return (ref.position - state.root.position).dot(ref.direction);
    }
    history_.Add(state.time_s, state.root.position);
    const double period = gait_.period_s;
    const Vector3 way = state.root.position - history_.At(state.time_s - period);
    return (ref.velocity - way / period).dot(ref.direction);
  }

  ControllerParts parts_;
  ControllerKind kind_;
  BaselineGains gains_;
  Gait gait_;
  double largest_scale_;
  Eigen::Matrix2Xd directions_;
  Aim aim_;
  PositionHistory history_;
  VectorX low_;
  Disturbance disturbance_;
  LateralPid pid_;
  std::optional<SteeringRegulator> regulator_;
  model::Pose start_;
  Vector2 turning_{Vector2::Zero()};  ///< filtered rate of the heading error
  bool steers_{false};
  double before_s_{0};
};

}  // namespace

Vector2 LateralPid::Update(const SteeringError& e, double dt_s) {
  const Vector2 direct = proportional * e.error + derivative * e.rate;
  const auto cut = [&](const Vector2& pull) -> Vector2 {
    const double size = pull.norm();
    return size > most_n ? Vector2(most_n / size * pull) : pull;
  };
  const Vector2 step = dt_s * e.error;
  const Vector2 pull = direct + integral * sum;
  if (pull.norm() <= most_n || (integral * step).dot(pull) < 0) sum += step;
  return cut(direct + integral * sum);
}

std::unique_ptr<Controller> MakeBaseline(const ControllerParts& parts, ControllerKind kind) {
  return std::make_unique<Baseline>(parts, kind);
}

}  // namespace mantle::controller
