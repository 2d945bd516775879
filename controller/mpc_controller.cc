#include <algorithm>
#include <limits>

#include "controller/controller.h"
#include "controller/gait.h"

namespace mantle::controller {
namespace {

/// Largest state deviation the gains are trusted with: what they ask for beyond the plan [N].
constexpr double kMostFeedback_n = 0.3;
/// Tensions of a controller that has given up fall to their lower limits within about this time.
constexpr double kDecay_s = 0.5;

class MpcController : public Controller {
 public:
  explicit MpcController(const ControllerParts& parts)
      : parts_(parts),
        mpc_(parts.model, parts.step, parts.options, parts.reference),
        expected_(InitialState(parts.model)),
        start_(expected_),
        planned_(expected_),
        held_(VectorX::Zero(parts.model.input_count())),
        deviation_(VectorX::Zero(2 * parts.model.velocity_count())) {}

  void Start(const ReducedState& state) override {
    mpc_.Start(state);
    mpc_.propagator().SetDisturbance(Disturbance(parts_.model.input_count()));
    prepared_s_ = kNever_s;
    first_ = true;
    safe_ = false;
  }

  // About what the last plan expects.
  void Prepare(double t_s, const Eigen::Ref<const VectorX>& tensions) override {
    if (!first_) PrepareAbout(nullptr, t_s, tensions);
  }

  void Update(double t_s, const ReducedState* estimate, const Eigen::Ref<const VectorX>& tensions,
              std::int64_t deadline_ns) override {
    const double delay = parts_.options.delay_s, at = t_s + delay;
    if (prepared_s_ != t_s) PrepareAbout(first_ ? estimate : nullptr, t_s, tensions);
    prepared_s_ = kNever_s;
    // Where the state will be when the plan begins to act.
    start_ = expected_;
    if (estimate == nullptr) {
      start_.q.setConstant(std::numeric_limits<double>::quiet_NaN());
    } else if (delay > 0) {
      held_ = 0.5 * (planned_from_ + tensions);
      const reduced::StepOutcome outcome =
          mpc_.propagator().Step(*estimate, delay, held_, &start_, nullptr);
      if (!outcome.ok) start_ = *estimate;
      start_.time_s = at;
    } else {
      start_ = *estimate;
    }
    if (estimate != nullptr) mpc_.RecordPosition(t_s, estimate->root.position);
    mpc_.Solve(start_, deadline_ns);
    if (mpc_.status().outcome <= Outcome::kStoppedBetter) first_ = false;
    const bool safe = mpc_.status().outcome == Outcome::kSafe;
    if (!safe || !safe_) {  // a decay goes on from where it began
      asked_ = tensions;
      updated_s_ = t_s;
    }
    safe_ = safe;
  }

  void SetDisturbance(const Disturbance& disturbance) override {
    mpc_.propagator().SetDisturbance(disturbance);
  }

  void Command(double t_s, const ReducedState* estimate, Eigen::Ref<VectorX> tensions) override {
    const Plan& plan = mpc_.plan();
    if (safe_) {
      const double share = std::max(0.0, 1.0 - (t_s - updated_s_) / kDecay_s);
      for (Eigen::Index i = 0; i < tensions.size(); ++i) {
        const double low = parts_.options.motors[i].min_tension_n;
        tensions(i) = low + share * (asked_(i) - low);
      }
      return;
    }
    if (t_s < plan.start_s() && asked_.size() > 0) {  // towards the plan's beginning
      const double share = (t_s - updated_s_) / (plan.start_s() - updated_s_);
      tensions = asked_ + share * (plan.tensions.col(0) - asked_);
      return;
    }
    if (t_s > plan.end_s()) {
      GaitTensions(parts_.options.gait, t_s, tensions);
      return;
    }
    TensionsAt(plan, t_s, tensions);
    // State and plan of one instant, that of the estimate.
    if (estimate == nullptr || plan.gains.empty() || estimate->time_s < plan.start_s()) return;
    const int k = IntervalAt(plan, estimate->time_s);
    if (k >= static_cast<int>(plan.gains.size())) return;
    StateAt(plan, estimate->time_s, &planned_);
    StateDifference(planned_, *estimate, deviation_);
    held_.noalias() = plan.gains[k] * deviation_;
    if (!held_.allFinite()) return;
    tensions += held_.cwiseMax(-kMostFeedback_n).cwiseMin(kMostFeedback_n);
  }

  const Mpc* mpc() const override { return &mpc_; }

 private:
  static constexpr double kNoTime_s = 1e-9;
  static constexpr double kNever_s = -std::numeric_limits<double>::infinity();

  void PrepareAbout(const ReducedState* estimate, double t_s,
                    const Eigen::Ref<const VectorX>& tensions) {
    const double delay = parts_.options.delay_s, at = t_s + delay;
    if (estimate != nullptr) {
      expected_ = *estimate;
    } else {
      StateAt(mpc_.plan(), at, &expected_);
    }
    expected_.time_s = at;
    TensionsAt(mpc_.plan(), at, held_);
    if (first_) held_ = tensions;
    LimitTensions(parts_.options.motors, tensions, std::max(delay, kNoTime_s), held_);
    mpc_.Prepare(expected_, held_);
    planned_from_ = held_;
    prepared_s_ = t_s;
  }

  ControllerParts parts_;
  Mpc mpc_;
  ReducedState expected_, start_, planned_;
  VectorX held_, deviation_, asked_, planned_from_;
  double updated_s_{0}, prepared_s_{kNever_s};
  bool first_{true}, safe_{false};
};

}  // namespace

std::unique_ptr<Controller> MakeMpcController(const ControllerParts& parts) {
  return std::make_unique<MpcController>(parts);
}

}  // namespace mantle::controller
